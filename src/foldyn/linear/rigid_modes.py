"""Rigid modes: which rigid motions nothing resists, and how rigid a shape is."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from foldyn.linear.eigen import EPS
from foldyn.linear.linearized import Linearized
from foldyn.statics.rigid import free_rigid_motions, rigid_motions

ROUNDING = 1e3 * EPS  # of |K| |r|: what counts as no force
INDEPENDENT = 1e-6  # of a motion's size that must be left of it after those before are taken out


def rigid_space(linear: Linearized) -> NDArray:
    """Rigid motions (nf, r) about the state that the supports allow, M-orthonormal.

    Translations along x, y, z come first as far as they are among them, then rotations.
    """
    x = linear.case.structure.nodes + linear.displacement
    allowed = free_rigid_motions(x, linear.case.fixed.ravel())
    plain = rigid_motions(x)
    chosen = np.linalg.lstsq(plain, allowed, rcond=None)[0]
    basis, _ = np.linalg.qr(chosen)
    motions = plain @ (basis @ basis.T)
    on_nodes = linear.free[linear.free < x.size]
    still = np.zeros((len(linear.free) - len(on_nodes), motions.shape[1]))  # turns of a shell's
    return _orthonormal(linear, np.vstack([motions[on_nodes], still]))  # edges are relative


def _orthonormal(linear: Linearized, motions: NDArray) -> NDArray:
    """M-orthonormal columns that span motions (nf, k), in their order, dependent ones left out."""
    kept: list[NDArray] = []
    for motion in motions.T:
        left = motion
        for _ in range(2):  # once more for the rounding of the first time
            for other in kept:
                left = left - other * float(other @ (linear.mass @ left))
        size = _size(linear, left)
        if size > INDEPENDENT * _size(linear, motion) and size > 0.0:
            kept.append(left / size)
    return np.stack(kept, axis=1) if kept else np.zeros((len(linear.free), 0))


def _size(linear: Linearized, motion: NDArray) -> float:
    return float(np.sqrt(motion @ (linear.mass @ motion)))


def unresisted(linear: Linearized, space: NDArray) -> NDArray:
    """Part (nf, k) of the rigid motions (nf, r) that causes no force: modes of frequency zero.

    Loads that keep their direction resist rotations, as gravity does those of a pendulum; without
    them none is resisted in an equilibrium.
    """
    if not space.shape[1]:
        return space
    if _is_null(linear, space).all():
        return space
    _, turned = eigh(space.T @ (linear.stiffness @ space))
    turned = space @ turned
    return turned[:, _is_null(linear, turned)]


def _is_null(linear: Linearized, motions: NDArray) -> NDArray:
    """Whether the stiffness meets each motion (nf, k) with no more than rounding (k,).

    In an equilibrium to within a force r a rotation by w turns that force: |w| r.
    """
    force = np.linalg.norm(linear.stiffness @ motions, axis=0)
    rounding = ROUNDING * np.linalg.norm(abs(linear.stiffness) @ np.abs(motions), axis=0)
    x = linear.case.structure.nodes + linear.displacement
    radius = float(np.linalg.norm(x - x.mean(axis=0), axis=1).max()) or 1.0
    turned = linear.unbalanced * np.abs(motions).max(axis=0) / radius
    return force <= rounding + 2.0 * turned


def rigid_share(linear: Linearized, space: NDArray, shapes: NDArray) -> NDArray:
    """Share (k,) of shapes (nf, k) in the space (nf, r) of rigid motions, weighted by mass."""
    part = space.T @ (linear.mass @ shapes)
    whole = np.einsum("ik,ik->k", shapes, linear.mass @ shapes)
    return (part**2).sum(axis=0) / whole
