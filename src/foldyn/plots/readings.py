"""Data for figures and pages from their arguments, without drawing: cases, nodes, energies."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial, wraps
from inspect import signature
from itertools import pairwise
from typing import Any, Concatenate, NamedTuple, ParamSpec, Protocol, TypeVar, overload

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.cases.directions import signed
from foldyn.errors import InputError
from foldyn.linear.frf import PER_FORCE, quantity_of
from foldyn.mechanics.contact.term import GROUP as CONTACT
from foldyn.mechanics.springs import GROUP
from foldyn.patterns.palette import BLUE, GRAY, GREEN, PURPLE, SKY, VERMILLION
from foldyn.results.contents import nodes_of
from foldyn.results.quantities import RESPONSES
from foldyn.structures import Structure
from foldyn.values import choice, show

P = ParamSpec("P")
R = TypeVar("R", covariant=True)


def by_label(field: str, results: xr.Dataset | Mapping[str, xr.Dataset]) -> dict[str, xr.Dataset]:
    """Results by label; a single result has the label ""."""
    if isinstance(results, xr.Dataset):
        return {"": results}
    if not isinstance(results, Mapping) or not results:
        raise InputError(
            ": give a result, or a mapping of label to result, as {'specimen': result}", field
        )
    return {label: alone(f"{field}[{label!r}]", one) for label, one in results.items()}


def alone(field: str, result: Any) -> xr.Dataset:
    """Return a result; refuse anything else."""
    if not isinstance(result, xr.Dataset):
        raise InputError(f" = {show(result)}: give a result, as fd.load returns it", field)
    return result


class OfResult(Protocol[P, R]):
    """A function that draws a result, called with its case or without it."""

    @overload
    def __call__(
        self, case_or_structure: Case | Structure, result: xr.Dataset, /,
        *args: P.args, **kwargs: P.kwargs,
    ) -> R: ...  # fmt: skip

    @overload
    def __call__(self, result: xr.Dataset, /, *args: P.args, **kwargs: P.kwargs) -> R: ...


def case_from_result(
    draw: Callable[Concatenate[Case | Structure, xr.Dataset, P], R],
) -> OfResult[P, R]:
    """Make a figure take the case from its result if no case is given."""
    case, result, *others = signature(draw).parameters

    @wraps(draw)
    def drawn(*given: Any, **named: Any) -> Any:
        first = given[0] if given else named.get(result)
        if isinstance(first, xr.Dataset) and case not in named:
            named |= zip(others, given[1:], strict=False)  # positional arguments move up by one
            given = (first, first) if given else (first,)
        return draw(*given, **named)

    return drawn


AXES = ("x", "y", "z")
# Kinds of points marked in figures, and their names.
CRITICAL = {"limit": "limit point", "bifurcation": "bifurcation"}


def check_nodes_of(
    results: Mapping[str, xr.Dataset], nodes: int | str | Sequence[int]
) -> list[int]:
    """Return nodes as a list; a selection applies to the first pattern. Refuse unknown nodes."""
    for label, result in results.items():
        nodes = nodes_of(result, nodes, repr(label) if label else "the result")
    return list(nodes)  # pyright: ignore[reportArgumentType]


def directions(
    axes: str | Sequence[str] | None,
    count: int,
    moved: Iterable[NDArray],
    known: Sequence[str] = AXES,
) -> list[str]:
    """One direction for each node, by default the direction in which the node moves most.

    Parameters
    ----------
    axes : str, sequence of str, or None
        As given by the user.
    count : int
        Number of nodes.
    moved : iterable of ndarray, shape (samples, count, 3)
        Displacements that are shown, for each result; used only if no axes are given.
    """
    if axes is None:
        largest = np.max([np.abs(values).max(axis=0) for values in moved], axis=0)
        return [AXES[k] for k in largest.argmax(axis=1)]
    chosen = [axes] if isinstance(axes, str) else list(axes)
    for direction in chosen:
        choice("axes", direction, known)
    if len(chosen) == 1:
        return chosen * count
    if len(chosen) != count:
        raise InputError(f"axes: {len(chosen)} directions for {count} nodes; give one, or one each")
    return chosen


def check_path(path: xr.Dataset, name: str) -> None:
    """Refuse anything that is not a path, and paths with NaN."""
    alone(name, path)
    missing = [key for key in ("displacement", "load_factor", "point") if key not in path]
    if missing or "step" not in path.sizes:
        raise InputError(f"{name}: is not a path of fd.trace; it has no {missing or ['step']}")
    if not np.isfinite(path["displacement"].values).all():
        raise InputError(f"{name}: its displacement contains NaN or infinity")


def critical_word(path: xr.Dataset, number: int) -> str:
    """Word for a critical point, with its interval of load factors if it could not be located."""
    word = CRITICAL.get(str(path["point"].values[number]), "")
    if is_loose(path)[number]:
        low, high = path["interval"].transpose("step", "end").values[number]
        word += f" between {low:.4g} and {high:.4g}"
    return word


def is_loose(path: xr.Dataset) -> NDArray[np.bool_]:
    """Mark the points of a path that stand for critical points that could not be located."""
    if "interval" not in path:
        return np.zeros(path.sizes["step"], bool)
    return np.ptp(path["interval"].transpose("step", "end").values, axis=1) > 0.0


def displacements(result: xr.Dataset, dimension: str = "step") -> NDArray[np.float64]:
    """Displacements (m) of all nodes at each point or time, shape (m, n, 3)."""
    return result["displacement"].transpose(dimension, "node", "axis").values


def way(path: xr.Dataset) -> NDArray[np.float64]:
    """Mean distance (m) that the nodes have traveled up to each point; it never decreases."""
    steps = np.sqrt((np.diff(displacements(path), axis=0) ** 2).sum(axis=2).mean(axis=1))
    return np.concatenate([[0.0], np.cumsum(steps)])


def evenly(path: xr.Dataset, count: int) -> list[int]:
    """Numbers of `count` points evenly spread over the distance `way`, first and last included."""
    length = way(path)
    wanted = np.linspace(0.0, length[-1], count) if count > 1 else length[-1:]
    return np.unique(np.abs(length[:, None] - wanted).argmin(axis=0)).tolist()


class Stretch(NamedTuple):
    """Points from `start` to `stop` (inclusive) of a path, all stable or all unstable."""

    start: int
    stop: int
    stable: bool


def stretches(path: xr.Dataset) -> list[Stretch]:
    """Stable and unstable stretches of the path.

    A stretch between two points is unstable if the tangent has a negative eigenvalue at either
    point; a critical point counts as its more stable side. If negative eigenvalues were not
    counted, everything counts as stable.
    """
    negative = path["negative_eigenvalues"].values
    stable = np.maximum(negative[:-1], negative[1:]) <= 0
    bounds = [0, *(np.flatnonzero(stable[1:] != stable[:-1]) + 1).tolist(), len(stable)]
    ends = [(start, stop) for start, stop in pairwise(bounds) if start < stop]
    return [Stretch(start, stop, bool(stable[start])) for start, stop in ends]


def along(path: xr.Dataset, nodes: Sequence[int], direction: str) -> NDArray[np.float64]:
    """Mean displacement (m) of nodes in a direction at each point."""
    axis, sign = signed("direction", direction)
    moved = path["displacement"].sel(node=list(nodes), axis=AXES[axis])
    return sign * moved.mean("node").values + 0.0  # avoid -0


def farthest(moved: NDArray[np.float64]) -> tuple[float, str]:
    """Largest component of displacements (..., 3), and its direction."""
    place = np.unravel_index(np.abs(moved).argmax(), moved.shape)
    extreme = float(moved[place])
    return extreme, ("-" if extreme < 0.0 else "") + AXES[place[-1]]


def main_direction(paths: Mapping[str, xr.Dataset], nodes: Sequence[int]) -> str:
    """Direction in which nodes move farthest."""
    moved = [displacements(path[["displacement"]].sel(node=list(nodes))) for path in paths.values()]
    return farthest(np.concatenate(moved))[1]


def asked(
    paths: Mapping[str, xr.Dataset], nodes: int | str | Sequence[int], direction: str | None
) -> tuple[list[int], str]:
    """Nodes that all paths have, and a direction, by default the one of their largest motion.

    Raises
    ------
    InputError
        The results are not paths, there is no node, or a path lacks a node.
    """
    for label, path in paths.items():
        check_path(path, f"paths[{label!r}]" if label else "path")
    numbers = check_nodes_of(paths, nodes)
    return numbers, main_direction(paths, numbers) if direction is None else direction


# Names and colors of strain energies in stacking order from the bottom up: folds are on top.
STRAIN: Mapping[str, tuple[str, str]] = {
    "strain_bars": ("bars", VERMILLION),
    "strain_membrane": ("membrane", VERMILLION),
    "strain_panels": ("panels", VERMILLION),
    "strain_bends": ("bends", PURPLE),
    "strain_bending": ("bending", PURPLE),
    "strain_folds": ("folds", GREEN),
    GROUP: ("springs", SKY),
    CONTACT: ("contact", BLUE),
}
MOST_MODES = 12
# Variables of modes that figures need.
NEEDED = {
    "modes": ("frequency", "eigenvalue", "shape", "rigid", "displacement"),
    "buckling": ("load_factor", "shape", "displacement"),
}
_NONE = 1e-9  # below this energy, relative to the largest, shares are undefined


def moved_supports(case: Case) -> tuple[list[int], str] | None:
    """Nodes that supports move farthest (all equally), and the direction; None if none moves."""
    motion = sum((vector for vector, _ in case.prescribed_terms), np.zeros(case.imposed.shape))
    if not motion.any():
        return None
    largest, direction = farthest(motion)
    moved = motion[:, signed("direction", direction)[0]]
    return np.flatnonzero(np.isclose(moved, largest, rtol=1e-9, atol=0.0)).tolist(), direction


def total_reaction(
    path: xr.Dataset, nodes: Sequence[int], *, direction: str
) -> NDArray[np.float64]:
    """Sum of the forces of supports on nodes in a direction.

    Parameters
    ----------
    path : xarray.Dataset
        A path of `foldyn.trace`.
    nodes : sequence of int
    direction : {"x", "y", "z", "-x", "-y", "-z"}

    Returns
    -------
    ndarray, shape (steps,)
        The sum (N) at each point.

    Raises
    ------
    InputError
        A node is not supported along the direction.
    """
    check_path(path, "path")
    _, sign = signed("direction", direction)
    axis = direction[-1]
    chosen = path["support_node"].isin(list(nodes)) & (path["support_axis"] == axis)
    loose = sorted(set(nodes) - set(path["support_node"].values[chosen.values].tolist()))
    if loose:
        raise InputError(f"nodes: no support holds node {loose[0]} along {axis}")
    return sign * path["reaction"].values[:, chosen.values].sum(axis=1) + 0.0  # avoid -0


def chosen_points(path: xr.Dataset, points: int | Sequence[int]) -> list[int]:
    """Numbers of points, from 0: as many as asked for, or given numbers, negative from the end."""
    check_path(path, "path")
    return chosen("points", points, path.sizes["step"], partial(evenly, path))


def chosen(
    field: str, wanted: int | Sequence[int], count: int, spread: Callable[[int], list[int]]
) -> list[int]:
    """Numbers of states: as many as asked for, evenly spread, or given numbers."""
    if isinstance(wanted, int | np.integer):
        if wanted < 1:
            raise InputError(f"{field}: {wanted}; give at least one")
        return spread(int(wanted))
    for number in wanted:
        if not -count <= number < count:
            raise InputError(f"{field}: {number}; there are {field} 0 to {count - 1}")
    if not len(wanted):
        raise InputError(f"{field}: empty; give at least one")
    return [int(number) % count for number in wanted]


def parts_of(result: xr.Dataset) -> tuple[str, ...]:
    """Names of the strain energies of a result, in the order of its structure."""
    names = map(str, result.data_vars)
    return tuple(name for name in names if name.startswith("strain_") or name == CONTACT)


def strain_name(part: str) -> str:
    """Name of a strain energy in words."""
    own = part.removeprefix("strain_").replace("_", " ")
    return STRAIN.get(part, (own, ""))[0]


def strain_color(part: str) -> str:
    """Color of a part of the strain energy."""
    return STRAIN.get(part, ("", GRAY))[1]


def stacked(path: xr.Dataset) -> dict[str, NDArray[np.float64]]:
    """Return the strain energies (J) in stacking order."""
    parts = parts_of(path)
    order = [*(part for part in STRAIN if part in parts), *(p for p in parts if p not in STRAIN)]
    return {part: path[part].values for part in order}


def energy_shares(path: xr.Dataset) -> dict[str, NDArray[np.float64]]:
    """Share of each strain energy at each point; NaN where the total vanishes.

    Parameters
    ----------
    path : xarray.Dataset
        A path of `foldyn.trace`.

    Returns
    -------
    dict of str to ndarray, shape (steps,)
        Shares from 0 to 1 of "bars", "bends" and "folds", or for a shell "membrane", "bending" and
        "folds", and of "springs" if the structure has any.
    """
    check_path(path, "path")
    energies = stacked(path)
    total = np.asarray(sum(energies.values()))
    total = np.where(total > _NONE * max(float(total.max(initial=0.0)), 0.0), total, np.nan)
    return {strain_name(part): energy / total for part, energy in energies.items()}


def chosen_modes(
    modes: xr.Dataset, which: Sequence[int] | int | None, field: str = "modes"
) -> list[int]:
    """Numbers of the modes to show: as asked for, or the first modes that are not rigid.

    which : numbers of modes, or how many.
    field : "modes", or "buckling" for its shapes.
    """
    missing = [key for key in NEEDED[field] if key not in modes]
    if missing:
        raise InputError(f"{field}: has no {missing[0]}; give a result of fd.{field}")
    stored = modes["mode"].values
    if not stored.size:
        raise InputError(f"{field}: found none, so that there is no shape to draw")
    if which is None or isinstance(which, int):
        elastic = stored[~modes["rigid"].values.astype(bool)] if "rigid" in modes else stored
        return (elastic if elastic.size else stored)[: which or MOST_MODES].tolist()
    numbers = [int(number) for number in which]
    if not numbers:
        raise InputError("which: empty; give the number of at least one mode")
    if len(numbers) > MOST_MODES:
        raise InputError(f"which: {len(numbers)} modes; one figure shows at most {MOST_MODES}")
    for number in numbers:
        if number not in stored:
            raise InputError(f"which: {number}; there are modes {stored[0]} to {stored[-1]}")
    return numbers


def along_drive(response: xr.Dataset) -> list[str]:
    """Each axis with the sign of the driving forces along it; positive if there are none."""
    forces = response["drive"].transpose("node", "axis").values.sum(axis=0)
    backward = (forces < 0.0) & (quantity_of(response) in PER_FORCE)
    return ["-" + axis if back else axis for axis, back in zip(AXES, backward, strict=True)]


def unit_of(quantity: str) -> str:
    """Unit of a quantity in parentheses, for an axis title; empty if dimensionless."""
    unit = RESPONSES[quantity].units.replace("s2", "s²")
    return "" if unit == "1" else f" ({unit})"
