"""`simulate_many`: motions of many models of one topology in a single call."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import xarray
from numba import config
from numpy.typing import NDArray

from foldyn.cases import Case, Origin, State
from foldyn.cases.releases import refuse_releases
from foldyn.dynamics import timing
from foldyn.dynamics.driver import prepare
from foldyn.dynamics.gpu.choice import DEVICES, choose
from foldyn.dynamics.initial import check_start, check_touching
from foldyn.dynamics.lane_steps import integrate, topology
from foldyn.dynamics.motion import Motion
from foldyn.dynamics.motion_state import Samples
from foldyn.dynamics.sampling import Sampler
from foldyn.dynamics.stability import damper_rate, frequency_bound, is_stable
from foldyn.errors import ComputationError, InputError, StretchWarning, listed, told_once, warn
from foldyn.materials.inelastic_law import VARIABLES
from foldyn.mechanics.lanes import WIDTH
from foldyn.results.dataset import origin_variables, result_dataset
from foldyn.results.quantities import CONTINUATIONS, MOTION, energies_of, variable, variables
from foldyn.structures.stretching import most, remedy, stretch
from foldyn.values import choice, flag, of_kind, show, whole

METHOD = "central_difference"
LANES = 2.5  # speedup by running models in lanes
COMMON = ("duration", "dt", "every_steps", "interval", "start", "method", "device")
"""Arguments of `simulate_many` with one value for all cases."""


def simulate_many(
    cases: Sequence[Case],
    duration: float,
    *,
    dt: float | None = None,
    every_steps: int | None = None,
    interval: float | None = None,
    initial: State | Sequence[State | None] | None = None,
    start: float = 0.0,
    force: bool = False,
    threads: int | None = None,
    method: str = METHOD,
    device: str = "auto",
) -> xarray.Dataset:
    """Integrate the motions of many models of one topology at once.

    All models have the same number of nodes and memory branches, the same supported dofs and the
    same strain energy groups; everything else may differ. Each motion equals ``simulate(case,
    duration, method, dt)`` up to rounding. With central differences, models with the same bars,
    hinges and kinds of laws run in SIMD lanes, eight per vector, and threads share the vectors: two
    to three times faster than sequential runs for small models. On a GPU all models advance at
    once.

    Parameters
    ----------
    cases : sequence of Case, m of them
        Lanes support bars and hinges with laws of the package, lumped mass, fixed supports, dead
        loads and damping by alpha. Other cases are computed one after the other, as by `simulate`;
        a motion that ends early is also computed once more in this way.
    duration, every_steps, interval, start, force :
        As for `simulate`.
    dt : float, optional
        Time step (s) of all motions; by default half the smallest critical step.
    initial : State, or a sequence of m of them, optional
        Displacement and velocity at the start, one State for all or one for each; None is rest.
    threads : int, optional
        Number of threads; by default all processors of this process.
    method : str, default "central_difference"
        An explicit method with fixed steps: "central_difference" or "rk4".
    device : {"auto", "cpu", "gpu"}
        Where steps are computed; a GPU also supports panel membranes, springs and dampers. "auto"
        chooses a GPU if one is present, has kernels for all terms, and is expected to be faster.

    Returns
    -------
    xarray.Dataset
        The variables of a motion with the dimension `model` before `time`: `displacement` (m) and
        `velocity` (m/s) with dimensions model, time, node, axis; `reaction` (N); energies (J).
        `outcome` (model) is "done" or, as in `simulate`, the reason why a motion ended early; later
        samples are nan. The stored case is the first one. Attributes name the device (`device`)
        and, with "auto", the reason for it (`device_reason`).

    Raises
    ------
    InputError
        A case that does not fit the others, or input that `simulate` refuses.

    Warns
    -----
    FoldynWarning
        Motions that ended early; the accuracy warnings of `simulate` for the worst motion.
    """
    if not isinstance(cases, Sequence) or not len(cases):
        raise InputError(f" = {show(cases)}: give a list of cases", "cases")
    states = [initial] * len(cases) if isinstance(initial, State | None) else initial
    if not isinstance(states, Sequence) or len(states) != len(cases):
        raise InputError(f": give one State, or a list of {len(cases)}", "initial")
    force = flag("force", force)
    choice("method", method, (METHOD, "rk4"))
    choice("device", device, DEVICES)
    threads = _threads(threads, len(cases))
    motions: list[Motion] = []
    with told_once() as told:
        for k, (case, state) in enumerate(zip(cases, states, strict=True)):
            told.where = f"cases[{k}]"
            of_kind(f"cases[{k}]", case, Case)
            like = next((m for m in motions[:1] if dt is not None and _takes_starts(m, case)), None)
            asked = "gpu" if device == "gpu" else "cpu"
            try:
                refuse_releases(case, "fd.simulate_many")
                given = case, duration, method, dt, every_steps, interval, state
                motions.append(
                    _from_start(like, state) if like
                    else prepare(*given, force=True, start=start, kept=True, device=asked)
                )  # fmt: skip
            except InputError as error:
                place = f"cases[{k}]{'.' if error.field else ': '}"
                raise error if error.field in COMMON else error.within(place) from None
            for what, own in _shape(motions[k].case).items():
                if own != _shape(motions[0].case)[what]:
                    raise InputError(
                        f": has other {what} than cases[0]; all cases must have the same",
                        f"cases[{k}]",
                    )
    least = int(np.argmin([motion.critical for motion in motions]))
    case, plan, critical = motions[0].case, motions[least].plan, motions[least].critical
    if plan.dt > critical and not force:
        raise InputError(
            f" = {plan.dt:.6g} s is above the critical step of {critical:.6g} s of cases[{least}]: "
            "take a smaller one or leave dt out (force = true integrates all the same)", "dt",
        )  # fmt: skip
    nodes, supported = len(case.structure.nodes), len(case.reaction_dofs)
    times = plan.start + plan.dt * plan.every * np.arange(timing.expected_samples(plan))
    timing.check_samples(len(cases) * len(times), nodes, supported)
    names = motions[0].output.names
    memory = _shape(case)["branches of laws"], VARIABLES
    shapes = (nodes, 3), (nodes, 3), (supported,), (len(names),), memory
    out = Samples._make([times, *(np.empty((len(cases), len(times), *s)) for s in shapes), 0])
    for k, motion in enumerate(motions):
        motion.plan, motion.force = plan, force  # one step for all
        motion.output.window = Samples._make([out.time, *(array[k] for array in out[1:-1]), 0])
    reason = ""
    if device == "auto":
        device, reason = device_for(motions, len(motions), threads)
    clock, spent = time.perf_counter(), time.process_time()
    ended = _integrate(motions, out, threads, device)
    facts = {
        "method": method, "dt": plan.dt, "steps": plan.steps, "start": plan.start,
        "duration": plan.end - plan.start, "every_steps": plan.every, "critical_step": critical,
        "wall_seconds": time.perf_counter() - clock,
        "processor_seconds": time.process_time() - spent,
        "threads": threads, "device": _name(device),
        "energy_error": _warn(motions, ended, out),
    }  # fmt: skip
    if reason:
        facts["device_reason"] = reason
    outcome = [ended.get(k, "done") for k in range(len(motions))]
    beyond = _origins(motions, out.time) | _continuations(motions)
    return _dataset(motions[0], out, outcome, beyond, facts)


def _origins(motions: Sequence[Motion], times: NDArray) -> dict[str, Any]:
    """Origins of motions at sample times, for each model; empty unless something depends on them.

    The flow of added mass is valid for the last sample if the motions end there.
    """
    plan = motions[0].plan
    end = math.nan if plan.steps % plan.every else float(times[-1])
    found = [origin_variables(one.reached, end) for one in motions if one.reached]
    return {
        name: (("model", *dims), np.stack([own[name][1] for own in found]), about)
        for name, (dims, _, about) in (found[0] if len(found) == len(motions) else {}).items()
    }


def _continuations(motions: Sequence[Motion]) -> dict[str, Any]:
    """What samples do not hold of each motion at its end; nan for motions that ended early."""
    name, ends = "continuation", [motion.continuations().get("continuation") for motion in motions]
    at, one = next((end for end in ends if end), (0.0, None))
    if one is None:
        return {}
    none = np.full(one.values.shape, np.nan)
    values = np.stack([end[1].values if end else none for end in ends])
    dims, numbers, text = variable(("model", "continued"), values, "", CONTINUATIONS[name])
    return {name: (dims, numbers, text | {"method": one.method, "time": at})}


def device_for(
    motions: Sequence[Motion], count: int, threads: int | None = None
) -> tuple[str, str]:
    """Device that "auto" chooses for `count` motions like these, and the reason."""
    lanes = motions[0].method.name == METHOD
    return choose(motions, count, LANES * _threads(threads, count) if lanes else 1.0)


def _threads(threads: int | None, count: int) -> int:
    """Number of threads for the lanes of `count` models."""
    most = int(config.NUMBA_NUM_THREADS)  # type: ignore[attr-defined]
    threads = most if threads is None else whole("threads", threads, least=1)
    return min(threads, -(-count // WIDTH))


def _takes_starts(motion: Motion, case: Case) -> bool:
    """Whether a motion prepared for one start can be reused for any other start of the case."""
    own = case.damped_at_start or motion.packed.added.acts or bool(case.remembering)
    return motion.case is case and not own


def _from_start(like: Motion, initial: State | None) -> Motion:
    """Copy of a motion with another initial state; both share their arrays."""
    case, u_v = like.case, check_start(like.case, initial)
    check_touching(case, u_v[0], like.plan.start, like.plan.end)
    growth, critical, u = like.method.growth, like.critical, u_v[0]
    rate = damper_rate(case, u) + like.packed.modal.rate
    bound = frequency_bound(case, u)
    assert growth is not None  # explicit methods have one
    if not (np.isfinite(bound) and is_stable(growth, bound, case.rayleigh, like.plan.dt, rate)):
        critical = like.method.critical_step(case, u, like.packed.modal)
    sampler = Sampler(case, {}, *u_v, like.plan.start)
    state, origin = (*u_v, None, None), Origin(u, like.plan.start)
    return Motion(
        case, like.method, like.plan, critical, like.force, state, origin, like.packed, sampler
    )  # fmt: skip


def _shape(case: Case) -> dict[str, Any]:
    """Properties that all cases must share so that their results fit together."""
    supported, energies = case.reaction_dofs.tolist(), [*case.energy_groups]
    energies += ["air"] * (case.air is not None)
    branches = sum(part.count for part in case.remembering)
    return {
        "nodes": len(case.structure.nodes), "supported dofs": supported, "energies": energies,
        "branches of laws": branches,
    }  # fmt: skip


def _name(device: str) -> str:
    """Name of the device, for the result."""
    if device == "cpu":
        return device
    from foldyn.dynamics.gpu import card

    return card.name()


def _integrate(
    motions: Sequence[Motion], out: Samples, threads: int, device: str
) -> dict[int, str]:
    """Integrate all motions; return the reasons for those that ended early.

    Motions that lanes do not support, and motions that fail in lanes, are computed one by one.
    A failing motion then gets its reason.
    """
    side_by_side = _on_gpu if device == "gpu" else _in_lanes
    ended = dict[int, str]()
    for k in sorted(side_by_side(motions, out, threads)):
        motions[k].device = "cpu"  # a run on the CPU gives the reason
        try:
            motions[k].integrate()
        except ComputationError as error:
            ended[k] = str(error)
        for array, own in zip(out[1:-1], motions[k].output.window[1:-1], strict=True):
            array[k], array[k, motions[k].stored :] = own, np.nan
    return ended


def _in_lanes(motions: Sequence[Motion], out: Samples, threads: int) -> set[int]:
    """Integrate what lanes support; return indices of unsupported motions and of failures."""
    lanes = motions[0].method.name == METHOD
    alike: dict[Any, list[tuple[int, Motion]]] = {}  # numbered motions by topology
    for k, motion in enumerate(motions):
        alike.setdefault(topology(motion) if lanes else (), []).append((k, motion))
    alone = {k for k, _ in alike.pop((), ())}
    groups = [own[k : k + WIDTH] for own in alike.values() for k in range(0, len(own), WIDTH)]
    with ThreadPoolExecutor(threads) as pool:
        return alone.union(*pool.map(lambda group: integrate(group, out), groups))


def _on_gpu(motions: Sequence[Motion], out: Samples, threads: int) -> set[int]:
    """Integrate all motions on the GPU; return the indices of motions that fail."""
    from foldyn.dynamics.gpu import many

    return many.integrate(motions)


def _cases(numbers: Iterable[int]) -> str:
    """Names of cases on one line, shortened if there are many."""
    return listed([f"cases[{k}]" for k in numbers])


def _warn(motions: Sequence[Motion], ended: Mapping[int, str], out: Samples) -> float:
    """Warn of failures and doubtful results; return the largest relative energy error."""
    if ended:
        warn(
            f"{len(ended)} of {len(motions)} motions ended before their time (see `outcome`): "
            f"{_cases(ended)}, the first with: {ended[min(ended)]}",
            "integrators.md#many-models-at-once",
        )
    sound = {k: motion for k, motion in enumerate(motions) if k not in ended}
    doubts = {k: text for k, motion in sound.items() if (text := motion.doubt())}
    off = {k: motion.audit() for k, motion in sound.items()}
    if doubts:
        worst = max(doubts, key=lambda k: off[k])
        rank = f" (the worst of {_cases(doubts)})" if len(doubts) > 1 else ""
        warn(f"cases[{worst}]{rank}: {doubts[worst]}", "integrators.md#accuracy")
    first = motions[0].case
    names = motions[0].output.names
    found = [
        stretch(motion.case.structure, dict(zip(names, energy.T, strict=True)), displacement)
        for motion, energy, displacement in zip(motions, out.energy, out.displacement, strict=True)
    ]
    shares = [one.share if one else 0.0 for one in found]
    if any(shares):
        warn(
            f"panels that stretch hold {max(shares):.0%} of the strain energy of "
            f"cases[{np.argmax(shares)}] where that is largest (more than "
            f"{most(first.structure):.0%} in {_cases(np.flatnonzero(shares))}), "
            f"{remedy(first.structure)}",
            "models.md#where-panels-stretch",
            StretchWarning,
        )
    return max(off.values(), default=0.0)


def _dataset(
    like: Motion, out: Samples, outcome: list[str], beyond: dict, facts: dict
) -> xarray.Dataset:
    """The dataset that `simulate_many` returns."""
    case, known = like.case, {**MOTION, **energies_of(like.case)}
    values = {"displacement": out.displacement, "reaction": out.reaction, "velocity": out.velocity}
    values |= zip(like.output.names, np.moveaxis(out.energy, 2, 0), strict=True)
    if out.memory.size:
        values["memory"] = out.memory
    timed = variables(known, "time", values).items()
    data = beyond | {name: (("model", *dims), *about) for name, (dims, *about) in timed}
    data["outcome"] = variable(("model",), np.array(outcome), "", "what became of the motion")
    along = {"time": variable(("time",), out.time, "s", "time")}
    along["model"] = variable(("model",), np.arange(len(outcome)), "", "model")
    alone = ("it contains many models, but not the case of each",)
    return result_dataset("ensemble", case, data, along, facts, None, alone)
