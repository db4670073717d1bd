"""Motions in which supports or planes are released: a chain of motions in one result."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn.cases import Case, State
from foldyn.cases.releases import release_times, released, stays
from foldyn.dynamics import timing
from foldyn.dynamics.audit import AIR, AUDITED, audited, energy_error, energy_scale
from foldyn.dynamics.initial import initial_state
from foldyn.dynamics.motion import Motion
from foldyn.dynamics.progress import Progress, Reporter, reported
from foldyn.dynamics.sampling import forces_inside
from foldyn.errors import ComputationError, MotionInterrupted, told_once
from foldyn.results.attributes import OWN
from foldyn.results.crossings import Crossings
from foldyn.results.dataset import AXIS, trajectory_dataset
from foldyn.results.quantities import CONTACT, Quantity
from foldyn.values import number

if TYPE_CHECKING:
    from foldyn.dynamics.checkpoint import Keeping

SAME = 1e-9  # share of a step or an interval by which times may differ
_, DISSIPATED, WORK = AUDITED
SINCE = (DISSIPATED, WORK, AIR)  # energies that count from the start of a motion
SUMMED = (
    "steps", "wall_seconds", "force_evaluations", "refused_steps", "halved_steps", "iterations",
    "factorizations", "contact_lists", "flows", "flow_energy",
)  # fmt: skip
LEAST = ("critical_step", "smallest_step", "shortest_contact_step")
MOST = ("largest_step", "threads")
OF_PARTS = (*OWN, "every_steps", "crossing_looks", "crossing_samples")  # attributes left out


@dataclass(frozen=True, eq=False)
class ReleasedMotion:
    """A motion with releases that is ready to be computed; see `driver.prepared`.

    It consists of parts: motions from release to release. So that samples stay evenly spaced, a
    release between samples lies between two short parts, from and to the nearest samples.

    Parameters
    ----------
    case : Case
        The case with its releases.
    prepare : callable
        Prepares a part; see `driver.prepare`.
    times : tuple of float
        The start, and the end of each part (s).
    interval, every : float, int
        Time between samples (s); if it is 0, number of steps of varying length.
    longest : float, optional
        Largest step (s).
    initial : State, optional
    sampled : sequence of str
        Names of the user's quantities.
    """

    case: Case
    prepare: Callable[..., Motion]
    times: tuple[float, ...]
    interval: float
    every: int
    longest: float | None
    initial: State | None
    sampled: Sequence[str]

    def part(self, k: int, state: State | None) -> Motion:
        """Part number k, from a state."""
        now, length = self.times[k], self.times[k + 1] - self.times[k]
        dt = self.longest
        if dt is not None and abs(length - round(length / dt) * dt) > SAME * length:
            dt = length / math.ceil(length / dt)
        even = {"interval": min(self.interval, length)} if self.interval else {}
        case, every = released(self.case, now), {"every_steps": self.every}
        return self.prepare(case, length, initial=state, start=now, dt=dt, **(even or every))

    @property
    def method(self) -> Any:
        """The first method, under another name: kernels of GPUs for many motions lack releases."""
        return replace(self.part(0, self.initial).method, name="a motion with releases")

    @property
    def expected_samples(self) -> int:
        """Number of samples; a lower bound if steps vary and samples are counted in steps."""
        span = self.times[-1] - self.times[0]
        return 1 + round(span / self.interval) if self.interval else len(self.times)

    def finished(self, keeping: Keeping) -> None:
        """No stored result: the motion is computed again."""

    def run_into_file(
        self, keeping: Keeping, progress: bool | Reporter | None = None
    ) -> xarray.Dataset:
        """Compute the motion in memory and write its result to its file."""
        with keeping.held():
            return keeping.save_result(self.run(progress, keeping))

    def run(
        self, progress: bool | Reporter | None = None, keeping: Keeping | None = None
    ) -> xarray.Dataset:
        """Compute the motion; see `driver.simulate`.

        `keeping` has nothing to keep of it, but refuses to replace an interrupted motion.
        """
        if keeping is not None:
            keeping.begin({"releases": self._releases}, {})
        parts: list[xarray.Dataset] = []
        with reported(progress) as report, told_once():
            for k, now in enumerate(self.times[:-1]):
                state = initial_state(parts[-1]) if parts else self.initial
                if parts and now in self._releases:  # the forces change
                    state = replace(state, continuation=None)
                try:
                    parts.append(self.part(k, state).run(partial(self._tell, report, now)))
                except (ComputationError, MotionInterrupted) as error:
                    if error.partial is not None and error.partial.sizes["time"]:
                        error.partial = self._joined([*parts, error.partial])
                    raise
        return self._joined(parts)

    def _tell(self, report: Reporter, now: float, own: Progress) -> None:
        start, end = self.times[0], self.times[-1]
        report(own._replace(time=now - start + own.time, duration=end - start))

    @property
    def _releases(self) -> list[float]:
        """Times (s) of the releases within the motion."""
        return [time for time in release_times(self.case) if time in self.times[1:-1]]

    def _is_sample(self, time: float) -> bool:
        """Whether a part that starts at a time (s) starts with a sample."""
        steps = (time - self.times[0]) / self.interval if self.interval else 0.0
        return abs(steps - round(steps)) < SAME

    # ------------------------------------------------------------------ one result
    def _joined(self, parts: Sequence[xarray.Dataset]) -> xarray.Dataset:
        """One result of the parts; the sample at the instant of a release is that just after it."""
        case, first, last = self.case, parts[0], len(parts) - 1
        names, pieces = audited(case.energy_groups, case.air is not None), []
        for k, part in enumerate(parts):
            own = self._values(part, self.times[k], names)
            if k:
                _go_on(own, pieces[-1], names)
            pieces.append(own)
        chosen = [  # a sample between parts belongs to the later one
            slice(None if self._is_sample(now) else 1, None if k == last else -1)
            for k, now in enumerate(self.times[: last + 1])
        ]
        whole = {
            name: np.concatenate([own[name][s] for own, s in zip(pieces, chosen, strict=True)])
            for name in pieces[0]
        }
        energy = np.stack([whole[name] for name in names], axis=1)
        scale, off = energy_scale(energy, case.air is not None), energy_error(energy)
        facts = self._facts([part.attrs for part in parts])
        facts["energy_error"] = float(np.abs(off).max()) / scale if scale else 0.0
        known = {name: own._replace(function=None) for name, own in forces_inside(case).items()}
        for name in self.sampled:
            about = first[name].attrs
            told = about.get("units", ""), about.get("long_name", "")
            known[name] = Quantity(*told, tuple(map(str, first[name].dims[1:])))
        begun, ended = initial_state(first, 0).continuation, initial_state(parts[-1])
        at = {"continued_from": whole["time"][0], "continuation": whole["time"][-1]}
        going_on = zip(at.items(), (begun, ended.continuation), strict=True)
        result = trajectory_dataset(
            case, *(whole[name] for name in ("time", "displacement", "velocity", "reaction")),
            {name: whole[name] for name in names}, facts,
            {name: (own, whole[name]) for name, own in known.items()}, whole.get("memory"),
            {name: (time, one) for (name, time), one in going_on if one is not None},
            ended.origin and (whole["time"][-1], ended.origin),
        )  # fmt: skip
        return _crossings(parts, chosen).recorded(result)

    def _values(self, part: xarray.Dataset, now: float, names: Sequence[str]) -> dict[str, NDArray]:
        """Values of a part from a time (s) on, as the whole case has them: 0 where released."""
        case, count = self.case, part.sizes["time"]
        kept = {"time", "displacement", "velocity", "memory", *self.sampled, *names, *CONTACT}
        found = {name: np.array(part[name]) for name in kept if name in part}
        zero = {name: np.zeros(count) for name in names}
        dofs = 3 * part["support_node"].values + np.searchsorted(AXIS, part["support_axis"].values)
        reaction = np.zeros((count, len(case.reaction_dofs)))
        reaction[:, np.searchsorted(case.reaction_dofs, dofs)] = part["reaction"]
        if case.contact is not None:
            zero["contact_force"] = np.zeros((count, len(case.structure.nodes)))
            zero["plane_force"] = np.zeros((count, len(case.contact.planes), 3))
            if "plane_force" in found:
                acts = [stays(plane, now) for plane in case.contact.planes]
                zero["plane_force"][:, acts] = found.pop("plane_force")
        if case.lines is not None:
            pulls, acts = forces_inside(case)["tension"].function, [
                stays(support, now) for support, *_ in case.polylines()
            ]  # fmt: skip
            states = zip(found["displacement"], found["velocity"], found["time"], strict=True)
            zero["tension"] = np.array([pulls(*state) for state in states]) * acts
        return {**zero, "reaction": reaction, **found}

    def _facts(self, given: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
        """Statistics of the parts, together."""
        facts = {name: value for name, value in given[0].items() if name not in OF_PARTS}
        for names, gather in ((SUMMED, sum), (LEAST, min), (MOST, max)):
            for name in names:
                if values := [own[name] for own in given if name in own]:
                    facts[name] = gather(values)
        span, steps = self.times[-1] - self.times[0], [own["dt"] for own in given]
        facts |= {"interval": self.interval} if self.interval else {"every_steps": self.every}
        facts["method"] = ", ".join(dict.fromkeys(own["method"] for own in given))
        facts["dt"] = steps[0] if len(set(steps)) == 1 else span / max(1, facts["steps"])
        return facts | {"duration": span, "releases": self._releases}


def _go_on(own: dict[str, NDArray], before: Mapping[str, NDArray], names: Sequence[str]) -> None:
    """Let the totals of a part go on from the part before, whose released parts lose energy."""
    stored = [name for name in names if name not in SINCE]
    lost = sum(float(before[name][-1] - own[name][0]) for name in stored)
    for name in names:
        if name in SINCE:
            own[name] += before[name][-1] - own[name][0] + (lost if name == DISSIPATED else 0.0)


def _crossings(parts: Sequence[xarray.Dataset], chosen: Sequence[slice]) -> Crossings:
    """Panels that cross in any of the parts, of which only chosen samples are in the result."""
    first, done = dict[tuple[int, ...], int](), 0
    for part, own in zip(parts, chosen, strict=True):
        begin, end, _ = own.indices(part.sizes["time"])
        if "crossing_panels" in part:
            found = zip(part["crossing_panels"].values, part["crossing_first"].values, strict=True)
            for pair, at in found:
                first.setdefault(tuple(pair.tolist()), done + max(0, int(at) - begin))
        done += max(0, end - begin)
    looks, crossed = (np.arange(sum(part.attrs[name] for part in parts)) for name in OF_PARTS[-2:])
    pairs = np.array(list(first), np.int64).reshape(-1, 2)
    return Crossings(looks, crossed, pairs, np.array(list(first.values()), np.int64))


def prepare_released(
    case: Case, duration: float, method: str, prepare: Callable[..., Motion], start: float = 0.0,
    initial: State | None = None, dt: float | None = None, every_steps: int | None = None,
    interval: float | None = None, kept: bool = False, **given: Any,
) -> ReleasedMotion:  # fmt: skip
    """Check the input of a motion with releases; see `driver.prepare`, which is `prepare`.

    Numbers of fixed steps between samples become the interval that they are in the first part.
    """
    sampling = timing.sampling(duration, every_steps, interval)
    prepare = partial(prepare, method=method, **given)
    between = sorted(time for time in release_times(case) if start < time < start + duration)
    span, every = sampling.interval, sampling.steps
    if not span:
        length = (between or [start + duration])[0] - start
        dt = None if dt is None else number("dt", dt, above=0.0, most=duration)
        trial = prepare(
            released(case, start), length, initial=initial, start=start,
            dt=dt and min(dt, length), every_steps=1,
        )  # fmt: skip
        span = every * trial.plan.dt if trial.plan.steps else 0.0
    end = start + duration
    if span:
        count = math.floor(duration / span * (1.0 + 1e-12) + SAME)
        timing.sampling(duration, None, span)  # refuses more steps than there are
        end = start + count * span
    times = {start, end}
    for time in (time for time in between if time < end):
        steps = (time - start) / (span or duration)
        if span and abs(steps - round(steps)) > SAME:
            times |= {start + whole * span for whole in (math.floor(steps), math.ceil(steps))}
        times.add(time)
    sampled = tuple(given.get("sample") or ())
    motion = ReleasedMotion(case, prepare, tuple(sorted(times)), span, every, dt, initial, sampled)
    motion.part(0, initial)  # refuses what is wrong before anything is computed
    nodes, dofs = len(case.structure.nodes), len(case.reaction_dofs)
    timing.check_samples(motion.expected_samples, nodes, dofs)
    return motion
