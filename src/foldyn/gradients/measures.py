"""Derivatives of measures with respect to variables of the result."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.cases.directions import AXES
from foldyn.errors import InputError
from foldyn.gradients.expressions import TIE
from foldyn.gradients.parameters import Gradient
from foldyn.linear.frf import quantity_of
from foldyn.linear.margins import margins
from foldyn.signals.peaks import magnitude_curve
from foldyn.statics import Equilibrium, Landscape
from foldyn.sweeps import measures
from foldyn.sweeps.cell_measures import EFFECTIVE, PROPERTIES
from foldyn.sweeps.measure import Asked, asked
from foldyn.viewer.states import bar_strain

Seeds = dict[str, NDArray]
"""Derivatives of a quantity with respect to each variable of a result, in the variable's shape."""


class Derivative(NamedTuple):
    """The derivative of a measure.

    seeds : function of a result, a case and the measure's arguments that returns the derivatives
        with respect to variables of the result.
    frozen : for a measure that also depends on the case directly. From the result (or the measure's
        intermediate result), the case and the arguments, it returns the measure as a smooth
        function of another case, with the result held fixed, to be differenced.
    numbers : from the same arguments, derivatives of such a measure with respect to numbers of the
        case.
    places : for an extreme, from the same arguments, all places that reach it; `seeds` and `frozen`
        take one of them as `at`. The measure has a derivative if it is the same at all places.
    cut : whether the measure depends on the cut lengths of bars, in addition to the result.
    beside : for a measure that is differenced, from the result (or the measure's intermediate
        result), the case and the arguments: for each place that reaches it, the measure there as a
        function of the result of a slightly different case. Nothing else is needed then.
    """

    seeds: Callable[..., Seeds]
    frozen: Callable[..., Callable[[Case], float]] | None = None
    numbers: Callable[..., Gradient] | None = None
    places: Callable[..., Sequence[Any]] | None = None
    cut: bool = False
    beside: Callable[..., list[Callable[[Any], float]]] | None = None


def _largest(numbers: NDArray) -> list[tuple[int, ...]]:
    """Index of the largest number, followed by the indices of numbers tied with it."""
    top = numbers.max()
    tied = np.argwhere(numbers >= top - TIE * abs(top))
    order = np.argsort(-numbers[tuple(tied.T)], kind="stable")
    return [tuple(place) for place in tied[order].tolist()]


def _of_mode(variable: str) -> Derivative:
    """Derivative of a measure that is one entry of a modal variable."""

    def seeds(result: xr.Dataset, case: Case, mode: int, **axis: str) -> Seeds:
        chosen = {"mode": mode, **axis}
        return _at(result, variable, {name: [value] for name, value in chosen.items()}, 1.0)

    return Derivative(seeds)


def _at(result: xr.Dataset, variable: str, place: Mapping[str, Any], value: Any) -> Seeds:
    """Seeds of one variable, zero except at a place."""
    array = xr.zeros_like(result[variable], dtype=float)
    order = [dim for dim in ("time", "step", "mode", "node", "axis") if dim in array.dims]
    array.loc[dict(place)] = value
    return {variable: array.transpose(*order).values}


def _of_samples(weights: Callable[..., NDArray], variable: str = "displacement") -> Derivative:
    """Derivative of a weighted sum of one node's samples along an axis.

    weights : function of the result, the node's displacements (k,), and further arguments.
    """

    def seeds(result: xr.Dataset, case: Case, node: int, axis: str, **further: Any) -> Seeds:
        motion = result["displacement"].sel(node=node, axis=axis).values
        array = np.zeros((len(motion), result.sizes["node"], result.sizes["axis"]))
        array[:, node, AXES.index(axis)] = weights(result, motion, **further)
        return {variable: array}

    return Derivative(seeds)


def _all_moved(result: xr.Dataset) -> NDArray:
    """Displacements (samples, n, 3)."""
    return measures.sampled(result, "displacement").transpose(..., "node", "axis").values


def _one(count: int, k: int) -> NDArray:
    out = np.zeros(count)
    out[k] = 1.0
    return out


def _extreme(sign: float) -> Derivative:
    """Derivative of the highest (sign 1) or lowest (-1) displacement of a node."""

    def places(result: xr.Dataset, case: Case, node: int, axis: str) -> list[tuple[int, ...]]:
        return _largest(sign * result["displacement"].sel(node=node, axis=axis).values)

    return _of_samples(lambda result, motion, at: _one(len(motion), *at))._replace(places=places)


def _trapezoid(result: xr.Dataset) -> NDArray:
    """Weights (k,), s, of samples in a time integral by trapezoids."""
    step = np.diff(result["time"].values)
    return 0.5 * (np.append(step, 0.0) + np.append(0.0, step))


def _mean_square(result: xr.Dataset, motion: NDArray) -> NDArray:
    """Derivatives (k,) of a mean square with respect to the samples."""
    weights = _trapezoid(result)
    return 2.0 * weights * motion / weights.sum()


def _moved_farthest(
    result: xr.Dataset, case: Case, node: int | None = None
) -> list[tuple[int, ...]]:
    """Sample and node with the largest displacement, among all nodes or for one node, and ties."""
    size = np.linalg.norm(_all_moved(result), axis=-1)
    if node is not None:
        size = np.where(np.arange(size.shape[1]) == node, size, -1.0)
    if not size.max() > 0.0:
        raise InputError("is 0, where a size has no derivative")
    return _largest(size)


def _largest_displacement(
    result: xr.Dataset, case: Case, at: tuple[int, int], node: int | None = None
) -> Seeds:
    moved = _all_moved(result)
    out = np.zeros_like(moved)
    out[at] = moved[at] / np.linalg.norm(moved[at])
    return {"displacement": out}


def _strained_most(result: xr.Dataset, case: Case) -> list[tuple[int, ...]]:
    """Sample and bar with the largest strain, and ties."""
    return _largest(np.abs(bar_strain(case.structure, _all_moved(result))))


class _Bar(NamedTuple):
    """A bar, stretched (sign 1) or shortened (-1); `apart` (m): relative motion of its ends."""

    ends: NDArray  # (2,)
    apart: NDArray  # (3,)
    sign: float

    def strain(self, case: Case) -> tuple[NDArray, float]:
        """Vector at rest (m) and absolute strain, accurate also for small strains."""
        a, b = case.structure.nodes[self.ends]
        rest = b - a
        excess = float((2.0 * rest + self.apart) @ self.apart / (rest @ rest))
        return rest, self.sign * excess / (1.0 + np.sqrt(1.0 + excess))


def _bar(result: xr.Dataset, case: Case, at: tuple[int, int]) -> _Bar:
    """The bar at a place, with its elongation and sign."""
    sample, bar = at
    ends, moved = case.structure.bars[bar], _all_moved(result)[sample]
    one = _Bar(ends, moved[ends[1]] - moved[ends[0]], 1.0)
    return one._replace(sign=float(np.sign(one.strain(case)[1])))


def _strain(result: xr.Dataset, case: Case, at: tuple[int, int]) -> Seeds:
    """Seeds of the strain of a bar."""
    one = _bar(result, case, at)
    rest, _ = one.strain(case)
    present = rest + one.apart
    out = np.zeros_like(_all_moved(result))
    size = np.linalg.norm(present) * np.linalg.norm(rest)
    out[at[0], one.ends[1]] = one.sign * present / size
    out[at[0], one.ends[0]] = -out[at[0], one.ends[1]]
    return {"displacement": out}


def _strain_of(result: xr.Dataset, case: Case, at: tuple[int, int]) -> Callable[[Case], float]:
    one = _bar(result, case, at)
    return lambda other: one.strain(other)[1]


class _Apart(NamedTuple):
    """The closest points of two panels in a sample, from four nodes; see `Clearance`."""

    sample: int
    nodes: NDArray  # (4,)
    weights: NDArray  # (4,)
    moved: NDArray  # (n, 3) of all nodes, m

    def vector(self, case: Case) -> NDArray:
        """Vector (3,), m, from one point to the other."""
        return self.weights @ (case.structure.nodes + self.moved)[self.nodes]

    def along(self, case: Case) -> NDArray:
        """Unit vector (3,) from one point to the other."""
        vector = self.vector(case)
        return vector / np.linalg.norm(vector)


def _closest(result: xr.Dataset, case: Case) -> list[_Apart]:
    """All closest pairs of points of panels."""
    found = measures.closest_panels(result, case)
    distance = np.array([one.distance for one in found])
    if not distance.min() > 0.0:
        raise InputError("is 0, where panels touch or cross, and a distance has no derivative")
    moved = np.zeros((1, 1, 3)) if "mode" in result.dims else _all_moved(result)
    return [
        _Apart(k, *pair, moved[k])
        for (k,) in _largest(-distance)
        for pair in zip(found[k].nodes, found[k].weights, strict=True)
    ]


def _clearance(result: xr.Dataset, case: Case, at: _Apart) -> Seeds:
    if "mode" in result.dims:
        return {}
    out = np.zeros_like(_all_moved(result))
    out[at.sample, at.nodes] = np.outer(at.weights, at.along(case))
    return {"displacement": out}


def _clearance_of(result: xr.Dataset, case: Case, at: _Apart) -> Callable[[Case], float]:
    along = at.along(case)
    return lambda other: float(along @ at.vector(other))  # signed distance: changes sign on contact


def _reaction(result: xr.Dataset, case: Case, axis: str) -> Seeds:
    """Seeds of the sum of reactions along an axis at the last step."""
    out = np.zeros((result.sizes["step"], len(case.reaction_dofs)))
    out[-1, (result["support_axis"] == axis).values] = 1.0
    return {"reaction": out}


def _strain_energies(result: xr.Dataset, case: Case) -> NDArray:
    """Strain energies of all samples, J."""
    return sum(result[name].values for name in case.energy_groups)  # type: ignore


def _tensest(result: xr.Dataset, case: Case) -> list[tuple[int, ...]]:
    return _largest(_strain_energies(result, case))


def _strain_energy(result: xr.Dataset, case: Case, at: tuple[int]) -> Seeds:
    """Seeds of the strain energy of a sample."""
    if case.swellings:
        raise InputError("has no derivative if panels are heated; leave it out")
    u, energy = _all_moved(result), _strain_energies(result, case)[at]
    if abs(_energy(case, u[at]) - energy) > TIE * energy:
        raise InputError(
            "has no derivative if damping makes turns of edges lag behind the nodes; leave out "
            'beta, or take a structure without such turns, as preset = "plate"'
        )
    out = np.zeros(u.shape)
    out[at] = _forces(case, u[at])
    return {"displacement": out}


def _strain_energy_of(result: xr.Dataset, case: Case, at: tuple[int]) -> Callable[[Case], float]:
    u = _all_moved(result)[at]
    return lambda other: _energy(other, u)


def _forces(case: Case, u: NDArray) -> NDArray:
    return case.body.internal(case.body.dofs(u))[: u.size].reshape(-1, 3)


def _energy(case: Case, u: NDArray) -> float:
    return float(case.body.energies(case.body.dofs(u)).sum())


def _limit_load(result: xr.Dataset, case: Case) -> Seeds:
    """Seeds of the load factor at the first limit point."""
    at = np.flatnonzero(result["point"].values == "limit")
    if not len(at):
        raise InputError("the path has no limit point; trace it farther, by arc_length")
    low, high = measures.intervals(result, "limit")[0]
    if high > low:
        raise InputError(
            f"the limit point is only known to lie between the load factors {low:.6g} and "
            f"{high:.6g}; trace the path with smaller steps"
        )
    return {"load_factor": _one(result.sizes["step"], int(at[0]))}


def _load_at(result: xr.Dataset, case: Case, node: int, axis: str, displacement: float) -> Any:
    return {"load_at": {(3 * node + AXES.index(axis), displacement): 1.0}}


def _climb(start: int, end: int) -> Derivative:
    """Derivative of the energy barrier on the way from one stable state to another."""

    def places(found: Landscape, case: Case) -> list[tuple[Equilibrium, Equilibrium]]:
        stable = found.stable
        if len(stable) < 2:
            raise InputError("there are no two stable states, and so no barrier between them")
        first, last = sorted(found.states.index(stable[k]) for k in (start, end))
        between = found.states[first : last + 1]
        tops = _largest(np.array([state.energy for state in between]))
        return [(between[k], stable[start]) for (k,) in tops]

    def frozen(found: Landscape, case: Case, at: Any) -> Callable[[Case], float]:
        high, low = (state.displacement for state in at)
        return lambda other: _energy(other, high) - _energy(other, low)

    def numbers(landscape: Landscape, case: Case, at: Any) -> Gradient:
        if not case.imposed_terms:
            return {}
        motion = sum(vector for vector, _ in case.imposed_terms)
        high, low = (state.stroke * _forces(case, state.displacement) for state in at)
        by_motion = case.imposed * (high - low) / np.abs(motion).max()  # as supports move farther
        return {f"imposed.{k}": by_motion for k in range(len(case.imposed_terms))}

    return Derivative(_nothing, frozen, numbers, places, cut=True)


# ------------------------------------------------------------------ measures that are differenced
def _greatest(
    name: str, found: xr.Dataset, case: Case, **chosen: int
) -> list[Callable[[xr.Dataset], float]]:
    """The largest von Mises stress, or moment of a crease, of all or of one panel or crease."""
    own = found[name].values
    owner = found["point_panel"].values[:, None] if "point" in found[name].dims else found["crease"]
    size = np.where(np.isin(owner, [*chosen.values()]) | (not chosen), np.abs(own), -1.0)
    if not size.max() > 0.0:
        raise InputError("is 0, where a size has no derivative")
    sign = np.sign(own)
    return [lambda near, at=at: float(sign[at] * near[name].values[at]) for at in _largest(size)]


def _least_margin(found: xr.Dataset, case: Case) -> list[Callable[[xr.Dataset], float]]:
    own = np.nan_to_num(margins(found)["panel_margin"].values, nan=np.inf)
    least = _largest(-own)
    return [lambda near, at=at: float(margins(near)["panel_margin"].values[at]) for at in least]


# ------------------------------------------------------------------ frequency responses
def _response(result: xr.Dataset, case: Case, node: int, axis: str, frequency: float) -> Seeds:
    k = measures.nearest_of(result, "frequency", frequency)
    return _sizes(result, node, [AXES.index(axis)], {k: 1.0})


def _sizes(result: xr.Dataset, node: int, axes: list[int], weights: Mapping[int, float]) -> Seeds:
    """Seeds of a weighted sum of a node's response magnitudes along some axes."""
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


def _peak(what: str) -> Derivative:
    """Derivative of "frequency" or "height" of the highest peak, from the samples around it."""

    def places(
        result: xr.Dataset, case: Case, node: int, axis: str | None = None
    ) -> list[tuple[int, ...]]:
        if "frequency" not in result.dims:
            raise InputError(
                "has no derivative for the spectrum of a motion; take a frequency response"
            )
        return _largest(measures.curve_of(result, node, axis)[2].height)

    def seeds(
        result: xr.Dataset, case: Case, at: tuple[int], node: int, axis: str | None = None
    ) -> Seeds:  # fmt: skip
        f, size, peaks, kind = measures.curve_of(result, node, axis)
        near = int(peaks.index[at]) + np.arange(-1, 2)
        slopes = magnitude_curve(f, size, kind).peak_slopes(int(near[1]))
        if slopes is None:
            raise InputError("the peak has not the shape of a mode; take other frequencies")
        rows = np.searchsorted(result["frequency"].values, f[near]).tolist()
        axes = list(range(len(AXES))) if axis is None else [AXES.index(axis)]
        return _sizes(result, node, axes, dict(zip(rows, getattr(slopes, what), strict=True)))

    return Derivative(seeds, places=places)


def _nothing(result: xr.Dataset, case: Case, **_: Any) -> Seeds:
    return {}


DERIVATIVES: Mapping[str, Derivative] = {
    "mass": Derivative(_nothing, numbers=lambda result, case: {"mass": np.ones(case.mass.nnz)}),
    "frequency": _of_mode("frequency"),
    "damping_ratio": _of_mode("damping_ratio"),
    "effective_mass": _of_mode("effective_mass"),
    "displacement": _of_samples(lambda result, motion: _one(len(motion), -1)),
    "displacement_at": _of_samples(
        lambda result, motion, time: _one(len(motion), measures.nearest_of(result, "time", time))
    ),
    "velocity": _of_samples(lambda result, motion: _one(len(motion), -1), "velocity"),
    "maximum": _extreme(1.0),
    "minimum": _extreme(-1.0),
    "integral": _of_samples(lambda result, motion: _trapezoid(result)),
    "mean_square": _of_samples(_mean_square),
    "largest_displacement": Derivative(_largest_displacement, places=_moved_farthest),
    "strain": Derivative(_strain, _strain_of, places=_strained_most, cut=True),
    "strain_energy": Derivative(_strain_energy, _strain_energy_of, places=_tensest, cut=True),
    "clearance": Derivative(_clearance, _clearance_of, places=_closest),
    "von_mises": Derivative(_nothing, cut=True, beside=partial(_greatest, "von_mises")),
    "crease_moment": Derivative(_nothing, cut=True, beside=partial(_greatest, "crease_moment")),
    "margin": Derivative(_nothing, cut=True, beside=_least_margin),
    **{
        name: Derivative(
            _nothing,
            beside=lambda result, case, f=one.function, **at: [partial(f, case=case, **at)],
        )
        for name, one in PROPERTIES.items()
    },
    "reaction": Derivative(_reaction),
    "limit_load": Derivative(_limit_load),
    "load_at": Derivative(_load_at),
    "response": Derivative(_response),
    "peak_frequency": _peak("frequency"),
    "peak_height": _peak("height"),
    "barrier": _climb(0, 1),
    "barrier_back": _climb(1, 0),
}
"""Derivative of each measure that has one, by the name of the measure."""


def one_number(text: str, kind: Any) -> Asked:
    """A registered measure that gives a single number for results of a kind.

    Raises
    ------
    InputError
        There is no such measure, or it is not a single number.
    """
    one = asked(text, measures.MEASURES)
    kinds = one.measure.kinds
    if kinds and kind not in kinds:
        raise InputError(f": {text} needs a result of kind {' or '.join(kinds)}, not {kind}")
    if one.measure.name == "mass" and kind == EFFECTIVE:
        raise InputError(f": {text} is that of a structure; of a cell take density")
    if one.measure.dims:
        raise InputError(f": {text} is an array; ask for one number of it, such as frequency[1]")
    return one


def derivative_of(one: Asked) -> Derivative:
    """Derivative of a measure.

    Raises
    ------
    InputError
        The measure has no derivative.
    """
    found = DERIVATIVES.get(one.measure.name)
    if found is None:
        raise InputError(
            f": {one.text} has no derivative; measures with one are {', '.join(DERIVATIVES)}. "
            'Give your own measure and its derivative, as {"tip": (function, derivative)}, or use '
            'method = "cma", which needs no derivatives'
        )
    return found
