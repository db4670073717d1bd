"""Paths in which supports and planes are released between two points: a chain of paths."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn.cases import Case, State
from foldyn.cases.releases import awaited, released, released_at, stays, timed
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


def _left(plan: PathPlan, passed: list[float]) -> PathPlan:
    """What is left of a plan after points at some load factors, from the last of these on."""
    now, factors = passed[-1], list(plan.factors)
    for factor in passed[1:]:
        if factors and factor == factors[0]:
            del factors[0]
    steps = max(0, plan.steps - len(passed) + 1)
    if plan.end == now:
        return plan._replace(begin=now, end=None, steps=0)
    step = plan.first_step if plan.end is None else math.copysign(plan.first_step, plan.end - now)
    return plan._replace(begin=now, factors=factors, steps=steps, first_step=step)


def trace_released(
    follow: Callable[..., xarray.Dataset], case: Case, plan: PathPlan, initial: State | None,
    until: Callable[[NDArray, float], Any] | None,
) -> xarray.Dataset:  # fmt: skip
    """Path of a case with parts that are released where something is reached.

    Parameters
    ----------
    follow : callable
        ``follow(case, plan, initial, watch)`` follows a path, which ends where ``watch`` is true.
    until : callable, optional
        End of the whole path; `follow` does not look for it at the first point of a part.
    """
    parts: list[tuple[Case, xarray.Dataset]] = []

    def ends(u: NDArray, factor: float) -> bool:
        return until is not None and len(parts) > 0 and until(u, factor)

    with told_once():
        while True:
            reached = partial(_reached, awaited(case, 0.0))
            watch = partial(_either, ends, reached)
            try:
                part = follow(released(case, 0.0), plan, initial, watch)
            except (ComputationError, MotionInterrupted) as error:
                if error.partial is not None:
                    error.partial = _joined([*parts, (case, error.partial)])
                raise
            except InputError as error:
                if not parts:
                    raise
                when = f"after a release at the load factor {plan.begin:.6g}"
                raise ComputationError(f"{when}: {error}", _joined(parts)) from None
            parts.append((case, part))
            moved, factors = part["displacement"].values, part["load_factor"].values.tolist()
            free = reached(moved[-1], factors[-1])
            if ends(moved[-1], factors[-1]) or not free:
                return _joined(parts)
            case, plan = timed(case, dict.fromkeys(free, 0.0)), _left(plan, factors)
            memory = part["memory"].values[-1] if "memory" in part else None
            initial = State(displacement=moved[-1], memory=memory)


def _reached(shares: Mapping[str, Callable[..., float]], u: NDArray, factor: float) -> list[str]:
    """Places of what is released at displacements (n, 3), m, and a load factor."""
    return [place for place, share in shares.items() if share(u, _factors(factor)) >= 1.0]


def _either(one: Callable[..., Any], other: Callable[..., Any], *at: Any) -> Any:
    """Whether one of two functions is true."""
    return one(*at) or other(*at)


def _factors(factor: float) -> Callable[[Any], float]:
    """Function from a history to its factor: the load factor."""
    return lambda history: factor


def _joined(parts: list[tuple[Case, xarray.Dataset]]) -> xarray.Dataset:
    """One result of the parts of a path, each with its case; both points at a release are kept."""
    (whole, first), pieces = parts[0], list[xarray.Dataset]()
    for case, part in parts:
        own = placed(case, part, partial(stays, time=0.0), _factors)
        lost = own[DISSIPATED].values if DISSIPATED in own else np.zeros(own.sizes["step"])
        if pieces:
            before, jump = pieces[-1].isel(step=-1), part.attrs[JUMP]
            done = own["work"].values
            own["work"] = own["work"].copy(data=done - done[0] + float(before["work"]) + jump)
            gap = sum(float(before[name] - own[name][0]) for name in energies_of(whole))
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
    result = result_dataset("path", whole, data, along, _facts(parts, joined))
    result.attrs |= {key: first.attrs[key] for key in OWN if key in first.attrs}
    return crossings_of(whole, joined["displacement"].values).recorded(result)


def _unknown(own: xarray.Dataset, other: xarray.DataArray) -> xarray.DataArray:
    """Values of a variable that other parts have: no width of intervals, and zero otherwise."""
    if other.name == "interval":
        return own["load_factor"].expand_dims(end=2, axis=1).drop_vars("load_factor")
    shape = [own.sizes["step"], *other.shape[1:]]
    return xarray.DataArray(np.zeros(shape), dims=other.dims, attrs=other.attrs)


def _facts(parts: list[tuple[Case, xarray.Dataset]], joined: xarray.Dataset) -> dict[str, Any]:
    """Facts about the whole path."""
    attributes = [part.attrs for _, part in parts]
    found = {key: value for key, value in attributes[0].items() if key not in OWN}
    found |= {key: attributes[-1][key] for key in ENDS if key in attributes[-1]}
    found |= {key: sum(own[key] for own in attributes) for key in SUMMED}
    negative = joined["negative_eigenvalues"].values
    found["unstable_points"] = int((negative > 0).sum()) if negative.max() >= 0 else -1
    changes = [own["stability_changes"] for own in attributes if own["stability_changes"] != "none"]
    found["stability_changes"] = "; ".join(changes) or "none"
    texts, samples, sample = list[str](), list[int](), 0
    for (one, part), (other, _) in pairwise(parts):
        sample += part.sizes["step"]
        at = f"the load factor {float(part['load_factor'][-1]):.6g}"
        free = [place for place in released_at(other) if place not in released_at(one)]
        texts += [f"{place} at {at}" for place in free]
        samples += [sample for _ in free]
    del found[JUMP]
    return found | {"releases": "; ".join(texts), "released_from": samples}
