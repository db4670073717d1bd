"""The energy landscape along a path of a bistable structure.

A path is read as a curve of driving force against stroke. Under forces, the driving force is the
load factor times the size of the forces, and the stroke is the mean displacement along them. With
moved supports, they are the force on the supports and the displacement of the supports. Where the
driving force vanishes, the structure is in equilibrium without it: stable where the force rises
with the stroke, unstable (the top of the barrier) where the force falls. These states, and the ends
of the ranges in which the force falls (negative stiffness), are located to round-off.

In the same way, `load_at` finds the state of a path in which a node has a given displacement.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Any, NamedTuple

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn.arguments import Unit, brief
from foldyn.cases import Case
from foldyn.errors import ComputationError, InputError
from foldyn.results import check_result
from foldyn.statics.branch import problem_of, station_of
from foldyn.statics.equilibrium import OrigamiProblem
from foldyn.statics.newton import Settings, Solver, settings_of
from foldyn.statics.stability import SHARP, LostError, Section
from foldyn.statics.stepping import Station

NO_FORCE = 1e-9  # at the ends of a path, this fraction of the largest driving force is zero


@brief
@dataclass(frozen=True, eq=False)
class Equilibrium:
    """An equilibrium without driving force.

    Attributes
    ----------
    displacement : ndarray, shape (n, 3)
        Displacement (m) of every node.
    stroke : float
        Stroke (m).
    energy : float
        Energy (J) above the first point of the landscape.
    stable : bool
        Whether the structure stays there when released.
    """

    displacement: Annotated[NDArray, Unit("m")]
    stroke: float
    energy: float
    stable: bool


@dataclass(frozen=True, eq=False, repr=False)
class Landscape:
    """Energy and force along the stroke of a path.

    Attributes
    ----------
    stroke, force, energy : ndarray, shape (steps,)
        Stroke (m), driving force (N), and energy (J) above the first point: strain energy less the
        work of constant loads.
    states : tuple of Equilibrium
        States without driving force, ordered along the path.
    negative_stiffness : tuple of (float, float)
        Ranges of the stroke (m), in the order of the path, in which the force falls.
    """

    stroke: NDArray
    force: NDArray
    energy: NDArray
    states: tuple[Equilibrium, ...]
    negative_stiffness: tuple[tuple[float, float], ...]

    def __repr__(self) -> str:
        """One line: the states, their heights and the barriers between neighboring stable ones."""
        states = ", ".join(
            f"{'stable' if one.stable else 'unstable'} at {one.stroke:.4g} m ({one.energy:.3g} J)"
            for one in self.states
        )
        barriers = ", ".join(
            f"{self.barrier(a, b):.3g} J there and {self.barrier(b, a):.3g} J back"
            for a, b in [(k, k + 1) for k in range(len(self.stable) - 1)]
        )
        ends = f"stroke {self.stroke[0]:.4g} to {self.stroke[-1]:.4g} m"
        over = f"; barriers {barriers}" if barriers else ""
        return f"<Landscape, {ends}: {states or 'no state without force'}{over}>"

    @property
    def stable(self) -> tuple[Equilibrium, ...]:
        """The stable states."""
        return tuple(state for state in self.states if state.stable)

    @property
    def first_maximum(self) -> float:
        """First maximum of the force (N), by a parabola through three points; nan if none."""
        rise = np.diff(self.force)
        tops = 1 + np.flatnonzero((rise[:-1] > 0.0) & (rise[1:] <= 0.0))
        if not len(tops):
            return np.nan
        near = slice(tops[0] - 1, tops[0] + 2)
        a, b, c = np.polyfit(self.stroke[near] - self.stroke[tops[0]], self.force[near], 2)
        return float(c - 0.25 * b * b / a)

    def barrier(self, source: int = 0, target: int = 1) -> float:
        """Energy barrier (J) from one stable state to another, given by their numbers.

        Raises
        ------
        InputError
            There is no stable state with one of these numbers.
        """
        stable = self.stable
        for number in (source, target):
            if not 0 <= number < len(stable):
                raise InputError(
                    f"barrier: the landscape has {len(stable)} stable states, there is no {number}"
                )
        places = sorted(self.states.index(stable[number]) for number in (source, target))
        between = self.states[places[0] : places[1] + 1]
        return max(state.energy for state in between) - stable[source].energy


def landscape(
    path: xarray.Dataset,
    case: Case | None = None,
    *,
    settings: Settings | Mapping[str, Any] | None = None,
) -> Landscape:
    """Energy landscape along a path that leads through the states of a bistable structure.

    Parameters
    ----------
    path : xarray.Dataset
        A path from `trace` under forces ("arc_length", "mgdcm") or with moved supports
        ("displacement"), but not both.
    case : Case, optional
        The case of the path; needed if the path cannot rebuild it (`foldyn.case_of`).
    settings : Settings or mapping, optional

    Returns
    -------
    Landscape

    Raises
    ------
    InputError
        The path is driven by folds, or by forces and moved supports together.
    ComputationError
        No state without force was found between two points of the path.
    """
    check_result(path, "path: ")
    problem = problem_of(path, case, 0)
    walker = _Walker(problem, Solver(problem, settings_of(settings)))
    stations = [station_of(walker.solver, problem, path, k) for k in range(path.sizes["step"])]
    if len(stations) < 2:
        raise InputError("path: a landscape needs at least two points")
    force = np.array([walker.force(s) for s in stations])
    stroke = np.array([walker.stroke(s) for s in stations])
    energy = np.array([walker.energy(s) for s in stations])
    none = NO_FORCE * float(np.abs(force).max())
    force[np.abs(force) <= none] = 0.0
    states, edges = [], []
    for k, station in enumerate(stations):
        if force[k] == 0.0:
            states.append(walker.state(station, energy[0]))
        if k + 1 < len(stations) and force[k] * force[k + 1] < 0.0:
            found = walker.root(walker.force, station, stations[k + 1])
            states.append(walker.state(found, energy[0]))
    sloping = [s for s in stations if s.point.kind != "bifurcation"]  # singular: slope uncertain
    falls = [walker.rigidity(s) < 0.0 for s in sloping]
    for (before, fell), (after, fall) in pairwise(zip(sloping, falls, strict=True)):
        if fell != fall:
            edges.append(walker.stroke(walker.root(walker.compliance, before, after)))
    if falls[:1] == [True]:
        edges.insert(0, float(stroke[0]))
    if len(edges) % 2:
        edges.append(float(stroke[-1]))
    ranges = tuple(zip(edges[::2], edges[1::2], strict=True))
    return Landscape(stroke, force, energy - energy[0], tuple(states), ranges)


class _Walker:
    """Driving force, stroke and energy at stations of a path."""

    def __init__(self, problem: OrigamiProblem, solver: Solver) -> None:
        self.problem, self.solver = problem, solver
        if problem.actuation.acts:
            raise InputError("path: is driven by folds; a landscape needs forces or moved supports")
        if problem.following.acts:
            raise InputError(
                "path: has loads that depend on the displacement (pressure, moments of creases); a "
                "landscape needs forces that keep their direction, or moved supports"
            )
        self.by_motion = bool(problem.motion.any())
        if self.by_motion == bool(problem.growing.any()):
            raise InputError(
                "path: is driven by forces and moved supports together, or by neither; a landscape "
                "needs one of them"
            )
        self.driver = problem.motion if self.by_motion else problem.growing
        self.size = float(np.abs(self.driver).max()) if self.by_motion else problem.load

    def force(self, station: Station) -> float:
        """Driving force, N."""
        point = station.point
        if not self.by_motion:
            return point.factor * self.size
        return float(self.driver @ self.problem.residual(point.u, point.factor)) / self.size

    def stroke(self, station: Station) -> float:
        """Stroke, m."""
        if self.by_motion:
            return station.point.factor * self.size
        return float(self.driver @ station.point.u) / self.size

    def energy(self, station: Station) -> float:
        """Strain energy less the work of constant loads, J."""
        point = station.point
        strain = float(self.problem.energies(point.u, point.factor).sum())
        return strain - float(self.problem.constant @ point.u)

    def rigidity(self, station: Station) -> float:
        """Slope of the driving force with respect to the stroke, up to a positive factor."""
        if not self.by_motion:
            return float(self.driver @ station.response)
        return float(self.driver @ (station.stiffness.matrix @ station.response))

    def compliance(self, station: Station) -> float:
        """Smooth function that vanishes where the slope changes its sign.

        Under forces, the slope (computed from the response) passes through infinity instead of
        zero; the inverse of the slope passes through zero.
        """
        value = self.rigidity(station)
        return value if self.by_motion else 1.0 / value

    def state(self, station: Station, base: float) -> Equilibrium:
        """State without force at a station."""
        if self.by_motion:
            stable = self.rigidity(station) > 0.0 and station.point.negative <= 0
        else:
            stable = station.stiffness.symmetric.negative() == 0
        displacement = self.problem.displacement(station.point.u).copy()
        energy = self.energy(station) - float(base)
        return Equilibrium(displacement, self.stroke(station), energy, stable)

    def root(self, function: Callable[[Station], float], start: Station, end: Station) -> Station:
        """Station between two others at which a function vanishes."""
        factors = f"load factors {start.point.factor:.6g} and {end.point.factor:.6g}"
        return _between(self.solver, start, end, function, f"the {factors}")


def _between(
    solver: Solver, start: Station, end: Station, function: Callable[[Station], float], ends: str
) -> Station:
    """Station between two others of a path at which a function vanishes.

    ends : the two outer stations in words, for the message if no station is found.
    """
    try:
        return Section(solver, start, end).zero(lambda mark: function(mark.station), SHARP).station
    except LostError:
        raise ComputationError(
            f"no equilibrium was found between {ends} of the path: trace it with smaller steps"
        ) from None


class Moved(NamedTuple):
    """An equilibrium on a path: displacement (n, 3), m, and load factor."""

    displacement: NDArray
    factor: float


def load_at(path: xarray.Dataset, dof: int, displacement: float, case: Case | None = None) -> Moved:
    """The first equilibrium on a path at which a node has a given displacement along an axis.

    Parameters
    ----------
    path : xarray.Dataset
        From `trace`.
    dof : int
        3 * node + axis.
    displacement : float
        Displacement along the axis, m.
    case : Case, optional
        The case of the path; needed if the path cannot rebuild it.

    Raises
    ------
    InputError
        The node never has this displacement on the path.
    ComputationError
        No equilibrium is found between two points of the path.
    """
    check_result(path, "path: ")
    moved = path["displacement"].transpose("step", "node", "axis").values
    beyond = moved.reshape(len(moved), -1)[:, dof] - displacement
    across = np.flatnonzero(beyond[:-1] * beyond[1:] <= 0.0)
    if not len(across):
        low, high = beyond.min() + displacement, beyond.max() + displacement
        raise InputError(
            f"the node moves from {low:.4g} to {high:.4g} m on the path, and not to "
            f"{displacement:.4g} m"
        )
    k = int(across[0])
    problem = problem_of(path, case, 0)
    solver = Solver(problem)
    for end in (k, k + 1):
        if beyond[end] == 0.0:
            return Moved(moved[end], float(path["load_factor"].values[end]))
    start, end = (station_of(solver, problem, path, end) for end in (k, k + 1))
    found = _between(
        solver, start, end,
        lambda station: problem.dofs(station.point.u)[dof] - displacement,
        f"the points {k} and {k + 1}",
    )  # fmt: skip
    point = found.point
    return Moved(problem.displacement(point.u).copy(), point.factor)
