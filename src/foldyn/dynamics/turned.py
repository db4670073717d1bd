"""Energy that constant damping takes from turning panels, although rotation causes no strain.

Beta K0 and modal damping use the matrix C of one state, with the panel orientations of that state.
Consider a panel that has turned by theta about an axis a and keeps turning at the rate w. C takes
its velocity for a rotation plus a straining motion w sin(theta) a x (a x x), which dissipates the
power w^2 sin^2(theta) kappa,

    kappa = x' A C A x,    A = a a' - 1,

and the energy w kappa (theta / 2 - sin(2 theta) / 4) up to theta. Each panel takes a share
proportional to its area.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.dynamics.system import PackedCase

SHARE = 0.01  # threshold of the warning, as a share of the energies at play


def resists_turns(case: Case, packed: PackedCase) -> bool:
    """Whether a case has panels and beta K0 or modal damping."""
    constant = case.rayleigh.beta > 0.0 or len(packed.modal.rows) > 0
    return constant and len(case.structure.triangles) > 0


def turns_told(
    case: Case, packed: PackedCase, start: NDArray, displacement: NDArray, velocity: NDArray,
    scale: float,
) -> str:  # fmt: skip
    """Warning about a motion in which panels turn far; empty if they do not.

    start : (n, 3) displacement at the start, m.
    displacement, velocity : (k, n, 3) at some samples, m and m/s.
    scale : energies at play, J.
    """
    if scale == 0.0 or not (np.isfinite(displacement).all() and np.isfinite(velocity).all()):
        return ""
    farthest, energy = turned(case, packed, start, displacement, velocity)
    if energy <= SHARE * scale:
        return ""
    kinds = ["beta"] if case.rayleigh.beta else []
    kinds += ["modal damping"] if len(packed.modal.rows) else []
    fits = case.structure.body.strains() is not None
    remedy = "fd.StrainDamping (strain in a case file)" if fits else "fd.CreaseDamping"
    return (
        f"damping: {' and '.join(kinds)} resist{'s' if len(kinds) == 1 else ''} rotations: panels "
        f"turn by up to {math.degrees(farthest):.3g} degrees, which dissipates about "
        f"{min(energy / scale, 1.0):.0%} of the energies at play, although turns strain "
        f"nothing; use {remedy}, which follows the motion"
    )


def turned(
    case: Case, packed: PackedCase, start: NDArray, displacement: NDArray, velocity: NDArray
) -> tuple[float, float]:
    """Largest turn (rad) of a panel, and the energy (J) taken from all turning panels."""
    nodes, tri = case.structure.nodes, case.structure.triangles
    modal = case.modal_damping
    states = {case.rayleigh.state if case.rayleigh.beta else "", modal.state if modal else ""}
    there = start if "initial" in states else np.zeros_like(start)
    before, area = _frames((nodes + there)[tri])
    turn = _frames((nodes + displacement)[:, tri])[0] @ np.swapaxes(before, -1, -2)
    angle = np.arccos(np.clip(0.5 * (np.trace(turn, axis1=-2, axis2=-1) - 1.0), -1.0, 1.0))
    last = angle.argmax(axis=0)
    panel = np.arange(len(tri))
    own, theta = turn[last, panel], angle[last, panel]
    axis = (own - own.swapaxes(1, 2))[:, [2, 0, 1], [1, 2, 0]]
    axis /= np.maximum(np.linalg.norm(axis, axis=1, keepdims=True), 1e-300)
    rate = _rates((nodes + displacement)[:, tri], velocity[:, tri]).max(axis=0)
    bent = (axis[:, :, None] * axis[:, None, :] - np.eye(3)).reshape(-1, 9)
    kappa = np.einsum("ta,ab,tb->t", bent, _strained(case, packed, there), bent)
    taken = kappa * rate * (0.5 * theta - 0.25 * np.sin(2.0 * theta))
    return float(theta.max()), float(taken @ area) / float(area.sum())


def _strained(case: Case, packed: PackedCase, there: NDArray) -> NDArray:
    """F' C F (9, 9), with F the fields E x for each unit matrix E, x the positions at `there`."""
    x = case.structure.nodes + there
    x -= x.mean(axis=0)
    fields = np.einsum("ac,nb->nacb", np.eye(3), x).reshape(x.size, 9)
    out, beta, body = np.zeros((9, 9)), case.rayleigh.beta, case.elastic_body
    if beta:
        k = body.tangent(body.dofs(there))
        out += beta * (fields.T @ (k[: x.size, : x.size] @ fields))
    seen = packed.modal.rows[:, : x.size] @ fields
    return out + seen.T @ seen


def _frames(corners: NDArray) -> tuple[NDArray, NDArray]:
    """Direction columns (..., 3, 3) of triangles (..., 3, 3), and their areas (...)."""
    first, second = corners[..., 1, :] - corners[..., 0, :], corners[..., 2, :] - corners[..., 0, :]
    normal = np.cross(first, second)
    double = np.linalg.norm(normal, axis=-1)
    one = first / np.linalg.norm(first, axis=-1, keepdims=True)
    up = normal / double[..., None]
    return np.stack([one, np.cross(up, one), up], axis=-1), 0.5 * double


def _rates(corners: NDArray, velocity: NDArray) -> NDArray:
    """Magnitudes of the angular velocities (...), rad/s, of triangles (..., 3, 3)."""
    arm = corners - corners.mean(axis=-2, keepdims=True)
    moving = velocity - velocity.mean(axis=-2, keepdims=True)
    spin = np.cross(arm, moving).sum(axis=-2)
    square = np.einsum("...ia,...ib->...ab", arm, arm)
    inertia = np.trace(square, axis1=-2, axis2=-1)[..., None, None] * np.eye(3) - square
    return np.linalg.norm(np.linalg.solve(inertia, spin[..., None])[..., 0], axis=-1)
