"""`simulate_many`: motions of many models of one topology in one call, side by side."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numba import config
from numpy.typing import NDArray

from foldyn.cases import Case, State
from foldyn.dynamics import timing
from foldyn.dynamics.audit import Balance, Rounding, audited
from foldyn.dynamics.course import Course, StepPlan
from foldyn.dynamics.damping import has_dampers
from foldyn.dynamics.doubts import INACCURATE
from foldyn.dynamics.inertia import check_mass
from foldyn.dynamics.initial import begin, check_start
from foldyn.dynamics.lane_steps import (
    NOT_FINITE,
    PENETRATION,
    LaneLoads,
    LaneSamples,
    LaneState,
    advance_lanes,
)
from foldyn.dynamics.methods import METHODS, suited, with_mass
from foldyn.dynamics.modal_damping import modal_rows
from foldyn.dynamics.motion import EXPLODED
from foldyn.dynamics.system import Packed, pack
from foldyn.errors import FoldynWarning, InputError
from foldyn.mechanics.lanes import WIDTH, lane_work, lanes, side_by_side, topology
from foldyn.mechanics.model import BarsHinges
from foldyn.results.dataset import result_dataset
from foldyn.results.quantities import MOTION, energies_of, variable
from foldyn.values import number, show, whole

if TYPE_CHECKING:
    import xarray

METHOD = METHODS["central_difference"]
STRETCH = 1000  # steps for which the factors of the loads are in memory
SAME = ("bars", "bar_runs", "hinges", "hinge_runs", "hinge_group")
OUTCOMES = {NOT_FINITE: "not finite", PENETRATION: "panel passed through panel"}
UNSTABLE = "unstable"


class _Member(NamedTuple):
    """A model, ready to go."""

    case: Case
    packed: Packed
    u: NDArray
    v: NDArray
    critical: float


def simulate_many(
    cases: Sequence[Case],
    duration: float,
    dt: float | None = None,
    every: int | float = 1,
    initial: State | Sequence[State | None] | None = None,
    start: float = 0.0,
    force: bool = False,
    threads: int | None = None,
) -> xarray.Dataset:
    """Integrate the motions of many models of one topology at once, by central differences.

    All have the same nodes, bars, hinges, supported dofs and kinds of laws; geometry, stiffness,
    rest angles, parameters of laws, masses, damping by alpha, loads, histories and initial states
    may differ. Each motion is that of ``simulate(case, duration, "central_difference", dt)``, but
    for rounding. The models stand in the lanes of vectors, eight a vector, and the vectors are
    shared among threads: several times quicker than one motion after the other for small models.

    Parameters
    ----------
    cases : sequence of Case, m of them
        Of bars and hinges, with lumped mass. What this does not take yet is refused by name:
        supports and planes that move, folds that are actuated, loads that follow the motion, beta,
        modal damping, dashpots, damped creases, constraints, springs, contact, laws with memory and
        laws of one's own.
    duration, every, start, force :
        As of `simulate`.
    dt : float, optional
        Time step (s), one for all; by default half the least critical step.
    initial : State, or a sequence of m of them, optional
        Displacement and velocity at the start, of all or of each; None is rest.
    threads : int, optional
        As many as this process has processors by default.

    Returns
    -------
    xarray.Dataset
        The variables of a motion with the dimension `model` before `time`: `displacement` (m) and
        `velocity` (m/s) over model, time, node, axis; `reaction` (N) and the energies (J).
        `outcome` (model) is "done" or says what ended a motion: what comes after is nan. The case
        that it carries is the first one.

    Raises
    ------
    InputError
        A case that does not fit the others or is refused; what `simulate` refuses.

    Warns
    -----
    FoldynWarning
        Motions that ended before their time; an energy balance that is off by more than 1 %.
    """
    many = _checked(cases, initial)
    start = number("start", start, unit="s")
    duration = number("duration", duration, above=0.0)
    members = [_member(k, case, state) for k, (case, state) in enumerate(many)]
    for k, member in enumerate(members[1:], 1):
        _compare(k, member.packed, members[0].packed)
    least = int(np.argmin([member.critical for member in members]))
    critical = members[least].critical
    plan = timing.fixed_steps(duration, dt, every, critical, float(start))
    if plan.dt > critical and not force:
        raise InputError(
            f" = {plan.dt:.6g} s is above the critical step of {critical:.6g} s of cases[{least}]: "
            "take a smaller one or leave dt out (force = true integrates all the same)",
            "dt",
        )
    first = members[0].case
    count = timing.expected_samples(plan)
    nodes, reactions = len(first.structure.nodes), len(first.reaction_dofs)
    timing.check_samples(count * len(members), nodes, reactions)
    if threads is None:
        threads = int(config.NUMBA_NUM_THREADS)  # type: ignore[attr-defined]
    threads = whole("threads", threads, least=1)

    padded = [members[min(k, len(members) - 1)] for k in range(-(-len(members) // WIDTH) * WIDTH)]
    names = audited(first.energy_groups)
    out = (
        np.full((len(padded), count, nodes, 3), np.nan),
        np.full((len(padded), count, nodes, 3), np.nan),
        np.full((len(padded), count, reactions), np.nan),
        np.full((len(padded), count, len(names)), np.nan),
    )
    clock = time.perf_counter()
    runs = [
        _run(padded[k : k + WIDTH], plan, [array[k : k + WIDTH] for array in out])
        for k in range(0, len(padded), WIDTH)
    ]
    with ThreadPoolExecutor(min(threads, len(runs))) as pool:
        ran = list(pool.map(lambda run: run(), runs))
    seconds = time.perf_counter() - clock
    used = [array[: len(members)] for array in out]
    ended = np.concatenate([codes for codes, _ in ran], axis=1)
    outcome, error = _judged(members, plan, used, ended)
    facts = {
        "method": METHOD.name, "dt": plan.dt, "steps": plan.steps, "start": plan.start,
        "duration": plan.end - plan.start, "every": plan.every, "critical_step": critical,
        "wall_seconds": seconds, "processor_seconds": sum(spent for _, spent in ran),
        "threads": min(threads, len(runs)), "energy_error": error,
    }  # fmt: skip
    return _dataset(first, plan, used, names, outcome, facts)


def _checked(cases: Any, initial: Any) -> list[tuple[Case, State | None]]:
    """Cases, each with its initial state."""
    if not isinstance(cases, Sequence) or not len(cases):
        raise InputError(f" = {show(cases)}: give a list of cases", "cases")
    for k, case in enumerate(cases):
        if not isinstance(case, Case):
            raise InputError(f": got {type(case).__name__}, give a Case", f"cases[{k}]")
    if initial is None or isinstance(initial, State):
        return [(case, initial) for case in cases]
    if not isinstance(initial, Sequence) or len(initial) != len(cases):
        raise InputError(f": give one State, or a list of {len(cases)}", "initial")
    return list(zip(cases, initial, strict=True))


def _member(k: int, case: Case, state: State | None) -> _Member:
    """A case as arrays; refuses what this does not take."""
    try:
        case = with_mass(suited(METHOD.name, case), case)
        u, v = check_start(case, state)
        if not len(case.free_dofs):
            raise InputError(": hold every node, so that nothing can move", "supports")
        check_mass(case.mass, case.constraints.determined)
        modal = modal_rows(case, u)
        packed = pack(case, 1.0, u, modal)
        system = packed.system
        lacks = {
            "contact": case.contact is not None,
            "laws with memory": bool(case.remembering),
            "supports that move": system.moves,
            "actuated folds": system.turns,
            "loads that follow the motion": system.follows,
            "damping by beta or dashpots": bool(system.damping.data.size),
            "modal damping, dashpots or damped creases": has_dampers.py_func(system.damping),
            "constraints": len(system.ties.slave) > 0,
            "a mass matrix that is not lumped": not packed.mass.lumped,
            "clamped edges, springs, or another model than bars and hinges": not isinstance(
                packed.model, BarsHinges
            ),
        }
        for what, there in lacks.items():
            if there:
                raise InputError(
                    f": {what}: not taken side by side yet; use simulate for such a case"
                )
        if packed.model.addresses.any():
            raise InputError(": laws of one's own are not taken side by side; use simulate")
        return _Member(case, packed, u, v, METHOD.critical_step(case, u, modal))
    except InputError as error:
        raise error.within(f"cases[{k}]{'.' if error.field else ''}") from None


def _compare(k: int, packed: Packed, first: Packed) -> None:
    """Refuse a case of another topology than that of the first."""
    same = {
        "nodes": packed.model.rest.shape == first.model.rest.shape,
        "bars, hinges or kinds of laws": all(
            np.array_equal(getattr(packed.model, name), getattr(first.model, name)) for name in SAME
        ),
        "supported dofs": np.array_equal(packed.system.supported, first.system.supported),
    }
    for what, equal in same.items():
        if not equal:
            raise InputError(
                f": has other {what} than cases[0]; models side by side share them", f"cases[{k}]"
            )


def _run(
    members: Sequence[_Member], plan: StepPlan, out: Sequence[NDArray]
) -> Callable[[], tuple[NDArray, float]]:
    """WIDTH models, ready to run.

    The run returns what became of each, and in which step, (2, WIDTH), and its computing time, s.
    """
    first = members[0].packed
    model, by = first.model, first.numbering
    courses: list[Course] = [
        begin(one.case, one.u, one.v, None, None, plan, one.packed) for one in members
    ]
    u, v = (side_by_side([getattr(course, name) for course in courses]) for name in ("u", "v"))
    angle = side_by_side([course.angle for course in courses])
    groups = len(first.body.energy_groups)
    terms = [[(by.inward(w), history) for w, history in one.case.load_terms] for one in members]
    count = max(map(len, terms))
    values = np.zeros((count, u.size // WIDTH, WIDTH))
    for lane, own in enumerate(terms):
        for term, (vector, _) in enumerate(own):
            values[term, :, lane] = vector.ravel()[: values.shape[1]]
    dof = np.flatnonzero(values.any(axis=(0, 2)))
    mass = [np.repeat(one.packed.mass.diagonal, 3) for one in members]
    loads = LaneLoads(
        dof, np.ascontiguousarray(values[:, dof].reshape(count, len(dof) * WIDTH)),
        side_by_side([one.packed.mass.inverse for one in members]), side_by_side(mass),
        np.array([one.packed.system.damping.alpha for one in members]),
    )  # fmt: skip
    zero = np.zeros((4, u.size))
    own = [np.zeros((4, WIDTH)), np.zeros((groups, WIDTH)), np.zeros((2, WIDTH), np.int64)]
    state = LaneState._make([u, v, *zero, angle, *own])
    samples = LaneSamples._make([first.system.order, first.system.supported, *out])
    shared, each_own = topology(model), lanes([one.packed.model for one in members])
    work = lane_work(model)

    def run() -> tuple[NDArray, float]:
        clock = time.thread_time()
        for begun in range(0, plan.steps, STRETCH):
            steps = min(STRETCH, plan.steps - begun)
            times = plan.start + np.arange(begun, begun + steps + 1) * plan.dt
            factor = np.zeros((steps + 1, count, WIDTH))
            known: dict[int, NDArray] = {}
            for lane, each in enumerate(terms):
                for term, (_, history) in enumerate(each):
                    if id(history) not in known:
                        known[id(history)] = np.broadcast_to(history(times), times.shape)
                    factor[:, term, lane] = known[id(history)]
            factor = factor.reshape(steps + 1, count * WIDTH)
            advance_lanes(
                shared, each_own, loads, factor, state, samples, work, plan.dt, begun, steps,
                plan.every,
            )  # fmt: skip
        return state.outcome, time.thread_time() - clock

    return run


def _judged(
    members: Sequence[_Member], plan: StepPlan, out: Sequence[NDArray], ended: NDArray
) -> tuple[list[str], float]:
    """What became of each model, and the largest relative energy error; nan for what is wrong."""
    outcome, errors = [], []
    displacement, energy = out[0], out[3]
    for k, member in enumerate(members):
        code, step = ended[:, k].tolist()
        good = len(energy[k])
        if code:
            good = min(good, -(-step // plan.every))
        balance, rounding = Balance(), Rounding(member.packed.body)
        balance.add(energy[k, :good], displacement[k, :good])
        text = OUTCOMES.get(code, "done")
        if balance.relative > EXPLODED and rounding.reveals(balance):
            good, text = int(np.argmax(balance.off(energy[k, :good], EXPLODED))), UNSTABLE
        if good < len(energy[k]):
            for array in out:
                array[k, good:] = np.nan
        errors.append(balance.relative if text == "done" else 0.0)
        outcome.append(text)
    failed = [k for k, text in enumerate(outcome) if text != "done"]
    if failed:
        warnings.warn(
            f"{len(failed)} of {len(members)} motions ended before their time, the first of "
            f"cases[{failed[0]}] ({outcome[failed[0]]}): see `outcome`; simulate says more of a "
            "single one",
            FoldynWarning,
            stacklevel=3,
        )
    bad = int(np.argmax(errors))
    if errors[bad] > INACCURATE:
        warnings.warn(
            f"the energy balance of cases[{bad}] is off by {errors[bad]:.1%} of the energies at "
            f"play, the most of all: use a step below {plan.dt:.3g} s",
            FoldynWarning,
            stacklevel=3,
        )
    return outcome, errors[bad]


def _dataset(
    case: Case, plan: StepPlan, out: Sequence[NDArray], names: tuple[str, ...],
    outcome: list[str], facts: dict[str, Any],
) -> xarray.Dataset:  # fmt: skip
    displacement, velocity, reaction, energy = out
    known = {**MOTION, **energies_of(case)}
    values = {"displacement": displacement, "reaction": reaction, "velocity": velocity}
    values |= {name: energy[:, :, j] for j, name in enumerate(names)}
    data = {
        name: variable(
            ("model", "time", *known[name].dims), array, known[name].units, known[name].text
        )
        for name, array in values.items()
    }
    data["outcome"] = variable(("model",), np.array(outcome), "", "what became of the motion")
    times = plan.start + plan.dt * plan.every * np.arange(displacement.shape[1])
    along = {
        "time": ("time", times, {"units": "s", "long_name": "time"}),
        "model": ("model", np.arange(len(outcome)), {"long_name": "model"}),
    }
    alone = ("it is of many models, whose cases it does not hold",)
    return result_dataset("ensemble", case, data, along, facts, None, alone)
