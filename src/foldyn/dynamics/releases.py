"""Motions in which supports or planes are released: a chain of motions in one result."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from time import perf_counter
from typing import Any

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn.cases import Case, State
from foldyn.cases.reached import Reached
from foldyn.cases.releases import release_times, released, waiting
from foldyn.dynamics import timing
from foldyn.dynamics.audit import AIR, AUDITED, audited, energy_error, energy_scale
from foldyn.dynamics.in_memory import InMemory
from foldyn.dynamics.initial import initial_state
from foldyn.dynamics.motion import Motion
from foldyn.dynamics.progress import Progress, Reporter
from foldyn.dynamics.sampling import check_given
from foldyn.errors import ComputationError, InputError, MotionInterrupted, quietly, told_once
from foldyn.results.attributes import OWN
from foldyn.results.crossings import crossings_of
from foldyn.results.dataset import result_dataset, stage_times
from foldyn.results.parts import placed
from foldyn.results.quantities import ORIGIN
from foldyn.values import number

SAME = 1e-9  # share of a step or an interval by which times may differ
EXACT = 1e-8  # share of an interval to which the instant is found at which something is reached
ALIKE = 1e-6  # share of an interval within which two such instants are one
WATCH = "_awaited"  # quantity that ends a part: nan where something is reached
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

    @cached_property
    def _waiting(self) -> dict[Reached, tuple[list[str], Callable[..., float]]]:
        """What the case waits for: places of what it releases, and its share of the way."""
        found = waiting(self.case).items()
        return {until: (places, until.share(self.case)) for until, places in found}

    def _reached(
        self, times: Mapping[str, float], now: float, u: NDArray, at: float
    ) -> list[Reached]:
        """What is newly reached at displacements (n, 3), m, and a time (s) of the part from now."""
        gone, factors = _gone(times, now), _factors(at)
        return [
            until
            for until, (places, share) in self._waiting.items()
            if places[0] not in times and share(u, factors, gone) >= 1.0
        ]

    def _release(self, times: dict[str, float], now: float, state: State | None) -> None:
        """Add the time of what a state releases at once."""
        u = (state or State()).of_nodes("displacement", self.case.structure.nodes.shape)
        while reached := self._reached(times, now, u, now):
            times |= {place: now for until in reached for place in self._waiting[until][0]}

    @property
    def _near(self) -> float:
        """Share of an interval by which times may differ, with their rounding."""
        rounding = 8.0 * np.finfo(float).eps * max(abs(self.start), abs(self.end))
        return SAME + (rounding / self.interval if self.interval else 0.0)

    def _between(self, times: Mapping[str, float]) -> dict[float, float]:
        """Releases between samples (s), with their numbers of intervals."""
        inside = [time for time in times.values() if self.start < time < self.end]
        steps = {time: (time - self.start) / (self.interval or math.inf) for time in inside}
        return {time: own for time, own in steps.items() if abs(own - round(own)) > self._near}

    def _stop(self, times: Mapping[str, float], now: float) -> float:
        """End (s) of the part that begins now."""
        beside = [
            self.start + near(steps) * self.interval
            for steps in self._between(times).values()
            for near in (math.floor, math.ceil)
        ]
        return min(t for t in (*times.values(), *beside, self.end) if now < t <= self.end)

    @cached_property
    def first(self) -> Motion:
        """The first part."""
        times = release_times(self.case)
        self._release(times, self.start, self.initial)
        return self._part(times, self.start, self._stop(times, self.start), self.initial)

    def _part(
        self, times: Mapping[str, float], now: float, stop: float, state: State | None,
        watched: bool = True,
    ) -> Motion:  # fmt: skip
        """Part of the motion, from a state; if watched, it ends where something is reached."""
        length, dt = stop - now, self.longest
        if self.interval and (count := round(length / self.interval)):
            exact = count * self.interval
            length = exact if abs(exact - length) <= self._near * self.interval else length
        if dt is not None and abs(length - round(length / dt) * dt) > SAME * length:
            dt = length / math.ceil(length / dt)
        given: dict[str, Any] = {"sample": self.sample if watched else {}}
        if watched and any(places[0] not in times for places, _ in self._waiting.values()):

            def watch(u: NDArray, v: NDArray, time: float) -> float:
                return math.nan if self._reached(times, now, u, time) else 0.0

            given["sample"] = {**self.sample, WATCH: watch}
        if dt is not None and now > self.start and not self.first.method.adaptive:
            given["force"] = True  # the user's step, which the first part has checked
        return self.prepare(
            released(self.case, _gone(times, now)), length, initial=state, start=now, dt=dt,
            interval=min(self.interval, length) or None, **given,
        )  # fmt: skip

    @property
    def expected_samples(self) -> int:
        """Number of samples, about, if samples are counted in steps."""
        spacing = self.interval or self.every * self.first.plan.dt
        return 1 + round((self.end - self.start) / spacing)

    def _computed(self, report: Reporter) -> xarray.Dataset:
        parts, times = list[tuple[float, xarray.Dataset]](), release_times(self.case)
        began = perf_counter()
        with told_once():
            try:
                self._follow(report, parts, times)
            except InputError as error:
                if not parts:
                    raise
                at = f"after a release, at t = {float(parts[-1][1]['time'][-1]):.6g} s"
                raise ComputationError(f"{at}: {error}", self._joined(parts, times)) from None
            except (ComputationError, MotionInterrupted) as error:
                error.partial = self._joined(parts, times) if parts else None
                raise
            except KeyboardInterrupt:
                kept = self._joined(parts, times) if parts else None
                raise MotionInterrupted("interrupted between two parts", kept) from None
        return self._joined(parts, times).assign_attrs(wall_seconds=perf_counter() - began)

    def _follow(
        self, report: Reporter, parts: list[tuple[float, xarray.Dataset]], times: dict[str, float]
    ) -> None:
        """Add the parts of the motion, each with its start, and the times of releases."""
        now, state, motion = self.start, self.initial, self.first
        self._release(times, now, state)
        while True:
            stop = self._stop(times, now)
            try:
                part = motion.run(partial(self._tell, report, now))
            except (ComputationError, MotionInterrupted) as error:
                part, known = error.partial, isinstance(error, ComputationError)
                after = self._passed(times, now, part) if known and part is not None else 0
                if part is not None and part.sizes["time"]:
                    parts.append((now, part.isel(time=slice(0, after or None))))
                if not after:
                    raise
                times |= self._instants(times, now, error.partial, after)
                del parts[-1]
            else:
                parts.append((now, part))
                now, state = stop, initial_state(part)
                if now in times.values():  # forces change: methods start afresh
                    state = replace(state, continuation=None)
                if now >= self.end:
                    return
            self._release(times, now, state)
            motion = self._part(times, now, self._stop(times, now), state)

    def _passed(self, times: Mapping[str, float], now: float, part: xarray.Dataset) -> int:
        """Number of the first sample of a part at which something is reached; 0 if nothing is."""
        at = zip(part["displacement"].values, part["time"].values.tolist(), strict=True)
        return next((k for k, one in enumerate(at) if self._reached(times, now, *one)), 0)

    def _instants(
        self, times: Mapping[str, float], now: float, part: xarray.Dataset, after: int
    ) -> dict[str, float]:
        """Time (s) between two samples at which something is first reached, by what it releases."""
        span, moved = part["time"].values[after - 1 : after + 1], part["displacement"].values
        near = max(ALIKE, self._near) * (span[1] - span[0])
        state = replace(initial_state(part, after - 1), continuation=None)
        found = {
            until: self._instant(times, span.tolist(), state, self._waiting[until][1])
            for until in self._reached(times, now, moved[after], float(span[1]))
        }
        first = min(found.values())
        first = next((float(time) for time in span if abs(first - time) <= near), first)
        together = [until for until, time in found.items() if time <= first + near]
        return {place: first for until in together for place in self._waiting[until][0]}

    def _instant(
        self, times: Mapping[str, float], span: Sequence[float], state: State,
        share: Callable[..., float],
    ) -> float:  # fmt: skip
        """Time (s) between two samples at which something is reached, from the first one's state.

        The motion may start otherwise than it went on: if it is late, the second sample counts.
        """
        from scipy.optimize import brentq  # loads slowly

        gone = _gone(times, span[0])

        def beyond(time: float) -> float:
            u = state.displacement
            if time > span[0]:
                part = self._part(times, span[0], time, state, watched=False).run()
                u = part["displacement"].values[-1]
            return share(u, _factors(time), gone) - 1.0

        with quietly():
            if beyond(span[1]) < 0.0:
                return span[1]
            return float(brentq(beyond, *span, xtol=EXACT * (span[1] - span[0])))  # type: ignore

    def _tell(self, report: Reporter, now: float, own: Progress) -> None:
        report(own._replace(time=now - self.start + own.time, duration=self.end - self.start))

    # ------------------------------------------------------------------ one result
    def _joined(
        self, found: Sequence[tuple[float, xarray.Dataset]], times: Mapping[str, float]
    ) -> xarray.Dataset:
        """One result of the parts; the sample at the instant of a release is that just after it.

        found : the parts, each with the time (s) at which it begins.
        times : of the releases, s, by place.
        """
        case, pieces, parts = self.case, list[xarray.Dataset](), [part for _, part in found]
        names, between = audited(case.energy_groups, case.air is not None), self._between(times)
        for now, part in found:
            own = placed(case, part, _gone(times, now), _factors, WATCH)
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
        gone = {p: times[p] for p in sorted(times, key=times.__getitem__) if times[p] <= self.end}
        facts |= {
            "duration": self.end - self.start,
            "dt": (self.end - self.start) / max(1, facts["steps"]),
            "releases": "; ".join(f"{place} at t = {at:.12g} s" for place, at in gone.items()),
            "released_from": np.searchsorted(whole["time"].values, [*gone.values()]),
            "energy_error": float(np.abs(off).max()) / scale if scale else 0.0,
        }
        first, last = parts[0], parts[-1]
        ends = {name: last[name] for name in ("continuation", *ORIGIN) if name in last}
        ends |= {name: first[name] for name in ("continued_from",) if name in first}
        data = {name: (own.dims, own.values, own.attrs) for name, own in {**ends, **whole}.items()}
        along = {"time": ("time", whole["time"].values, first["time"].attrs)}
        result = result_dataset("trajectory", case, data, along, facts, stage_times(facts))
        stride = -(-whole.sizes["time"] // max(1, facts["crossing_looks"]))
        return crossings_of(case, whole["displacement"].values, stride).recorded(result)


def _gone(times: Mapping[str, float], now: float) -> set[str]:
    """Places of what is released up to a time (s)."""
    return {place for place, time in times.items() if time <= now}


def _factors(time: float) -> Callable[[Any], float]:
    """Function from a history to its factor at a time (s)."""
    return lambda history: float(history(time))


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
