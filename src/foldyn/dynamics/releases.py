"""Motions in which supports or planes are released: a chain of motions in one result."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, cast

import numpy as np
import xarray

from foldyn.cases import Case, State
from foldyn.cases.releases import release_times, released, stays
from foldyn.dynamics import timing
from foldyn.dynamics.audit import AIR, AUDITED, audited, energy_error, energy_scale
from foldyn.dynamics.in_memory import InMemory
from foldyn.dynamics.initial import initial_state
from foldyn.dynamics.motion import Motion
from foldyn.dynamics.progress import Progress, Reporter
from foldyn.dynamics.sampling import forces_inside
from foldyn.errors import ComputationError, MotionInterrupted, told_once
from foldyn.results.attributes import OWN
from foldyn.results.crossings import crossings_of
from foldyn.results.dataset import AXIS, result_dataset, stage_times
from foldyn.results.quantities import ORIGIN, energies_of, variable
from foldyn.values import number

SAME = 1e-9  # share of a step or an interval by which times may differ
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

    Parameters
    ----------
    case : Case
        The case with its releases.
    prepare : callable
        Prepares a part; see `driver.prepare`.
    times : tuple of float
        The start, and the end of each part (s).
    between : frozenset of float
        Releases between samples (s).
    interval, every : float, int
        Time between samples (s), or 0 and the number of steps between samples.
    longest : float, optional
        Largest step (s).
    initial : State, optional
    """

    case: Case
    prepare: Callable[..., Motion]
    times: tuple[float, ...]
    between: frozenset[float]
    interval: float
    every: int
    longest: float | None
    initial: State | None

    kind = "a motion with releases"

    @cached_property
    def first(self) -> Motion:
        """The first part."""
        return self._part(0, self.initial)

    def _part(self, k: int, state: State | None) -> Motion:
        """Part number k, from a state."""
        now, length = self.times[k], self.times[k + 1] - self.times[k]
        dt = self.longest
        if dt is not None and abs(length - round(length / dt) * dt) > SAME * length:
            dt = length / math.ceil(length / dt)
        interval = min(self.interval, length) or None
        return self.prepare(
            released(self.case, now), length, initial=state, start=now, dt=dt, interval=interval
        )

    @property
    def method(self) -> Any:
        """The first method, under another name: kernels of GPUs for many motions lack releases."""
        return replace(self.first.method, name=self.kind)

    @property
    def expected_samples(self) -> int:
        """Number of samples, about, if samples are counted in steps."""
        spacing = self.interval or self.every * self.first.plan.dt
        return 1 + round((self.times[-1] - self.times[0]) / spacing)

    def _computed(self, report: Reporter) -> xarray.Dataset:
        parts: list[xarray.Dataset] = []
        with told_once():
            for k, now in enumerate(self.times[:-1]):
                motion = self._next(k, parts[-1]) if parts else self.first
                try:
                    parts.append(motion.run(partial(self._tell, report, now)))
                except (ComputationError, MotionInterrupted) as error:
                    if error.partial is not None and error.partial.sizes["time"]:
                        error.partial = self._joined([*parts, error.partial])
                    raise
        return self._joined(parts)

    def _next(self, k: int, before: xarray.Dataset) -> Motion:
        """Part number k, which goes on from the part before."""
        state = initial_state(before)
        if self.times[k] in release_times(self.case):  # forces change: methods start afresh
            state = replace(state, continuation=None)
        return self._part(k, state)

    def _tell(self, report: Reporter, now: float, own: Progress) -> None:
        start, end = self.times[0], self.times[-1]
        report(own._replace(time=now - start + own.time, duration=end - start))

    # ------------------------------------------------------------------ one result
    def _joined(self, parts: Sequence[xarray.Dataset]) -> xarray.Dataset:
        """One result of the parts; the sample at the instant of a release is that just after it."""
        case, pieces = self.case, list[xarray.Dataset]()
        names = audited(case.energy_groups, case.air is not None)
        for now, part in zip(self.times, parts, strict=False):
            own = self._placed(part, now)
            if pieces:
                _go_on(own, pieces[-1], names)
            pieces.append(own)
        rows = [
            own.isel(time=slice(int(now in self.between), None if own is pieces[-1] else -1))
            for own, now in zip(pieces, self.times, strict=False)
        ]
        whole = xarray.concat(rows, "time").drop_vars(["support", "plane"], errors="ignore")
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
        facts |= {
            "duration": self.times[-1] - self.times[0],
            "dt": (self.times[-1] - self.times[0]) / max(1, facts["steps"]),
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

    def _placed(self, part: xarray.Dataset, now: float) -> xarray.Dataset:
        """Samples of a part from a time (s) on, as the whole case has them: 0 where released."""
        case, own = self.case, part[[name for name in part if "time" in part[name].dims]]
        dofs = 3 * part["support_node"].values + np.searchsorted(AXIS, part["support_axis"])
        own = own.drop_vars(["support_node", "support_axis"]).assign_coords(support=dofs)
        own = own.reindex(support=case.reaction_dofs, fill_value=0.0)
        planes = case.contact.planes if case.contact else ()
        if "plane" in own.dims:
            acting = [k for k, plane in enumerate(planes) if stays(plane, now)]
            own = own.assign_coords(plane=acting).reindex(plane=range(len(planes)), fill_value=0.0)
        sizes = {**own.sizes, "plane": len(planes)}
        for name, one in {**energies_of(case), **forces_inside(case)}.items():
            dims = ("time", *one.dims)
            if name == "tension":  # also of springs, where no bar or cable is left
                acts = [stays(support, now) for support, *_ in case.polylines()]
                states = [own[name].values for name in ("displacement", "velocity", "time")]
                pulls = [cast(Any, one.function)(*state) for state in zip(*states, strict=True)]
                own = own.drop_vars(name, errors="ignore")
                own[name] = variable(dims, np.array(pulls) * acts, one.units, one.text)
            elif name not in own:
                zero = np.zeros([sizes[dim] for dim in dims])
                own[name] = variable(dims, zero, one.units, one.text)
        return own


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
    interval: float | None = None, kept: bool = False, **given: Any,
) -> ReleasedMotion:  # fmt: skip
    """Check the input of a motion with releases; see `driver.prepare`, which is `prepare`.

    Samples are kept in memory, even if the result is stored.
    """
    every, span = timing.sampling(duration, every_steps, interval)
    count = math.floor(duration / span * (1.0 + 1e-12) + SAME) if span else 1
    end = start + count * (span or duration)
    within = {time: (time - start) / (span or math.inf) for time in release_times(case)}
    within = {time: steps for time, steps in within.items() if start < time < end}
    off = {time: steps for time, steps in within.items() if abs(steps - round(steps)) > SAME}
    beside = {
        start + near(steps) * span for steps in off.values() for near in (math.floor, math.ceil)
    }
    times = tuple(sorted({start, end, *within, *beside}))
    dt = None if dt is None else number("dt", dt, above=0.0)
    own = partial(prepare, **given)
    motion = ReleasedMotion(case, own, times, frozenset(off), span, every, dt, initial)
    _ = motion.first  # refuses what is wrong before anything is computed
    timing.check_samples(
        motion.expected_samples, len(case.structure.nodes), len(case.reaction_dofs)
    )
    return motion
