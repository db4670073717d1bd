"""Derivatives of measures: what a number that is taken of a result changes with, in the result."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.cases.directions import AXES
from foldyn.errors import InputError
from foldyn.gradients.numbers import Gradient
from foldyn.linear.frf import quantity_of
from foldyn.mechanics.contact.clearance import Clearance
from foldyn.signals.peaks import magnitude_curve
from foldyn.statics import Equilibrium, Landscape
from foldyn.sweeps.measure import Asked, asked
from foldyn.sweeps.measures import (
    MEASURES,
    closest_panels,
    curve_of,
    frequency_of,
    highest,
    intervals,
    sampled,
    time_of,
)
from foldyn.viewer.states import bar_strain

Seeds = dict[str, NDArray]
"""Derivatives of a number by variables of a result, of their shapes, by name."""


class Derivative(NamedTuple):
    """The derivative of a measure.

    seeds : of a result and a case, with the measure's arguments.
    frozen : of a measure that also takes numbers of the case itself: of the result, or what
        measures come through, and the case, the measure as a function of another case, where the
        result stays as it is.
    numbers : of the same the derivatives of such a measure by numbers of the case.
    """

    seeds: Callable[..., Seeds]
    frozen: Callable[..., Callable[[Case], float]] | None = None
    numbers: Callable[..., Gradient] | None = None


def _of_mode(variable: str) -> Derivative:
    def seeds(result: xr.Dataset, case: Case, mode: int, **axis: str) -> Seeds:
        chosen = {"mode": mode, **axis}
        return _at(result, variable, {name: [value] for name, value in chosen.items()}, 1.0)

    return Derivative(seeds)


def _at(result: xr.Dataset, variable: str, place: Mapping[str, Any], value: Any) -> Seeds:
    """Seeds of one variable, zero but at a place."""
    array = xr.zeros_like(result[variable], dtype=float)
    order = [dim for dim in ("time", "step", "mode", "node", "axis") if dim in array.dims]
    array.loc[dict(place)] = value
    return {variable: array.transpose(*order).values}


def _moved(result: xr.Dataset, node: int, axis: str) -> NDArray:
    return result["displacement"].sel(node=node, axis=axis).values


def _samples(result: xr.Dataset, node: int, axis: str, weights: NDArray) -> Seeds:
    """Seeds of a weighted sum of the displacements of a node, sample by sample."""
    array = np.zeros((len(weights), result.sizes["node"], result.sizes["axis"]))
    array[:, node, AXES.index(axis)] = weights
    return {"displacement": array}


def _all_moved(result: xr.Dataset) -> NDArray:
    """Displacements (samples, n, 3)."""
    return sampled(result, "displacement").transpose(..., "node", "axis").values


def _one(count: int, k: int) -> NDArray:
    out = np.zeros(count)
    out[k] = 1.0
    return out


def _displacement(result: xr.Dataset, case: Case, node: int, axis: str) -> Seeds:
    count = len(_moved(result, node, axis))
    return _samples(result, node, axis, _one(count, count - 1))


def _displacement_at(result: xr.Dataset, case: Case, node: int, axis: str, time: float) -> Seeds:
    motion = _moved(result, node, axis)
    return _samples(result, node, axis, _one(len(motion), time_of(result, time)))


def _velocity(result: xr.Dataset, case: Case, node: int, axis: str) -> Seeds:
    count = len(_moved(result, node, axis))
    seeds = _samples(result, node, axis, _one(count, count - 1))
    return {"velocity": seeds["displacement"]}


def _extreme(which: Callable[[NDArray], Any]) -> Callable[..., Seeds]:
    def seeds(result: xr.Dataset, case: Case, node: int, axis: str) -> Seeds:
        motion = _moved(result, node, axis)
        k = int(which(motion))
        rivals = np.flatnonzero(motion == motion[k])
        if len(rivals) > 1 and motion.any():
            raise InputError(
                f"is reached at {len(rivals)} samples at once, which part as the design changes: "
                "it has no derivative; take displacement_at of one of them, or mean_square"
            )
        return _samples(result, node, axis, _one(len(motion), k))

    return seeds


def _trapezoid(result: xr.Dataset) -> NDArray:
    """Weights (k,) of samples in an integral over time, s."""
    step = np.diff(result["time"].values)
    weights = np.zeros(len(step) + 1)
    weights[:-1] += 0.5 * step
    weights[1:] += 0.5 * step
    return weights


def _integral(result: xr.Dataset, case: Case, node: int, axis: str) -> Seeds:
    return _samples(result, node, axis, _trapezoid(result))


def _mean_square(result: xr.Dataset, case: Case, node: int, axis: str) -> Seeds:
    weights = _trapezoid(result)
    motion = _moved(result, node, axis)
    return _samples(result, node, axis, 2.0 * weights * motion / weights.sum())


def _largest_displacement(result: xr.Dataset, case: Case, node: int | None = None) -> Seeds:
    moved = _all_moved(result)
    size = np.linalg.norm(moved, axis=-1)
    if node is not None:
        size = np.where(np.arange(size.shape[1]) == node, size, -1.0)
    k, i = np.unravel_index(size.argmax(), size.shape)
    out = np.zeros_like(moved)
    if not size[k, i] > 0.0:
        raise InputError("is 0, where a size has no derivative")
    out[k, i] = moved[k, i] / size[k, i]
    return {"displacement": out}


class _Strained(NamedTuple):
    """The bar that is strained most: its number, its ends, how they move, and the sample."""

    bar: int
    ends: NDArray  # (2,)
    apart: NDArray  # (3,) displacement of the second less that of the first, m
    sample: int
    moved: NDArray  # (samples, n, 3)

    def strain(self, case: Case) -> tuple[NDArray, float]:
        """Its vector, m, and its strain in a case."""
        a, b = case.structure.nodes[self.ends]
        vector = b - a + self.apart
        return vector, float(np.linalg.norm(vector) / case.structure.bar_length[self.bar] - 1.0)


def _strained(result: xr.Dataset, case: Case) -> _Strained:
    moved = _all_moved(result)
    size = np.stack([np.abs(bar_strain(case.structure, u[None])[0]) for u in moved])
    k, e = (int(i) for i in np.unravel_index(size.argmax(), size.shape))
    ends = case.structure.bars[e]
    return _Strained(e, ends, moved[k, ends[1]] - moved[k, ends[0]], k, moved)


def _strain(result: xr.Dataset, case: Case) -> Seeds:
    found = _strained(result, case)
    vector, strain = found.strain(case)
    length = np.linalg.norm(vector) * case.structure.bar_length[found.bar]
    out = np.zeros_like(found.moved)
    out[found.sample, found.ends[1]] = np.sign(strain) * vector / length
    out[found.sample, found.ends[0]] = -out[found.sample, found.ends[1]]
    return {"displacement": out}


def _strain_of(result: xr.Dataset, case: Case) -> Callable[[Case], float]:
    found = _strained(result, case)
    return lambda other: abs(found.strain(other)[1])


def _clearance(result: xr.Dataset, case: Case) -> Seeds:
    sample, found = _apart(result, case)
    if "displacement" not in result or "mode" in result.dims:
        return {}
    moved = _all_moved(result)
    vector = found.weights @ (case.structure.nodes + moved[sample])[found.nodes]
    out = np.zeros_like(moved)
    out[sample, found.nodes] = np.outer(found.weights, vector / found.distance)
    return {"displacement": out}


def _apart(result: xr.Dataset, case: Case) -> tuple[int, Clearance]:
    sample, found = closest_panels(result, case)
    if not found.distance > 0.0:
        raise InputError("is 0, where panels touch or cross, and a distance has no derivative")
    return sample, found


def _clearance_of(result: xr.Dataset, case: Case) -> Callable[[Case], float]:
    sample, found = _apart(result, case)
    moved = _all_moved(result)[sample] if "mode" not in result.dims else 0.0

    def distance(other: Case) -> float:
        places = (other.structure.nodes + moved)[found.nodes]
        return float(np.linalg.norm(found.weights @ places))

    return distance


def _reaction(result: xr.Dataset, case: Case, axis: str) -> Seeds:
    out = np.zeros((result.sizes["step"], len(case.reaction_dofs)))
    out[-1, (result["support_axis"] == axis).values] = 1.0
    return {"reaction": out}


def _strain_energy(result: xr.Dataset, case: Case) -> Seeds:
    u, k = _strained_most(result, case)
    out = np.zeros((len(u), *u[0].shape))
    out[k] = _forces(case, u[k])
    return {"displacement": out}


def _strained_most(result: xr.Dataset, case: Case) -> tuple[NDArray, int]:
    energy = sum(result[name].values for name in case.energy_groups)
    return _all_moved(result), int(np.argmax(energy))


def _strain_energy_of(result: xr.Dataset, case: Case) -> Callable[[Case], float]:
    u, k = _strained_most(result, case)
    return lambda other: _energy(other, u[k])


def _forces(case: Case, u: NDArray) -> NDArray:
    return case.body.internal(case.body.dofs(u))[: u.size].reshape(-1, 3)


def _energy(case: Case, u: NDArray) -> float:
    return float(case.body.energies(case.body.dofs(u)).sum())


def _limit_load(result: xr.Dataset, case: Case) -> Seeds:
    at = np.flatnonzero(result["point"].values == "limit")
    if not len(at):
        raise InputError("the path has no limit point; trace it by arc_length, and farther")
    low, high = intervals(result, "limit")[0]
    if high > low:
        raise InputError(
            f"the limit point is only known to lie between the load factors {low:.6g} and "
            f"{high:.6g}; trace the path with smaller steps"
        )
    return {"load_factor": _one(result.sizes["step"], int(at[0]))}


def _load_at(result: xr.Dataset, case: Case, node: int, axis: str, displacement: float) -> Any:
    return {"load_at": {(3 * node + AXES.index(axis), displacement): 1.0}}


def _between_states(pair: Callable[[Landscape], tuple[Equilibrium, Equilibrium]]) -> Derivative:
    """Energy of a state above that of another, both without force: it has no other derivative."""

    def frozen(found: Landscape, case: Case) -> Callable[[Case], float]:
        high, low = (state.displacement for state in pair(found))
        return lambda other: _energy(other, high) - _energy(other, low)

    def numbers(landscape: Landscape, case: Case) -> Gradient:
        if not case.imposed_terms:
            return {}
        high, low = pair(landscape)
        motion = sum((vector for vector, _ in case.imposed_terms), np.zeros_like(high.displacement))
        size = np.abs(motion).max()
        found = {}
        for k in range(len(case.imposed_terms)):  # forces of supports that move farther
            found[f"imposed.{k}"] = case.imposed * sum(
                sign * state.stroke / size * _forces(case, state.displacement)
                for sign, state in ((1.0, high), (-1.0, low))
            )
        return found

    return Derivative(_nothing, frozen, numbers)


def _climb(found: Landscape, start: int, end: int) -> tuple[Equilibrium, Equilibrium]:
    stable = found.stable
    if len(stable) < 2:
        raise InputError("there are no two stable states, and so no barrier between them")
    places = sorted(found.states.index(stable[k]) for k in (start, end))
    between = found.states[places[0] : places[1] + 1]
    return max(between, key=lambda state: state.energy), stable[start]


# ------------------------------------------------------------------ frequency responses
def _response(result: xr.Dataset, case: Case, node: int, axis: str, frequency: float) -> Seeds:
    k = frequency_of(result, frequency)
    return _sizes(result, node, [AXES.index(axis)], {k: 1.0})


def _sizes(result: xr.Dataset, node: int, axes: list[int], weights: Mapping[int, float]) -> Seeds:
    """Seeds of a weighted sum of the magnitudes of the response of a node along some axes."""
    name = quantity_of(result)
    response = result[name].transpose("frequency", "node", "axis").values
    out = np.zeros_like(response)
    for k, weight in weights.items():
        own = response[k, node, axes]
        size = float(np.linalg.norm(own))
        if not size > 0.0:
            raise InputError("is 0 or none, where a magnitude has no derivative")
        out[k, node, axes] = weight * own.conj() / size
    return {name: out}


def _peak(which: int) -> Callable[..., Seeds]:
    """Of the frequency (0) or the height (1) of the highest peak, from the samples around it."""

    def seeds(result: xr.Dataset, case: Case, node: int, axis: str | None = None) -> Seeds:
        if "frequency" not in result.dims:
            raise InputError("of a spectrum of a motion has no derivative; take that of an frf")
        f, size, peaks, kind = curve_of(result, node, axis)
        best = highest(peaks)
        if best is None:
            raise InputError("there is no peak among these frequencies; take others")
        at = int(peaks.index[best])
        if (peaks.frequency[best], peaks.height[best]) == (f[at], size[at]):
            raise InputError("the peak has not the shape of a mode; take closer frequencies")
        near, weights = np.arange(at - 1, at + 2), {}
        for k in near:
            change = 1e-3 * size[k] * (np.arange(len(size)) == k)
            there = [
                magnitude_curve(f, size + share * change, kind).peak(at)[which]
                for share in (1.0, -1.0, 2.0, -2.0)
            ]
            slope = (8.0 * (there[0] - there[1]) - (there[2] - there[3])) / (12e-3 * size[k])
            weights[int(np.searchsorted(result["frequency"].values, f[k]))] = slope
        axes = list(range(len(AXES))) if axis is None else [AXES.index(axis)]
        return _sizes(result, node, axes, weights)

    return seeds


def _nothing(result: xr.Dataset, case: Case) -> Seeds:
    return {}


DERIVATIVES: Mapping[str, Derivative] = {
    "mass": Derivative(_nothing, numbers=lambda result, case: {"mass": np.ones(case.mass.nnz)}),
    "frequency": _of_mode("frequency"),
    "damping_ratio": _of_mode("damping_ratio"),
    "effective_mass": _of_mode("effective_mass"),
    "displacement": Derivative(_displacement),
    "displacement_at": Derivative(_displacement_at),
    "velocity": Derivative(_velocity),
    "maximum": Derivative(_extreme(np.argmax)),
    "minimum": Derivative(_extreme(np.argmin)),
    "integral": Derivative(_integral),
    "mean_square": Derivative(_mean_square),
    "largest_displacement": Derivative(_largest_displacement),
    "strain": Derivative(_strain, frozen=_strain_of),
    "strain_energy": Derivative(_strain_energy, frozen=_strain_energy_of),
    "clearance": Derivative(_clearance, frozen=_clearance_of),
    "reaction": Derivative(_reaction),
    "limit_load": Derivative(_limit_load),
    "load_at": Derivative(_load_at),
    "response": Derivative(_response),
    "peak_frequency": Derivative(_peak(0)),
    "peak_height": Derivative(_peak(1)),
    "barrier": _between_states(lambda found: _climb(found, 0, 1)),
    "barrier_back": _between_states(lambda found: _climb(found, 1, 0)),
}
"""By the name of the measure."""


def one_number(text: str, kind: Any) -> Asked:
    """A measure of the registry that is one number of results of a kind.

    Raises
    ------
    InputError
        There is none, or it is none.
    """
    one = asked(text, MEASURES)
    kinds = one.measure.kinds
    if kinds and kind not in kinds:
        raise InputError(f": {text} is of results of kind {' or '.join(kinds)}, not {kind}")
    if one.measure.dims:
        raise InputError(f": {text} is an array; ask for one of its numbers, as frequency[1]")
    return one


def derivative_of(one: Asked) -> Derivative:
    """Derivative of a measure.

    Raises
    ------
    InputError
        It has none.
    """
    found = DERIVATIVES.get(one.measure.name)
    if found is None:
        raise InputError(
            f": {one.text} has no derivative; those that have one are {', '.join(DERIVATIVES)}. "
            'Give your own with its derivative, as {"tip": (function, derivative)}, or use '
            'method = "cma", which needs none'
        )
    return found
