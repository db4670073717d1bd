"""Initial state of a motion: taken from a result, checked against supports and their motions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from foldyn.algebra.solvers import factorized
from foldyn.algebra.superlu import SingularTangentError
from foldyn.cases import Case, Continuation, Origin, State
from foldyn.cases.constraints import AGREES, check_tied
from foldyn.cases.contact_checks import check_contact, check_driven
from foldyn.cases.directions import AXES
from foldyn.dynamics.actuation import turn
from foldyn.dynamics.inertia import moving_energy
from foldyn.dynamics.modal_damping import about
from foldyn.dynamics.motion_state import TALLY, MotionState, StepPlan
from foldyn.dynamics.system import PackedCase, carry_supports, place, scratch
from foldyn.dynamics.timing import histories
from foldyn.errors import InputError, ModelRangeWarning, warn
from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.following import following_force
from foldyn.mechanics.inelastic import HingeMemory
from foldyn.mechanics.springs import SpringsTerm
from foldyn.results.contents import check_variable
from foldyn.results.quantities import CONTINUATIONS, ORIGIN
from foldyn.values import whole

MODAL = "modal"  # the method of motions of superelements
FIRST = 0.15  # ratio of first to largest step, divided by the fifth root of the tolerance
SLOW_WIND = 0.05  # a wind below this share of the initial speed is negligible
LOOKS = 501  # times at which supports, planes and cables are checked, apart from knots
ZERO = 1e-10  # eigenvalues below this share of the largest stiffness count as zero


def initial_state(result: Any, at: int = -1) -> State:
    """State at sample `at` of a result (dims time or step, node, axis), to start a motion from.

    Parameters
    ----------
    result : xarray.Dataset
        A trajectory or a path. Damping with ``state = "initial"`` and added mass keep their values
        from a trajectory; a plain `State` of the same displacement and velocity resets them.
    at : int, default -1
        Number of the sample; negative numbers count from the end.
    """
    if not hasattr(result, "sizes") or "displacement" not in result:
        raise InputError(f"initial_state: got {type(result).__name__}, give a result (a dataset)")
    for dimension in ("time", "step"):
        if dimension in result.sizes:
            if dimension in result.variables:  # the stored coordinate may be damaged
                check_variable(result, dimension, (dimension,), place="initial_state: ")
            count = result.sizes[dimension]
            break
    else:
        raise InputError("initial_state: the result has neither a time nor a step dimension")
    at = whole("at", at)
    if not -count <= at < count:
        raise InputError(f" = {at}: the result has samples 0 to {count - 1}", "at")
    sample = result.isel({dimension: at})
    of_nodes = ("node", "axis")
    known = {"displacement": of_nodes, "velocity": of_nodes, "memory": ("branch", "variable")}
    state: dict[str, Any] = {
        name: check_variable(sample, name, dims, place="initial_state: ").to_numpy()
        for name, dims in known.items()
        if name in sample
    }
    if "time" not in sample:
        return State(**state)
    continuation = _continuation(sample)
    if continuation is None and result.attrs.get("method") == MODAL:
        warn(
            f"initial_state: at = {at}: a motion of superelements keeps the vibrations of panels "
            "between their vertices at its end only; from other samples panels start in balance "
            "with their vertices: compute the motion up to there, and continue it from its end",
            "superelements.md#motions",
        )
    return State(**state, continuation=continuation, origin=origin_of(sample, "initial_state: "))


def origin_of(sample: Any, place: str) -> Origin | None:
    """Origin of the motion that a sample belongs to, if its result stores one."""

    def known(name: str) -> NDArray:
        return check_variable(sample, name, ORIGIN[name].dims, place=place).to_numpy()

    if "origin" not in sample:
        return None
    begun = float(known("origin_time"))
    origin = Origin(known("origin"), None if np.isnan(begun) else begun)
    if "flow" not in sample or known("flow_time") != float(sample["time"]):
        return origin
    return replace(origin, flow=known("flow"), looked=int(known("flow_looked")))


def _continuation(sample: Any) -> Continuation | None:
    """Data that an implicit method stored with the sample to continue from it, if any."""
    for name in CONTINUATIONS:
        if name in sample:
            found = check_variable(sample, name, ("continued",), place="initial_state: ")
            method, time = found.attrs.get("method"), found.attrs.get("time")
            if isinstance(method, str) and time == float(sample["time"]):
                return Continuation(method, found.to_numpy())
    return None


def check_start(case: Case, initial: State | None) -> tuple[NDArray, NDArray]:
    """Check the initial state; return displacement and velocity (n, 3)."""
    if initial is not None and not isinstance(initial, State):
        raise InputError(
            f"initial: got {type(initial).__name__}; give a State: fd.State(displacement=..., "
            "velocity=...) or fd.initial_state(result)"
        )
    begun, shape = initial or State(), case.structure.nodes.shape
    u = np.ascontiguousarray(begun.of_nodes("displacement", shape))
    v = np.ascontiguousarray(begun.of_nodes("velocity", shape))
    if (v[case.still] != 0.0).any():
        node = int(np.argwhere((v != 0.0) & case.still)[0][0])
        raise InputError(f"initial: velocity of node {node} is not zero along a supported axis")
    check_tied(case, u, "initial")
    _check_tied_velocity(case, v)
    return u, v


def check_touching(case: Case, u: NDArray, start: float, end: float) -> None:
    """Refuse impossible contact in a motion from displacements u (n, 3) at `start` (s)."""
    obstacles = [history for _, history in case.obstacle_terms]
    check_contact(case, u, case.planes_moved(float(history(start)) for history in obstacles))
    driven = (*case.imposed_terms, *case.base_terms)
    if case.contact is None or not (driven or obstacles):
        return
    given = [*obstacles, *(history for _, history in driven)]
    turns = [t for history in given for t in history.knots() or () if start < t < end]
    times = np.union1d(np.linspace(start, end, LOOKS), turns)
    try:
        factors = np.array([np.broadcast_to(history(times), times.shape) for history in given])
    except InputError:  # a failing function: the motion will stop there, with the reason
        return
    along, shapes = factors[len(obstacles) :], [shape for shape, _ in driven]
    steps = (along - along[:, :1]).T
    moved = (sum((f * s for f, s in zip(step, shapes, strict=True)), u) for step in steps)
    planes = map(case.planes_moved, factors[: len(obstacles)].T)
    check_driven(case, zip((f"t = {time:.6g} s" for time in times), moved, planes, strict=True))


def _check_tied_velocity(case: Case, velocity: NDArray) -> None:
    """Refuse velocities (n, 3), m/s, that violate constraints."""
    ties = case.constraints
    if not ties:
        return
    speed = np.abs(ties.values(velocity))
    for vector, _ in (*case.imposed_terms, *case.base_terms):  # supports that move
        speed[np.abs(ties.values(vector)) > AGREES * np.abs(vector).max()] = 0.0
    if speed.max() > AGREES * np.abs(velocity).max():
        worst = int(speed.argmax())
        raise InputError(
            f": velocity of node {ties.equations[worst].dofs[0] // 3} does not satisfy "
            f"{ties.owners[worst]}; nodes that are tied together move together",
            "initial",
        )


def _check_lengths(springs: SpringsTerm, times: NDArray) -> None:
    """Refuse winches that leave nothing of their cable at one of some times, s."""
    lines = springs.springs.lines
    for line in np.flatnonzero(lines.scaled & (lines.row[:, 0] >= 0)).tolist():
        factor = springs.histories[lines.row[line, 0]](times)
        gone = lines.natural[line] + lines.change[line] * factor <= 0.0
        if gone.any():
            raise InputError(
                f"supports: the change of a cable (line {line}) leaves nothing of its "
                f"{lines.natural[line]:.6g} m at t = {times[gone][0]:.6g} s; give a smaller change"
            )


def check_steady(case: Case, start: float, end: float) -> None:
    """Refuse jumps of supports, planes and folds, and of the wind with added mass.

    Refuses cables that a winch would use up, too.
    """
    springs = case.elastic_body.find(SpringsTerm)
    if springs is not None:
        _check_lengths(springs, np.linspace(start, end, LOOKS))
    for what, history in histories(case):
        times = [time for time in history.jumps() if start < time < end]
        drags = what == "the wind" and not (case.air and case.air.added_mass)
        if times and what != "a load" and not drags:
            sections = {"an actuation": "loads", "the wind": "air", "a plane": "contact"}
            section = sections.get(what, "supports")
            instead = ", or added_mass = false" if section == "air" else ""
            raise InputError(
                f"{section}: {what} with the history {history.kind} jumps at t = {times[0]:g} s, "
                f"but nothing can move instantly: use a ramp, a half sine or a table{instead}"
            )


def warn_of_unstable_damping(case: Case, start: Origin) -> None:
    """Warn if stiffness-proportional damping uses a start where the stiffness is indefinite."""
    if case.rayleigh.beta == 0.0 or case.rayleigh.state != "initial":
        return
    free = np.asarray(case.free_dofs)
    place, body = about(case, start)
    whole = case.constraints.matrix(body.tangent(body.dofs(place)))
    matrix = sparse.csc_array(whole[free][:, free])
    shift = ZERO * float(np.abs(matrix.diagonal()).max())  # rigid motions and slack bends: zero
    try:
        factors = factorized(sparse.csc_array(matrix + shift * sparse.eye_array(len(free))))
        negative = factors.negative()
    except SingularTangentError:
        return
    if negative:
        warn(
            f'damping: with state = "initial" beta K0 drives {negative} '
            f"motion{'s' if negative > 1 else ''} instead of damping "
            f"{'them' if negative > 1 else 'it'}: the stiffness is not positive where the motion "
            'starts; take state = "rest", or start from a stable state',
            "damping.md#rayleigh",
        )


def warn_of_standing_in_wind(case: Case, v: NDArray) -> None:
    """Warn that added mass misses a moment on panels in a wind, unless the sheet is much faster.

    v : (n, 3) velocities at the start, m/s.
    """
    air = case.air
    if air is None or air.added_mass is not True:
        return
    wind = float(np.linalg.norm(air.velocity))
    panels = len(np.unique(case.structure.triangle_panel))
    if panels > 1 and wind > SLOW_WIND * float(np.linalg.norm(v, axis=1).max()):
        warn(
            f"air: in a wind of {wind:g} m/s a moment on stationary panels is missing, of up to "
            "0.3 times 1/2 density U^2 A a/2 (U the wind, A and a a panel's area and width), since "
            "the flow is computed again only when a hinge has turned by 3 degrees; "
            'added_mass = "local" includes this moment, but treats each panel alone',
            "air.md#limits",
            ModelRangeWarning,
        )


def following(body: Assembly, q: NDArray) -> Callable[[NDArray], NDArray]:
    """Function from a motion (m,) of nodes about q (m,) to that of the hidden dofs in balance."""
    rows = sparse.csr_array(body.tangent(q))[body.hidden]
    first = body.size - len(body.hidden)
    solve = splu(sparse.csc_array(rows[:, first:])).solve
    return lambda motion: -solve(rows[:, :first] @ motion[:first])


def check_imposed(case: Case, u: NDArray, carried: NDArray) -> None:
    """Refuse displacements u (n, 3) at the start where `Impose` asks for others.

    carried : (n, 3) displacements of moving supports, m.
    """
    q = u - carried
    apart = np.where(case.imposed, np.abs(q), 0.0)
    slaves = case.imposed_slaves
    apart.ravel()[slaves] = np.abs(case.constraints.coordinates(q.ravel()))[slaves]
    if apart.max() > AGREES * case.body.sheet.longest():
        node, axis = (int(k) for k in np.unravel_index(apart.argmax(), apart.shape))
        raise InputError(
            f"supports: node {node} is imposed {carried[node, axis]:.6g} m along "
            f"{AXES[axis]} at the start, but stands at {u[node, axis]:.6g} m: give a history that "
            "begins there, as a ramp does from rest, or start from a state that has been brought "
            "there"
        )


def begin(
    case: Case, u: NDArray, v: NDArray, remembered: NDArray | str | None,
    continued: Continuation | None, plan: StepPlan, packed: PackedCase,
) -> MotionState:  # fmt: skip
    """State of the integrators at the start of a motion with displacement u and velocity v.

    remembered : state of hinges with memory, see `Memory.start`.
    continued : initial values of massless dofs, if known.
    """
    body, system, mass, callbacks, by, *_ = packed
    s = scratch(system)
    still = np.zeros((system.rows, 3))
    place(system, still, still, plan.start, s)
    if callbacks.error is not None:
        raise callbacks.error
    carried, imposed = by.outward(s.displacement), case.imposed
    prescribed = np.where(case.fixed, v, 0.0)
    if ties := case.constraints:
        values = ties.values(v)
        values[np.abs(values) <= AGREES * np.abs(v).max()] = 0.0  # or rounding would contradict
        prescribed = ties.moved(prescribed, values, "initial")
    q, w = u - carried, v - by.outward(carry_supports(mass, by.inward(prescribed)))
    check_imposed(case, u, carried)
    q[imposed] = 0.0
    tally = np.zeros(1, TALLY)[0]
    tally.work = -moving_energy(system.moved_mass, s.factor)
    first = min(1.0, FIRST * plan.tolerance**0.2) * plan.dt
    tally.time, tally.wanted, tally.error, tally.shortest = plan.start, first, 1e-4, np.inf
    inward, moving, memory = by.inward(q), by.inward(w), body.find(HingeMemory)
    if system.turns:
        turn(system.actuators, s.factor)
        system.actuators.offset[:, 2] = system.actuators.offset[:, 0]
        system.actuators.offset[:, 3] = np.nan  # no moment known yet
    if len(body.hidden):  # massless dofs start in balance
        push = following_force(system.following, inward.ravel(), s.factor)
        resists = memory if memory is not None and memory.resists(remembered) else None
        if memory is not None and memory.owns_hidden:  # latches that hold
            memory.start(by.inward(u), remembered)
            resists = None
        there = body.dofs(by.inward(u)[: len(u)], push, resists)
        inward.ravel()[body.hidden] = there[body.hidden]
        if len(mass.hidden):  # and so do their velocities
            speed = by.inward(v)
            moving.ravel()[body.hidden] = following(body, there)(speed.ravel())
        if continued is not None and len(continued.values) > inward.size:
            inward.ravel()[body.hidden] = continued.values[body.hidden]
            if len(mass.hidden):
                speed = continued.values[inward.size :]
                moving.ravel()[body.hidden] = speed[body.hidden]
    if memory is not None:
        there = by.inward(u)
        there.ravel()[body.hidden] = inward.ravel()[body.hidden]
        memory.start(there, remembered)
    carry, angle = np.zeros_like(inward), body.angles(by.inward(u))
    return MotionState(u=inward, v=moving, carry=carry, tally=tally, angle=angle)
