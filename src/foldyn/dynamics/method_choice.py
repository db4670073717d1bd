"""The choice between explicit and implicit integration, with the reason in words.

The cost of each is estimated as number of steps times cost per step. An explicit method always
takes half its critical step. An implicit method takes steps that resolve the motion, at a frequency
estimated here, to the requested tolerance, and that end at samples.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.solvers import factorized
from foldyn.algebra.superlu import SingularTangentError
from foldyn.cases import Case, History
from foldyn.dynamics.audit import INACCURATE
from foldyn.dynamics.inertia import is_lumped
from foldyn.dynamics.methods import METHODS, lacking
from foldyn.dynamics.modal_damping import ModalRows
from foldyn.dynamics.timing import DEFAULT_FRACTION, histories
from foldyn.errors import InputError
from foldyn.mechanics.following import following_force

AUTO = "auto"
LONG = 30.0  # periods above which an undamped motion needs a conserving method
CONTENT = 2.0  # factor on the number of steps, because faster vibrations add to the estimated one
FEWEST = 50.0  # least number of steps of an implicit run
MOST_TIMES = 4000  # largest number of times at which loads are evaluated
AT_REST = 1e-6  # out-of-balance forces below this share of the loads set nothing in motion
SMOOTH = 1e-3  # least assumed share of the displacement that vibrates
RESOLVED = 0.2  # rad per step of a vibration: RK4 loses 1 % of its energy in 11,000 steps
ACCURATE = "dormand_prince"
DEARER = 10.0  # a more accurate method may cost this many times as much


class Choice(NamedTuple):
    """A method, the reason for it, and a fallback if its energies do not balance.

    If the errors of the method do not accumulate, the fallback is the same method with a shorter
    step.
    """

    method: str
    reason: str
    better: str | None = None


def choose(
    case: Case, u: NDArray, v: NDArray, start: float, duration: float, dt: float | None,
    interval: float, tolerance: float | None, default: float, modal: ModalRows,
) -> Choice:  # fmt: skip
    """Choose the faster method for a motion from u and v (n, 3) at `start`, with the reason.

    dt and tolerance are arguments of `simulate`; default is the tolerance of implicit methods if
    tolerance is None. interval is the time between samples (s), 0.0 if steps are counted instead.
    modal is the modal damping of the motion.
    """
    if case.structure.linear:
        raise InputError(f": {lacking(METHODS[ACCURATE], case)}; take another model", "structure")
    if case.air is not None and case.air.added_mass:
        return Choice(ACCURATE, "explicit: the added mass of the air moves with the panels")
    drag = case.air is not None and case.air.drag
    conserved = not (case.damped or drag or case.remembering or any(histories(case)))
    implicit = "energy_momentum" if conserved else "generalized_alpha"
    massless = case.structure.massless
    if case.contact is not None and not (massless and case.structure.divisions):
        return Choice(ACCURATE, "explicit: its error resolves impacts")
    if massless:
        return Choice("generalized_alpha", f"implicit: {massless} have no mass")
    if (case.mass.diagonal() <= 0.0)[~case.constraints.determined.all(axis=1)].any():
        return Choice(implicit, "implicit: nodes without mass have no acceleration")
    omega = frequency(case, u, v, duration)
    lasting = conserved and duration * omega > 2.0 * math.pi * LONG
    explicit, why = "central_difference" if lasting else "rk4", ""
    critical = METHODS[explicit].critical_step(case, u, modal)
    accurate = explicit if lasting else ACCURATE
    if dt is not None and tolerance is None and dt > critical:
        return Choice(implicit, f"implicit: dt is above the critical step of {critical:.2g} s")
    step = DEFAULT_FRACTION * critical if dt is None else float(dt)
    if tolerance is not None:
        explicit, accurate = ACCURATE, None
    elif accurate == ACCURATE and (share := fast_share(case, u, v, RESOLVED / step)) > INACCURATE:
        why = f"{share:.0%} of the initial kinetic energy is in vibrations that steps of "
        why = f"; {why}{step:.2g} s do not resolve"
        explicit, accurate = ACCURATE, None
    if dt is not None and tolerance is None:
        reason = f"explicit: dt is within the critical step of {critical:.2g} s{why}"
        return Choice(explicit, reason, accurate)
    critical = METHODS[explicit].critical_step(case, u, modal)
    many = duration / (DEFAULT_FRACTION * critical)
    share = vibrating_share(case, u, v, start, duration, omega)
    few = CONTENT * duration * omega * (share / (12.0 * (tolerance or default))) ** (1.0 / 3.0)
    few = max(few, FEWEST, duration / interval if interval else 0.0)
    costs = (
        many * _explicit_cost(case, METHODS[explicit].evaluations),
        few * _implicit_cost(case, conserved),
    )
    estimate = (
        f"about {_round(many)} explicit steps (critical step {critical:.2g} s) take "
        f"{_seconds(costs[0])}, {_round(few)} implicit ones {_seconds(costs[1])}, by estimate"
    )
    if costs[0] <= costs[1]:
        return Choice(explicit, f"explicit: {estimate}{why}", accurate)
    within_reach = costs[0] <= DEARER * costs[1]
    return Choice(implicit, f"implicit: {estimate}", ACCURATE if within_reach else None)


def _explicit_cost(case: Case, evaluations: int) -> float:
    """Seconds per explicit step, measured between 39 and 22,000 dofs."""
    substitution = 1.0 if is_lumped(case.mass) else 2.0
    return evaluations * (5e-7 + 2.5e-8 * substitution * case.structure.nodes.size)


def _implicit_cost(case: Case, conserved: bool) -> float:
    """Measured seconds per implicit step with residuals, tangents and factorizations.

    The conserving method costs more: discrete-gradient forces and unsymmetric matrices.
    """
    dofs = case.structure.nodes.size
    factorization = 6e-5 * (dofs / 333.0) ** 1.85
    return (2.5 if conserved else 1.0) * (1e-4 + 1.2e-6 * dofs + 1.5 * factorization)


def _round(count: float) -> str:
    return f"{float(f'{count:.2g}'):,.0f}"


def _seconds(cost: float) -> str:
    return f"{float(f'{cost:.2g}'):,g} s"


def frequency(case: Case, u: NDArray, v: NDArray, duration: float) -> float:
    """Angular frequency (rad/s) of the motion caused by loads, supports and the initial state.

    The largest of three estimates: Rayleigh's quotient of the displacements under slow loads (as
    slow as the duration, for bodies without supports), Rayleigh's quotient of the deforming part
    of the initial velocity, and the angular velocity of its rigid part. Hinges have at least their
    nominal stiffness.
    """
    structure, free = case.structure, np.asarray(case.free_dofs)
    stiffness = case.elastic_body.tangent(u, 1.0)
    ties = case.constraints
    force = ties.force(_applied(case, u) - stiffness @ _imposed(case))
    k = ties.matrix(stiffness)[free][:, free]
    m = case.free_mass
    spin, deforming, moving = _split(structure.nodes + u, v)
    pairs, square = [(deforming.ravel()[free], moving.ravel()[free])], spin**2
    softest = (2.0 * math.pi / duration) ** 2
    try:
        x = factorized(sparse.csc_array(k + softest * m)).solve(force[free])
        pairs.append((x, x))
    except SingularTangentError:
        pass
    for shape, whole in pairs:
        kinetic = float(whole @ (m @ whole))
        if kinetic > 0.0:
            square = max(square, float(shape @ (k @ shape)) / kinetic)
    return math.sqrt(square)


def fast_share(case: Case, u: NDArray, v: NDArray, omega: float) -> float:
    """Share of the kinetic energy of v (n, 3) in vibrations about u faster than omega (rad/s).

    A vibration of frequency w counts with (w^2 / (w^2 + omega^2))^2 of its energy; hinges have at
    least their nominal stiffness.
    """
    free, m = np.asarray(case.free_dofs), case.free_mass
    moving = v.ravel()[free]
    momentum = m @ moving
    energy = float(moving @ momentum)
    if energy == 0.0 or not math.isfinite(omega):
        return 0.0
    k = case.constraints.matrix(case.elastic_body.tangent(u, 1.0))[free][:, free]
    try:
        slow = factorized(sparse.csc_array(k + omega**2 * m)).solve(omega**2 * momentum)
    except SingularTangentError:
        return 0.0
    return float((moving - slow) @ (m @ (moving - slow))) / energy


def vibrating_share(
    case: Case, u: NDArray, v: NDArray, start: float, duration: float, omega: float
) -> float:
    """Share of the displacement that vibrates: 1 after a release, less under slow loads.

    For a motion that starts at rest and in balance, the share is the curvature of the load factors
    over half a period, relative to the size of the factors.
    """
    if v.any() or _out_of_balance(case, u, start):
        return 1.0
    step = 0.5 * math.pi / omega if omega > 0.0 else duration
    times = start + np.linspace(0.0, duration, min(MOST_TIMES, 2 + math.ceil(duration / step)))
    share = SMOOTH
    for _, history in histories(case):
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


def _loads(case: Case, u: NDArray) -> Iterator[tuple[NDArray, History]]:
    """Loads (n, 3), N, at u and factor 1, with their histories."""
    yield from case.load_terms
    for part, history in case.following_terms:
        yield following_force(part, u.ravel(), np.ones((1, 1))).reshape(u.shape), history


def _applied(case: Case, u: NDArray) -> NDArray:
    """Forces (3n,), N, that loads and actuated folds apply at u, without internal forces."""
    body = case.elastic_body
    force = -body.internal(u)
    for load, _ in _loads(case, u):
        force += load.ravel()
    change = sum((turn for turn, _ in case.rest_terms), np.zeros_like(body.sheet.rest_angles))
    if change.any():
        linear = body.nominal(u)
        force -= linear.folded(linear.sheet.rest_angles + change).internal(u) - linear.internal(u)
    return force


def _imposed(case: Case) -> NDArray:
    """Displacements (3n,) of supports at factor 1, m."""
    moves = (*case.imposed_terms, *case.base_terms)
    return sum((shape for shape, _ in moves), np.zeros(case.structure.nodes.shape)).ravel()


def _out_of_balance(case: Case, u: NDArray, start: float) -> bool:
    """Whether forces at the start set the structure in motion immediately."""
    internal = case.elastic_body.internal(u).reshape(u.shape)
    force, size = -internal, float(np.abs(internal[case.fixed]).max(initial=0.0))
    for load, history in _loads(case, u):
        force = force + history(start) * load
        size = max(size, float(np.abs(load).max()))
    free = case.constraints.force(force.ravel())[case.free_dofs]
    return float(np.abs(free).max(initial=0.0)) > AT_REST * size


def _split(x: NDArray, v: NDArray) -> tuple[float, NDArray, NDArray]:
    """Angular velocity (rad/s) of v at x (n, 3); v without its rigid part; mean of v."""
    arm, rest = x - x.mean(axis=0), v - v.mean(axis=0)
    inertia = (arm**2).sum() * np.eye(3) - arm.T @ arm
    spin = np.linalg.lstsq(inertia, np.cross(arm, rest).sum(axis=0), rcond=None)[0]
    return float(np.linalg.norm(spin)), rest - np.cross(spin, arm), rest
