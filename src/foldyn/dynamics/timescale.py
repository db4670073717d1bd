"""How fast a case will move, estimated before it does: what an implicit step has to resolve."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.superlu import SingularTangentError, SuperLU
from foldyn.cases import Case

MOST_TIMES = 4000  # at which loads are looked at
AT_REST = 1e-6  # of the loads: out-of-balance forces below that set nothing in motion
SMOOTH = 1e-3  # the least share of a vibration that is reckoned with


def frequency(case: Case, u: NDArray, v: NDArray, duration: float) -> float:
    """Angular frequency (rad/s) of what loads, supports and the initial state set in motion.

    Rayleigh's quotient of the displacements that they would cause if they acted slowly (over the
    duration, for bodies that nothing holds) and of the deforming part of the initial velocity, or
    the angular velocity of its rigid part. Hinges count with at least their nominal stiffness.
    """
    structure, free = case.structure, np.asarray(case.free_dofs)
    stiffness = structure.body.tangent(u, 1.0)
    force = _applied(case, u) - stiffness @ _imposed(case)
    k = stiffness[free][:, free]
    m = sparse.kron(structure.mass, sparse.eye_array(3), format="csr")[free][:, free]
    spin, deforming, moving = _split(structure.nodes + u, v)
    pairs, found = [(deforming.ravel()[free], moving.ravel()[free])], spin**2
    softest = (2.0 * math.pi / duration) ** 2
    try:
        x = SuperLU(sparse.csc_array(k + softest * m)).solve(force[free])
        pairs.append((x, x))
    except SingularTangentError:
        pass
    for shape, whole in pairs:
        kinetic = float(whole @ (m @ whole))
        if kinetic > 0.0:
            found = max(found, float(shape @ (k @ shape)) / kinetic)
    return math.sqrt(found)


def vibrating_share(
    case: Case, u: NDArray, v: NDArray, start: float, duration: float, omega: float
) -> float:
    """Share of the displacement that vibrates: 1 for what is let go, less for what is slow.

    Of a motion from rest in balance: how far the factors bend within half a period, relative to
    their size.
    """
    if v.any() or _out_of_balance(case, u, start):
        return 1.0
    terms = (*case.load_terms, *case.imposed_terms, *case.base_terms, *case.actuation_terms)
    step = 0.5 * math.pi / omega if omega > 0.0 else duration
    times = start + np.linspace(0.0, duration, min(MOST_TIMES, 2 + math.ceil(duration / step)))
    share = SMOOTH
    for _, history in terms:
        turns = [t for t in history.knots() or () if start < t < start + duration]
        if any(start < jump < start + duration for jump in history.jumps()):
            return 1.0
        if len(turns) and np.diff(turns, prepend=start).min() < step:  # a pulse
            return 1.0
        before, now, after = (history(np.maximum(times + k * step, start)) for k in (-1, 0, 1))
        size = float(np.abs(now).max())
        if size > 0.0:
            share = max(share, float(np.abs(before - 2.0 * now + after).max()) / size)
    return min(share, 1.0)


def _applied(case: Case, u: NDArray) -> NDArray:
    """Forces (3n,) at u that loads and actuated folds exert beside the internal ones, N."""
    body = case.structure.body
    force = -body.internal(u)
    for load, _ in case.load_terms:
        force += load.ravel()
    change = np.zeros(len(case.structure.folds))
    for turn, _ in case.actuation_terms:
        change += turn
    if change.any():
        linear = body.nominal(u)
        force -= linear.folded(linear.fold_rest + change).internal(u) - linear.internal(u)
    return force


def _imposed(case: Case) -> NDArray:
    """Displacements (3n,) of supports at factor 1, m."""
    moved = np.zeros(case.structure.nodes.shape)
    for shape, _ in (*case.imposed_terms, *case.base_terms):
        moved += shape
    return moved.ravel()


def _out_of_balance(case: Case, u: NDArray, start: float) -> bool:
    """Whether forces at the start set the structure in motion at once."""
    internal = case.structure.body.internal(u).reshape(u.shape)
    force, size = -internal, float(np.abs(internal[case.fixed]).max(initial=0.0))
    for load, history in case.load_terms:
        force = force + history(start) * load
        size = max(size, float(np.abs(load).max()))
    return float(np.abs(force[~case.fixed]).max(initial=0.0)) > AT_REST * size


def _split(x: NDArray, v: NDArray) -> tuple[float, NDArray, NDArray]:
    """Angular velocity (rad/s) of velocities v at x (n, 3), v less its rigid part and its mean."""
    arm, rest = x - x.mean(axis=0), v - v.mean(axis=0)
    inertia = (arm**2).sum() * np.eye(3) - arm.T @ arm
    spin = np.linalg.lstsq(inertia, np.cross(arm, rest).sum(axis=0), rcond=None)[0]
    return float(np.linalg.norm(spin)), rest - np.cross(spin, arm), rest
