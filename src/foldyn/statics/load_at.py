"""The equilibrium on a path at which a node has moved by a given displacement."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.errors import ComputationError, InputError
from foldyn.results import check_result
from foldyn.statics.branch import problem_of, station_of
from foldyn.statics.newton import Solver
from foldyn.statics.stability import LostError, Section

if TYPE_CHECKING:
    import xarray

SHARP = 1e-13  # share of a step to which the point is located


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
    ends = (station_of(solver, problem, path, end) for end in (k, k + 1))
    try:
        found = Section(solver, *ends).zero(
            lambda mark: problem.dofs(mark.station.point.u)[dof] - displacement, SHARP
        )
    except LostError:
        raise ComputationError(
            f"no equilibrium was found between the points {k} and {k + 1} of the path: trace it "
            "with smaller steps"
        ) from None
    point = found.station.point
    return Moved(problem.displacement(point.u).copy(), point.factor)
