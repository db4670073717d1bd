"""Paths in which supports and planes are released between two points: a chain of paths."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn.cases import Case, State
from foldyn.cases.releases import released, waiting
from foldyn.errors import ComputationError, InputError, MotionInterrupted, told_once
from foldyn.results.attributes import OWN
from foldyn.results.crossings import crossings_of
from foldyn.results.dataset import result_dataset
from foldyn.results.parts import placed
from foldyn.results.quantities import PATH, energies_of, variable
from foldyn.statics.path_methods import PathPlan

SUMMED = ("newton_iterations", "factorizations", "step_cuts", "wall_seconds")
ENDS = ("status", "stopped_because", "remedy")
DISSIPATED = "dissipated"
JUMP = "released_work"  # attribute of a part: work of the loads (J) up to its first point


def _left(plan: PathPlan, part: xarray.Dataset) -> PathPlan:
    """What is left of a plan after a part, whose motion at its end it continues."""
    passed, factors = part["load_factor"].values.tolist(), list(plan.factors)
    for factor in passed[1:]:
        if factors and factor == factors[0]:
            del factors[0]
    now, steps = passed[-1], max(0, plan.steps - len(passed) + 1)
    if plan.end == now:
        return plan._replace(begin=now, end=None, steps=0)
    moved = part["displacement"].values[-2:]
    motion = moved[1] - moved[0] if len(moved) > 1 else None
    return plan._replace(begin=now, factors=factors, steps=steps, motion=motion)


def trace_released(
    follow: Callable[..., xarray.Dataset], case: Case, plan: PathPlan, initial: State | None,
    until: Callable[..., Any] | None,
) -> xarray.Dataset:  # fmt: skip
    """Path of a case with parts that are released where something is reached.

    Parameters
    ----------
    follow : callable
        ``follow(case, plan, initial, watch)`` follows a path, which ends where ``watch`` is true.
    until : callable, optional
        End of the whole path; `follow` does not look for it at the first point of a part.
    """
    parts, gone = list[xarray.Dataset](), list[dict[str, float]]()  # load factors by place
    awaited = [(places, until.share(case)) for until, places in waiting(case).items()]
    free: dict[str, float] = {}

    def reached(u: NDArray, factor: float) -> dict[str, float]:
        found = [
            places
            for places, share in awaited
            if places[0] not in free and share(u, _factors(factor), free) >= 1.0
        ]
        return {place: factor for places in found for place in places}

    def ends(u: NDArray, factor: float) -> bool:
        return until is not None and len(parts) > 0 and until(u, factor, free)

    def watch(u: NDArray, factor: float) -> bool:
        return ends(u, factor) or bool(reached(u, factor))

    if initial is not None and initial.displacement is not None:
        free |= reached(np.asarray(initial.displacement), plan.begin)
    with told_once():
        while True:
            gone.append(dict(free))
            try:
                parts.append(follow(released(case, free), plan, initial, watch))
            except (ComputationError, MotionInterrupted, InputError) as error:
                own = getattr(error, "partial", None)
                kept = [*parts, *([] if own is None else [own])]
                if not kept:
                    raise
                whole = _joined(case, kept, gone)
                if own is not None or isinstance(error, MotionInterrupted):
                    error.partial = whole  # type: ignore[union-attr]
                    raise
                released_now = ", ".join(place for place in free if free[place] == plan.begin)
                why = f"after the release of {released_now} at {plan.begin:.6g}: {error}"
                stop = {"status": "stopped", "stopped_because": why}
                whole.attrs |= stop | {"remedy": "hold what is left, or end the path before"}
                raise ComputationError(why, whole) from None
            moved, factors = parts[-1]["displacement"].values, parts[-1]["load_factor"].values
            at = moved[-1], float(factors[-1])
            if ends(*at) or not reached(*at):
                return _joined(case, parts, gone)
            free |= reached(*at)
            plan = _left(plan, parts[-1])
            memory = parts[-1]["memory"].values[-1] if "memory" in parts[-1] else None
            initial = State(displacement=moved[-1], memory=memory)


def _factors(factor: float) -> Callable[[Any], float]:
    """Function from a history to its factor: the load factor."""
    return lambda history: factor


def _joined(
    case: Case, parts: list[xarray.Dataset], gone: list[dict[str, float]]
) -> xarray.Dataset:
    """One result of the parts of a path; both points at a release are kept.

    gone : load factors of what is released in each part, by places.
    """
    pieces, first = list[xarray.Dataset](), parts[0]
    for free, part in zip(gone, parts, strict=False):
        own = placed(case, part, free, _factors)
        lost = own[DISSIPATED].values if DISSIPATED in own else np.zeros(own.sizes["step"])
        if pieces:
            before, jump = pieces[-1].isel(step=-1), part.attrs[JUMP]
            done = own["work"].values
            own["work"] = own["work"].copy(data=done - done[0] + float(before["work"]) + jump)
            gap = sum(float(before[name] - own[name][0]) for name in energies_of(case))
            lost = lost - lost[0] + float(before[DISSIPATED]) + gap + jump
        known = PATH[DISSIPATED]
        own[DISSIPATED] = variable(("step",), lost, known.units, known.text)
        pieces.append(own)
    known = {name: own[name] for own in pieces for name in own}
    for own in pieces:
        for name in known.keys() - set(own):
            own[name] = _unknown(own, known[name])
    joined = xarray.concat(pieces, "step")
    data = {str(name): (own.dims, own.values, own.attrs) for name, own in joined.items()}
    along = {"load_factor": ("step", joined["load_factor"].values, first["load_factor"].attrs)}
    result = result_dataset("path", case, data, along, _facts(parts, gone, joined))
    result.attrs |= {key: first.attrs[key] for key in OWN if key in first.attrs}
    return crossings_of(case, joined["displacement"].values).recorded(result)


def _unknown(own: xarray.Dataset, other: xarray.DataArray) -> xarray.DataArray:
    """Values of a variable that other parts have: no width of intervals, and zero otherwise."""
    if other.name == "interval":
        return own["load_factor"].expand_dims(end=2, axis=1).drop_vars("load_factor")
    shape = [own.sizes["step"], *other.shape[1:]]
    return xarray.DataArray(np.zeros(shape), dims=other.dims, attrs=other.attrs)


def _facts(
    parts: list[xarray.Dataset], gone: list[dict[str, float]], joined: xarray.Dataset
) -> dict[str, Any]:
    """Facts about the whole path."""
    attributes = [part.attrs for part in parts]
    found = {key: value for key, value in attributes[0].items() if key not in (*OWN, JUMP)}
    found |= {key: attributes[-1][key] for key in ENDS if key in attributes[-1]}
    found |= {key: sum(own[key] for own in attributes) for key in SUMMED}
    negative = joined["negative_eigenvalues"].values
    found["unstable_points"] = int((negative > 0).sum()) if negative.max() >= 0 else -1
    changes = dict.fromkeys(own["stability_changes"] for own in attributes)
    told = [change for change in changes if change != "none"]
    found["stability_changes"] = "; ".join(told) or "none"
    begin = np.cumsum([0, *(part.sizes["step"] for part in parts)])
    since = {place: int(begin[k]) for k in reversed(range(len(parts))) for place in gone[k]}
    at = {place: factor for free in gone[: len(parts)] for place, factor in free.items()}
    found["releases"] = "; ".join(f"{place} at the load factor {at[place]:.6g}" for place in at)
    return found | {"released_from": [since[place] for place in at]}
