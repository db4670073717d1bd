"""`buckling`: load factors at which a case's tangent becomes singular, and the shapes.

Linear buckling about a base state: u1 = K0^-1 p is the displacement per unit of the load factor
there, and K1 the derivative of the exact tangent along (u1, 1), as the loads and u1 grow together.
The factors f and shapes phi satisfy (K0 + f K1) phi = 0 on the free dofs, hidden dofs among them.
K1 comes from a central difference of two exact tangents, so that it has every effect of the
structure: stress, turned panels, following loads, actuated folds, temperature.

The factors are exact where u1 strains the structure, but hardly turns it, as in plates and columns
pressed in their plane. `departure` says how far the tangent is from singular at the lowest factor
once the displacement is corrected to second order: about the relative error of this factor.

Brendel and Ramm, Linear and nonlinear stability analysis of cylindrical shells, Computers and
Structures 12, 1980.
"""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn.algebra.load_factors import LoadFactors
from foldyn.algebra.solvers import check_fill
from foldyn.cases import LOADS, Case, Load
from foldyn.cases.air import refuse_air
from foldyn.errors import InputError, warn
from foldyn.linear.buckling_base import Base, PanelsBase
from foldyn.ram_limit import check_memory
from foldyn.results.dataset import buckling_dataset
from foldyn.statics.equilibrium import drives
from foldyn.statics.stability import oriented
from foldyn.values import objects, of_kind, whole

COPIES = 8  # copies of the shapes in memory, while they are found and stored
DEPARTS = 0.05  # departure from which the lowest factor is doubtful
SHARE = 0.9  # of the way to the first factor that an iteration takes
RATES = 0.25, 2.0  # at which the distance to it may fall: beside limit points, and far from any
CLOSE = 1e-4  # distance to the first factor, relative to it, at which iterations end
TURNS = np.radians(10.0)  # turn of a hinge from which displacements are not small


def buckling(
    case: Case, count: int = 6, *, preload: Load | Sequence[Load] | None = None, iterations: int = 0
) -> xarray.Dataset:
    """Load factors at which a case buckles, and the shapes, by linear buckling.

    All loads, imposed displacements, actuated creases and temperatures of the case are scaled
    together by the factor; histories and base motions are ignored. Relaxing laws with memory count
    as relaxed, with their elastic part.

    Parameters
    ----------
    case : Case
        Bars and hinges, a shell, or superelements.
    count : int
        Number of factors of each sign, from the one nearest to zero on.
    preload : Load or sequence of Load, optional
        Loads that act in full at every factor, in addition to those of the case. The base state is
        the equilibrium under them; by default rest.
    iterations : int
        How often, at most, this is repeated about states of the equilibrium path that are ever
        closer to the first positive factor, until it holds there: where the sheet turns long before
        it buckles.

    Returns
    -------
    xarray.Dataset
        Dimensions mode, node, axis; `mode` counts from 1. `load_factor`: first the positive ones,
        increasing, then the negative ones (loads reversed), from zero on; without those that take
        strains or turns of more than 10 % and are more than ten times as far from zero as the
        nearest. `shape`: the largest displacement of a node is 1, the largest component positive.
        `displacement` (m) of the base state, and `prebuckling` (m), the displacement from there per
        unit of the factor. The case of the result has the preloads first among its loads; that of
        superelements has the shell of their panels' mesh, whose nodes begin with the vertices.
        Attributes: `positive` and `negative` (numbers of factors), `complete` (number of factors
        that counts prove to be complete), `constant` (numbers of the preloads), `iterations` and
        `base_factor` (that were taken, and the load factor of the base state), and for the first
        factor `departure`, an estimate of its relative error, and `turn` (rad), the largest turn of
        a hinge or bar up to it; facts about the computation.

    Raises
    ------
    InputError
        Nothing loads the case; it can move freely; it is unstable in the base state; contact, air,
        creases that yield or creep; superlinear hinges without a slope; superelements under a
        preload, with rigid panels, or with creases at rest at other angles than the pattern's.
    ComputationError
        No equilibrium is found under the preload; the factors do not converge.

    Warns
    -----
    FoldynWarning
        Displacements are not small at the lowest factor, or the tangent is far from singular there;
        the load stiffness is not symmetric; no load factor is found.

    Examples
    --------
    >>> import foldyn as fd
    >>> pattern = fd.Pattern([(0, 0), (1, 0), (1, 0.1), (0, 0.1)], [(0, 1, 2, 3)])
    >>> strip = fd.shell(pattern, fd.Sheet(1e9, 0.0, 1e-3), divisions=16)
    >>> held = [fd.Fix("xmin", "xz", along=True), fd.Fix("xmax", "z", along=True), fd.Fix([0], "y")]
    >>> case = fd.Case(strip, held, [fd.LineLoad("xmax", (-1.0, 0, 0))])
    >>> round(float(buckling(case, 1).load_factor[0]), 3)  # Euler: pi^2 E t^3 / 12 L^2 = 0.822
    0.82
    """
    of_kind("case", case, Case)
    count = whole("count", count, least=1)
    check_memory(
        "count", f"{float(count):.3g} modes",
        8.0 * COPIES * count * case.structure.nodes.size, "take fewer",
    )  # fmt: skip
    began = time.perf_counter()
    given = [] if preload is None else [preload] if isinstance(preload, LOADS) else preload
    steady = objects("preload", given, LOADS)
    iterations = whole("iterations", iterations, least=0)
    _check(case, bool(steady), iterations)
    base = PanelsBase(case) if case.structure.linear else Base(case, steady)
    base, (positive, negative), taken = _approached(base, count, iterations)
    values = base.factor + np.concatenate([positive.values, negative.values])
    shapes = _nodal(base, np.hstack([positive.shapes, negative.shapes]))
    departure, turn = _departure(base, positive, negative)
    _warn(values, departure, turn)
    found = {
        "load_factor": values,
        "shape": shapes,
        "displacement": base.problem.displacement(base.u),
        "prebuckling": base.problem.displacement(base.slope),
    }
    statistics = {
        "count": count,
        "state": "equilibrium" if found["displacement"].any() else "rest",
        "constant": list(range(len(steady))) or None,
        "free_dofs": base.softening.size,
        "iterations": taken,
        "base_factor": base.factor,
        "positive": len(positive.values),
        "negative": len(negative.values),
        "complete": positive.complete + negative.complete,
        "departure": departure,
        "turn": turn,
        "step": base.step,
        "solver": base.backend,
        "wall_seconds": time.perf_counter() - began,
    }
    return buckling_dataset(base.case, found, statistics)


def _check(case: Case, preloaded: bool, iterations: int) -> None:
    """Refuse what has no tangent that changes linearly."""
    for name, given in (("preload", preloaded), ("iterations", iterations)):
        if case.structure.linear and given:
            raise InputError(
                f": {case.structure.linear} have load factors about rest alone; take fd.shell", name
            )
    if case.contact is not None:
        raise InputError(
            ": closes and opens, so that the tangent jumps; take the case without contact, or "
            "follow the path with fd.trace",
            "contact",
        )
    refuse_air(case, "buckling")
    case.check_movable()
    check_fill(case.structure.fill, case.body.size)
    if not drives(case, ()):
        raise InputError(
            ": nothing to scale by a factor; give the case a Force, Pressure, Gravity, Actuate, "
            "Temperature or Impose (a preload is not scaled)",
            "loads",
        )


def _approached(
    base: Base, count: int, most: int
) -> tuple[Base, tuple[LoadFactors, LoadFactors], int]:
    """The base state closest to the first factor, the factors from there, and the states tried.

    The distance f from a state to the first factor falls with the load factor, at the rate 1 before
    a bifurcation, 2 before a limit point, where the stiffness falls like a root, and less where the
    sheet stiffens: f / rate is the distance that is left.
    """
    found, taken, rate, share = base.nearest(count), 0, 1.0, SHARE
    while taken < most and len(found[0].values):
        left = float(found[0].values[0]) / rate
        if left < CLOSE * (base.factor + left):
            break
        taken += 1
        closer = base.closer(base.factor + share * left)
        if closer is None:  # past the critical point
            share *= 0.5
            continue
        there = closer.nearest(count)
        if len(there[0].values):
            fall = float(found[0].values[0] - there[0].values[0])
            rate = float(np.clip(fall / (closer.factor - base.factor), *RATES))
        base, found, share = closer, there, SHARE
    return base, found, taken


def _nodal(base: Base, free: NDArray) -> NDArray:
    """Shapes (k, n, 3) of the nodes, the largest displacement 1, from motions of the free dofs."""
    case = base.case
    shapes = base.problem.dofs(base.all_dofs(free))[: case.structure.nodes.size]
    if not shapes.shape[1]:
        return np.zeros((0, *case.structure.nodes.shape))
    shapes = oriented(shapes).T.reshape(-1, *case.structure.nodes.shape)
    sizes = np.linalg.norm(shapes, axis=2).max(axis=1)
    return shapes / np.where(sizes > 0.0, sizes, 1.0)[:, None, None]


def _departure(base: Base, positive: LoadFactors, negative: LoadFactors) -> tuple[float, float]:
    """Departure and turn (rad) at the first factor; nan without one.

    The state there is corrected to second order in the factor, with the tangent in the base state.
    Errors of the distance from there count by its share in the factor.
    """
    first = positive if len(positive.values) else negative
    if not len(first.values):
        return float("nan"), float("nan")
    factor, shape, problem = float(first.values[0]), first.shapes[:, 0], base.problem
    linear = base.u + factor * base.slope
    turn = problem.turn(base.u, linear)
    there = linear - base.moved(problem.residual(linear, base.factor + factor))
    with np.errstate(all="ignore"):
        tangent = base.tangent(there, base.factor + factor)[problem.free][:, problem.free]
        left = float(shape @ (tangent @ shape))  # shape' K0 shape is 1
    share = factor / (base.factor + factor)
    return share * left if np.isfinite(left) else float("inf"), turn


def _warn(values: NDArray, departure: float, turn: float) -> None:
    if not len(values):
        warn(
            "no load factor was found: the tangent does not soften along the linear path, whether "
            "loads are reversed or not",
            "buckling.md#when-the-factors-hold",
        )
    elif abs(departure) > DEPARTS or turn > TURNS:
        warn(
            f"at the load factor {values[0]:.4g} displacements are not small: hinges or bars turn "
            f"by up to {np.degrees(turn):.3g} degrees, and {departure:.2g} of the shape's "
            "stiffness is left where the linear path is corrected to second order: this factor may "
            "be off by as much, or mean nothing. Repeat this closer to it (iterations), or find "
            "the critical points of the path with fd.trace",
            "buckling.md#when-the-factors-hold",
        )
