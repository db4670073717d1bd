"""`simulate_many`: motions of many models of one topology in one call, side by side."""

from __future__ import annotations

import time
import warnings
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numba import config
from numpy.typing import NDArray

from foldyn.cases import Case, State
from foldyn.dynamics import timing
from foldyn.dynamics.audit import audited
from foldyn.dynamics.beside import METHOD, differing, integrate, lacking, room
from foldyn.dynamics.course import StepPlan
from foldyn.dynamics.doubts import INACCURATE
from foldyn.dynamics.inertia import check_mass
from foldyn.dynamics.initial import check_start
from foldyn.dynamics.methods import suited, with_mass
from foldyn.dynamics.modal_damping import ModalRows, modal_rows
from foldyn.dynamics.motion import Motion
from foldyn.dynamics.sampling import Sampler
from foldyn.dynamics.system import pack
from foldyn.errors import FoldynError, FoldynWarning, InputError, StretchWarning
from foldyn.mechanics.lanes import WIDTH
from foldyn.results.dataset import result_dataset
from foldyn.results.quantities import MOTION, energies_of, variable
from foldyn.structures.stretching import MOST, REMEDY, stretch
from foldyn.values import flag, number, of_kind, show, whole

if TYPE_CHECKING:
    import xarray


class _Member(NamedTuple):
    """A model with its state at the start, checked, and what limits its step."""

    case: Case
    u: NDArray
    v: NDArray
    modal: ModalRows
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
    start, force = number("start", start, unit="s"), flag("force", force)
    duration = number("duration", duration, above=0.0)
    members = [_member(k, case, state) for k, (case, state) in enumerate(many)]
    least = int(np.argmin([member.critical for member in members]))
    critical = members[least].critical
    plan = timing.fixed_steps(duration, dt, every, critical, float(start))
    if plan.dt > critical and not force:
        raise InputError(
            f" = {plan.dt:.6g} s is above the critical step of {critical:.6g} s of cases[{least}]: "
            "take a smaller one or leave dt out (force = true integrates all the same)",
            "dt",
        )
    if threads is None:
        threads = int(config.NUMBA_NUM_THREADS)  # type: ignore[attr-defined]
    threads = whole("threads", threads, least=1)
    motions = [_motion(member, plan, force) for member in members]
    _check_alike(motions)
    out = room(motions)
    parts = [slice(k, k + WIDTH) for k in range(0, len(motions), WIDTH)]
    clock = time.perf_counter()
    with ThreadPoolExecutor(min(threads, len(parts))) as pool:
        ran = list(pool.map(lambda part: integrate(motions[part], [a[part] for a in out]), parts))
    seconds = time.perf_counter() - clock
    errors = [error for found, _ in ran for error in found]
    outcome, error = _judged(motions, errors, out)
    facts = {
        "method": METHOD.name, "dt": plan.dt, "steps": plan.steps, "start": plan.start,
        "duration": plan.end - plan.start, "every": plan.every, "critical_step": critical,
        "wall_seconds": seconds, "processor_seconds": sum(spent for _, spent in ran),
        "threads": min(threads, len(parts)), "energy_error": error,
    }  # fmt: skip
    case = members[0].case
    names = audited(case.energy_groups)
    _warn_of_stretch(case, dict(zip(names, out[3].transpose(2, 0, 1), strict=True)))
    return _dataset(case, plan, out, names, outcome, facts)


def _checked(cases: Any, initial: Any) -> list[tuple[Case, State | None]]:
    """Cases, each with its initial state."""
    if not isinstance(cases, Sequence) or not len(cases):
        raise InputError(f" = {show(cases)}: give a list of cases", "cases")
    for k, case in enumerate(cases):
        of_kind(f"cases[{k}]", case, Case)
    if initial is None or isinstance(initial, State):
        return [(case, initial) for case in cases]
    if not isinstance(initial, Sequence) or len(initial) != len(cases):
        raise InputError(f": give one State, or a list of {len(cases)}", "initial")
    return list(zip(cases, initial, strict=True))


def _member(k: int, case: Case, state: State | None) -> _Member:
    """A case, checked."""
    try:
        case = with_mass(suited(METHOD.name, case), case)
        u, v = check_start(case, state)
        if not len(case.free_dofs):
            raise InputError(": hold every node, so that nothing can move", "supports")
        check_mass(case.mass, case.constraints.determined)
        modal = modal_rows(case, u)
        return _Member(case, u, v, modal, METHOD.critical_step(case, u, modal))
    except InputError as error:
        raise error.within(f"cases[{k}]{'.' if error.field else ''}") from None


def _motion(member: _Member, plan: StepPlan, force: bool) -> Motion:
    """Its motion."""
    case, u, v, modal, critical = member
    sampler = Sampler(case, {}, u, v, plan.start)
    state = u, v, None, None
    packed = pack(case, 1.0, u, modal)
    return Motion(case, METHOD, plan, critical, force, state, packed, sampler)


def _check_alike(motions: Sequence[Motion]) -> None:
    """Refuse what does not go side by side."""
    for k, motion in enumerate(motions):
        if what := lacking(motion):
            raise InputError(
                f": {what}: not taken side by side yet; use simulate for such a case", f"cases[{k}]"
            )
        if what := differing(motion.packed, motions[0].packed):
            raise InputError(
                f": has other {what} than cases[0]; models side by side share them", f"cases[{k}]"
            )


def _judged(
    motions: Sequence[Motion], errors: Sequence[FoldynError | None], out: Sequence[NDArray]
) -> tuple[list[str], float]:
    """What became of each model, and the largest relative energy error; nan for what is wrong."""
    outcome = ["done" if error is None else str(error) for error in errors]
    failed = [k for k, error in enumerate(errors) if error is not None]
    for k in failed:
        for array in out:
            array[k, motions[k].stored :] = np.nan
    if failed:
        warnings.warn(
            f"{len(failed)} of {len(motions)} motions ended before their time (see `outcome`), the "
            f"first of cases[{failed[0]}]: {outcome[failed[0]]}",
            FoldynWarning,
            stacklevel=3,
        )
    off = [
        motion.audit() if error is None else 0.0
        for motion, error in zip(motions, errors, strict=True)
    ]
    bad = int(np.argmax(off))
    if off[bad] > INACCURATE:
        warnings.warn(
            f"the energy balance of cases[{bad}] is off by {off[bad]:.1%} of the energies at "
            f"play, the most of all: use a step below {motions[bad].plan.dt:.3g} s",
            FoldynWarning,
            stacklevel=3,
        )
    return outcome, off[bad]


def _warn_of_stretch(case: Case, energies: Mapping[str, NDArray]) -> None:
    """Warn of the motion in which bars hold most of the strain energy, if that is much."""
    every = range(len(energies["kinetic"]))
    found = [stretch(case.structure, {name: e[k] for name, e in energies.items()}) for k in every]
    shares = [0.0 if one is None else one.share for one in found]
    worst = int(np.argmax(shares))
    if shares[worst]:
        warnings.warn(
            f"bars hold {shares[worst]:.0%} of the strain energy of cases[{worst}] where that is "
            f"largest, the most of {np.count_nonzero(shares)} motions with more than {MOST:.0%}: "
            f"{REMEDY}",
            StretchWarning,
            stacklevel=3,
        )


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
