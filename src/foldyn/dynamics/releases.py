"""Motions in which supports or planes are released: a chain of motions in one result."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
import xarray
from numpy.typing import NDArray
from scipy.optimize import brentq

from foldyn.cases import Case, State
from foldyn.cases.releases import awaited, release_times, released, released_at, stays, timed
from foldyn.dynamics import timing
from foldyn.dynamics.audit import AIR, AUDITED, audited, energy_error, energy_scale
from foldyn.dynamics.in_memory import InMemory
from foldyn.dynamics.initial import initial_state
from foldyn.dynamics.motion import Motion
from foldyn.dynamics.progress import Progress, Reporter
from foldyn.dynamics.sampling import check_given
from foldyn.errors import ComputationError, MotionInterrupted, quietly, told_once
from foldyn.results.attributes import OWN
from foldyn.results.crossings import crossings_of
from foldyn.results.dataset import result_dataset, stage_times
from foldyn.results.parts import placed
from foldyn.results.quantities import ORIGIN
from foldyn.values import number

SAME = 1e-9  # share of a step or an interval by which times may differ
EXACT = 1e-8  # share of an interval to which the instant is found at which something is reached
ALIKE = 1e-6  # share of an interval within which two such instants are one
WATCH = "awaited"  # quantity that ends a part: nan where something is reached
_, DISSIPATED, WORK = AUDITED
SINCE = (DISSIPATED, WORK, AIR)  # energies that count from the start of a motion
SUMMED = ("wall_seconds", "flow_energy")  # attributes that add up, besides whole numbers
LEAST = ("critical_step", "smallest_step", "shortest_contact_step")
MOST = ("largest_step", "threads")


@dataclass(frozen=True, eq=False)
class ReleasedMotion(InMemory):
    """A motion with releases that is ready to be computed; see `driver.prepared`.

    It consists of parts: motions from release to release. So that samples stay evenly spaced in
    time, a release between samples lies between two short parts, from and to the nearest samples.
    A part in which something is reached that releases is computed again, up to that instant.

    Parameters
    ----------
    case : Case
        The case with its releases.
    prepare : callable
        Prepares a part; see `driver.prepare`.
    start, end : float
        Times (s).
    interval, every : float, int
        Time between samples (s), or 0 and the number of steps between samples.
    longest : float, optional
        Largest step (s).
    initial : State, optional
    sample : mapping
        The user's own quantities.
    """

    case: Case
    prepare: Callable[..., Motion]
    start: float
    end: float
    interval: float
    every: int
    longest: float | None
    initial: State | None
    sample: Mapping[str, Any]

    kind = "a motion with releases"

    def _between(self, case: Case) -> dict[float, float]:
        """Releases of a case between samples (s), with their numbers of intervals."""
        inside = [time for time in release_times(case) if self.start < time < self.end]
        steps = {time: (time - self.start) / (self.interval or math.inf) for time in inside}
        return {time: own for time, own in steps.items() if abs(own - round(own)) > SAME}

    def _stop(self, case: Case, now: float) -> float:
        """End (s) of the part of a case's motion that begins now."""
        beside = [
            self.start + near(steps) * self.interval
            for steps in self._between(case).values()
            for near in (math.floor, math.ceil)
        ]
        return min(t for t in (*release_times(case), *beside, self.end) if now < t <= self.end)

    @cached_property
    def first(self) -> Motion:
        """The first part."""
        case = self._begun(self.case, self.start, self.initial)
        return self._part(case, self.start, self._stop(case, self.start), self.initial)

    def _begun(self, case: Case, now: float, state: State | None) -> Case:
        """The case without what a state releases at once."""
        u = (state or State()).of_nodes("displacement", case.structure.nodes.shape)
        while reached := _reached(awaited(case, now), u, now):
            case = timed(case, dict.fromkeys(reached, now))
        return case

    def _part(
        self, case: Case, now: float, stop: float, state: State | None, watched: bool = True
    ) -> Motion:
        """Part of a case's motion, from a state; if watched, it ends where something is reached."""
        length, dt = stop - now, self.longest
        if dt is not None and abs(length - round(length / dt) * dt) > SAME * length:
            dt = length / math.ceil(length / dt)
        sample, shares = self.sample, awaited(case, now) if watched else {}
        if shares:

            def watch(u: NDArray, v: NDArray, time: float) -> float:
                return math.nan if _reached(shares, u, time) else 0.0

            sample = {**sample, WATCH: watch}
        return self.prepare(
            released(case, now), length, initial=state, start=now, dt=dt,
            interval=min(self.interval, length) or None, sample=sample,
        )  # fmt: skip

    @property
    def expected_samples(self) -> int:
        """Number of samples, about, if samples are counted in steps."""
        spacing = self.interval or self.every * self.first.plan.dt
        return 1 + round((self.end - self.start) / spacing)

    def _computed(self, report: Reporter) -> xarray.Dataset:
        parts: list[tuple[float, xarray.Dataset]] = []
        now, state, motion = self.start, self.initial, self.first
        case = self._begun(self.case, now, state)
        with told_once():
            while True:
                try:
                    result = motion.run(partial(self._tell, report, now))
                except (ComputationError, MotionInterrupted) as error:
                    ended = isinstance(error, ComputationError)
                    if ended and (times := self._instants(case, now, error.partial)):
                        case = timed(case, times)
                    else:
                        if error.partial is not None and error.partial.sizes["time"]:
                            error.partial = self._joined(case, [*parts, (now, error.partial)])
                        raise
                else:
                    parts.append((now, result))
                    now, state = self._stop(case, now), initial_state(result)
                    if now in release_times(case):  # forces change: methods start afresh
                        state = replace(state, continuation=None)
                    if now >= self.end:
                        break
                case = self._begun(case, now, state)
                motion = self._part(case, now, self._stop(case, now), state)
        return self._joined(case, parts)

    def _instants(self, case: Case, now: float, result: xarray.Dataset | None) -> dict[str, float]:
        """Time (s) at which something was first reached, by the places that it releases."""
        shares = awaited(case, now)
        if result is None or not shares:
            return {}
        times, moved = result["time"].values.tolist(), result["displacement"].values
        reached = [_reached(shares, *at) for at in zip(moved, times, strict=True)]
        if not any(reached):
            return {}
        k, places = next((k, places) for k, places in enumerate(reached) if places)
        state = replace(initial_state(result, k - 1), continuation=None)
        found = {
            place: self._instant(case, times[k - 1 : k + 1], state, shares[place])
            for place in places
        }
        near = min(found.values()) + ALIKE * (times[k] - times[k - 1])
        return {place: min(found.values()) for place, time in found.items() if time <= near}

    def _instant(
        self, case: Case, span: Sequence[float], state: State, share: Callable[..., float]
    ) -> float:
        """Time (s) between two samples at which something is reached, from the first one's state.

        The motion may start otherwise than it went on: if it is late, the second sample counts.
        """

        def beyond(time: float) -> float:
            u = state.displacement
            if time > span[0]:
                part = self._part(case, span[0], time, state, watched=False).run()
                u = part["displacement"].values[-1]
            return share(u, _factors(time)) - 1.0

        with quietly():
            if beyond(span[1]) < 0.0:
                return span[1]
            return float(brentq(beyond, *span, xtol=EXACT * (span[1] - span[0])))  # type: ignore

    def _tell(self, report: Reporter, now: float, own: Progress) -> None:
        report(own._replace(time=now - self.start + own.time, duration=self.end - self.start))

    # ------------------------------------------------------------------ one result
    def _joined(self, case: Case, found: Sequence[tuple[float, xarray.Dataset]]) -> xarray.Dataset:
        """One result of the parts; the sample at the instant of a release is that just after it.

        case : the case with the times of all releases.
        found : the parts, each with the time (s) at which it begins.
        """
        pieces, parts = list[xarray.Dataset](), [part for _, part in found]
        names, between = audited(case.energy_groups, case.air is not None), self._between(case)
        for now, part in found:
            acts = partial(stays, time=now)
            own = placed(case, part, acts, _factors, WATCH)
            if pieces:
                _go_on(own, pieces[-1], names)
            pieces.append(own)
        rows = [
            own.isel(time=slice(int(now in between), None if own is pieces[-1] else -1))
            for own, (now, _) in zip(pieces, found, strict=True)
        ]
        whole = xarray.concat(rows, "time")
        whole = whole.isel(time=slice(None, None, self.every or 1))
        attributes = [part.attrs for part in parts]
        facts = {
            key: _together(key, [own[key] for own in attributes if key in own])
            for key in attributes[0]
            if key not in (*OWN, "every_steps")
        }
        energy = np.stack([whole[name] for name in names], axis=1)
        scale, off = energy_scale(energy, case.air is not None), energy_error(energy)
        facts |= {"interval": self.interval} if self.interval else {"every_steps": self.every}
        at = [f"{place} at t = {time:.9g} s" for place, time in released_at(case).items()]
        facts |= {
            "duration": self.end - self.start,
            "dt": (self.end - self.start) / max(1, facts["steps"]),
            "releases": "; ".join(at),
            "energy_error": float(np.abs(off).max()) / scale if scale else 0.0,
        }
        first, last = parts[0], parts[-1]
        ends = {name: last[name] for name in ("continuation", *ORIGIN) if name in last}
        ends |= {name: first[name] for name in ("continued_from",) if name in first}
        data = {name: (own.dims, own.values, own.attrs) for name, own in {**ends, **whole}.items()}
        along = {"time": ("time", whole["time"].values, first["time"].attrs)}
        result = result_dataset("trajectory", self.case, data, along, facts, stage_times(facts))
        stride = -(-whole.sizes["time"] // max(1, facts["crossing_looks"]))
        return crossings_of(case, whole["displacement"].values, stride).recorded(result)


def _factors(time: float) -> Callable[[Any], float]:
    """Function from a history to its factor at a time (s)."""
    return lambda history: float(history(time))


def _reached(shares: Mapping[str, Callable[..., float]], u: NDArray, time: float) -> list[str]:
    """Places of what is released at displacements (n, 3), m, and a time (s)."""
    return [place for place, share in shares.items() if share(u, _factors(time)) >= 1.0]


def _together(key: str, values: Sequence[Any]) -> Any:
    """An attribute of the whole, from those of the parts."""
    if key == "method":
        return ", ".join(dict.fromkeys(values))
    if key in LEAST or key in MOST:
        return min(values) if key in LEAST else max(values)
    return sum(values) if key in SUMMED or isinstance(values[0], int) else values[0]


def _go_on(own: xarray.Dataset, before: xarray.Dataset, names: Sequence[str]) -> None:
    """Let the totals of a part go on from the part before, whose released parts lose energy."""
    gaps = {name: float(before[name][-1] - own[name][0]) for name in names}
    gaps[DISSIPATED] += sum(gap for name, gap in gaps.items() if name not in SINCE)
    for name in SINCE:
        if name in gaps:
            own[name] = own[name].copy(data=own[name].values + gaps[name])


def prepare_released(
    case: Case, duration: float, prepare: Callable[..., Motion], start: float = 0.0,
    initial: State | None = None, dt: float | None = None, every_steps: int | None = None,
    interval: float | None = None, sample: Mapping[str, Any] | None = None, kept: bool = False,
    **given: Any,
) -> ReleasedMotion:  # fmt: skip
    """Check the input of a motion with releases; see `driver.prepare`, which is `prepare`.

    Samples are kept in memory, even if the result is stored.
    """
    every, span = timing.sampling(duration, every_steps, interval)
    count = math.floor(duration / span * (1.0 + 1e-12) + SAME) if span else 1
    dt = None if dt is None else number("dt", dt, above=0.0)
    motion = ReleasedMotion(
        case, partial(prepare, **given), start, start + count * (span or duration), span, every, dt,
        initial, check_given(sample),
    )  # fmt: skip
    _ = motion.first  # refuses what is wrong before anything is computed
    timing.check_samples(
        motion.expected_samples, len(case.structure.nodes), len(case.reaction_dofs)
    )
    return motion
