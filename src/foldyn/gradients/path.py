"""Gradients through equilibria, and of functions of equilibria on a path.

An equilibrium R(u, f; p) = 0 satisfies K du = -R_p dp - R_f df. Three kinds of points remain well
defined as the parameters p change:

- a point at a given load factor, with df = 0;
- a limit point, with phi' K = 0 and so df = -phi' R_p dp / (phi' R_f);
- a point at a given nodal displacement e' u: with K mu = e, df = -mu' R_p dp / (mu' R_f).

All three need -w' R_p dp, which follows from the pullback of the forces with some weights w.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
import xarray
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from foldyn.cases import Case
from foldyn.cases.releases import refuse_releases
from foldyn.errors import ComputationError, InputError
from foldyn.gradients.parameters import Differentiated, Gradient, check_known, nothing
from foldyn.mechanics.pullback import Pullback, refuse_lacking
from foldyn.results.dataset import result_dataset
from foldyn.statics import trace
from foldyn.statics.energy_landscape import Moved, load_at
from foldyn.statics.equilibrium import OrigamiProblem
from foldyn.statics.newton import Settings, Solver
from foldyn.statics.stability import softest_modes

KNOWN = ("displacement", "reaction", "load_factor", "load_at")
GIVEN = ("newton", "displacement")
"""Methods that find the points of a path at given load factors."""
CLOSE = Settings(tolerance=1e-12)  # of states that are differenced
DENSE = 300  # up to this many dofs, the shape at a limit point is found from a dense matrix
SINGULAR = 1e-13  # a motion with less than this fraction of the largest stiffness is critical


def free_block(
    case: Case, q: NDArray, free: NDArray | None = None
) -> tuple[NDArray, sparse.csc_array]:
    """Free dofs (nf,), all by default, and the tangent (nf, nf) on them."""
    if free is None:
        free = np.concatenate([case.free_dofs, case.body.hidden])
    tangent = sparse.csr_array(case.constraints.matrix(case.body.tangent(q)))
    return free, sparse.csc_array(tangent[free][:, free])


class Balance:
    """An equilibrium (m,) of a case, and its response to forces.

    The factors of the tangent are reused for all derivatives.

    Parameters
    ----------
    case : Case
    q : ndarray, shape (m,)
    free : ndarray of int, shape (nf,), optional
        Dofs in equilibrium, by default all free dofs; all other dofs are fixed.
    """

    def __init__(self, case: Case, q: NDArray, free: NDArray | None = None) -> None:
        self.case, self.q, self._free = case, q, free

    @cached_property
    def _factors(self) -> tuple[NDArray, float, Any]:
        """Free dofs, the largest stiffness (N/m), and factors; None if the tangent is singular."""
        free, block = free_block(self.case, self.q, self._free)
        try:
            return free, float(np.abs(block).max()), splu(block)
        except RuntimeError:  # exactly singular
            return free, float(np.abs(block).max()), None

    def under(self, force: NDArray) -> NDArray:
        """Motion (m,) under a force (m,).

        Raises
        ------
        InputError
            The equilibrium is a critical point, at which such a motion does not exist.
        """
        free, stiffness, factors = self._factors
        load, out = self.case.constraints.force(force)[free], np.zeros(len(self.q))
        out[free] = np.inf if factors is None else factors.solve(load)
        met = float(np.abs(load).max(initial=0.0))
        if not met >= SINGULAR * stiffness * float(np.abs(out).max(initial=0.0)):
            raise InputError(
                "the equilibrium is a limit point or a bifurcation, where displacements have no "
                "derivative; ask for the load factor (limit_load), or take another load factor"
            )
        return self.case.constraints.displacement(out)


def seen_through(
    case: Case, q: NDArray, by_state: NDArray, adjoint: NDArray, pullback: Pullback,
    total: dict[str, NDArray], factor: float,
) -> None:  # fmt: skip
    """Add to a gradient -adjoint' dR and the effect of imposed displacements; R = F - factor p.

    by_state : derivatives (m,) of the quantity with respect to the dofs at fixed numbers.
    """
    pullback.clear()
    product = pullback.at(q, adjoint)
    for name, out in pullback.gradient.items():
        total[name] -= out
    size = case.structure.nodes.size
    for k in range(len(case.load_terms)):
        total[f"load.{k}"] += factor * adjoint[:size].reshape(-1, 3)
    moved = factor * (by_state - product)[:size].reshape(-1, 3) * case.imposed
    for k in range(len(case.imposed_terms)):
        total[f"imposed.{k}"] += moved


class PathGradient(Differentiated):
    """An equilibrium path, with gradients of functions of the points on it.

    Parameters
    ----------
    case : Case
    arguments : mapping
        Arguments of `fd.trace`.
    """

    def __init__(self, case: Case, arguments: Mapping[str, Any]) -> None:
        _refuse(case, arguments)
        self.case, self.result = case, trace(case, **arguments)
        self._given = arguments.get("method", "newton") in GIVEN
        self._pullback = Pullback(case.body)
        self._balances: dict[int, Balance] = {}

    def backward(self, seeds: Mapping[str, Any]) -> Gradient:
        """Gradient with respect to the numbers of the case.

        seeds : derivatives of the quantity with respect to variables of the result and, as
            "load_at", a mapping from (dof, displacement), with respect to load factors at given
            nodal displacements.
        """
        check_known(seeds, KNOWN, "paths")
        total = nothing(self.case, self._pullback)
        for k in range(self.result.sizes["step"]):
            self._add_point(k, seeds, total)
        for (dof, displacement), seed in seeds.get("load_at", {}).items():
            moved = load_at(self.result, dof, displacement, self.case)
            q = self.case.body.dofs(moved.displacement)
            unit = np.zeros(len(q))
            unit[dof] = 1.0
            self._add_factor(moved, Balance(self.case, q).under(unit), seed, total)
        return total

    def beside(self, case: Case) -> xarray.Dataset:
        """Path of a slightly different case, at the same load factors."""
        self._check_given(0)
        problem, moved = OrigamiProblem(case), []
        solver, factors = Solver(problem, CLOSE), self.result["load_factor"].values
        places = self.result["displacement"].transpose("step", "node", "axis").values
        for place, factor in zip(places, factors.tolist(), strict=True):
            found = solver.correct(problem.state(place, factor), factor)
            if found.failure:
                raise ComputationError(
                    f"no equilibrium near the state at the factor {factor:g}: {found.failure}"
                )
            moved.append(problem.displacement(found.u))
        along = {"load_factor": ("step", factors)}
        return result_dataset(
            "path", case, {"displacement": (("step", "node", "axis"), moved, {})}, along, {}
        )

    def _check_given(self, k: int) -> None:
        if not self._given:
            raise InputError(
                f"point {k} of the path has no given load factor, and moves along the path as the "
                'design changes: take method = "newton" or "displacement", or load_at[...]'
            )

    def _add_point(self, k: int, seeds: Mapping[str, Any], total: dict[str, NDArray]) -> None:
        """Add what a point contributes by its displacement, reactions and load factor."""
        case, result = self.case, self.result
        moved, pulled, climbed = (
            np.ravel(seeds[name][k]) if name in seeds else np.zeros(1) for name in KNOWN[:3]
        )
        u = result["displacement"].transpose("step", "node", "axis").values[k]
        factor, q = float(result["load_factor"].values[k]), case.body.dofs(u)
        if climbed.any():
            if result["point"].values[k] != "limit":
                raise InputError(
                    f"the load factor at point {k} of the path has no derivative by the design; "
                    "take the factor at a limit point, or load_at[node,axis,displacement]"
                )
            self._add_factor(Moved(u, factor), self._soft(q), float(climbed[0]), total)
        if not (moved.any() or pulled.any()):
            return
        self._check_given(k)
        by_state, weight = np.zeros((2, len(q)))
        by_state[: u.size] += moved
        if pulled.any():  # reactions are weight' R
            weight[: u.size] = case.constraints.reactions.T @ pulled
        balance = self._balances.setdefault(k, Balance(case, q))
        adjoint = balance.under(by_state + self._pullback.at(q, weight)) - weight
        seen_through(case, q, by_state, adjoint, self._pullback, total, factor)

    def _add_factor(
        self, moved: Moved, weight: NDArray, seed: float, total: dict[str, NDArray]
    ) -> None:
        """Add the derivatives of a load factor, df = -w' R_p dp / (w' R_f), times a seed."""
        case, q = self.case, self.case.body.dofs(moved.displacement)
        still = np.zeros_like(moved.displacement)
        growing = sum((vector for vector, _ in case.load_terms), still)
        motion = sum((vector for vector, _ in case.imposed_terms), still)
        rate = case.body.tangent(q)[:, : motion.size] @ motion.ravel()
        rate[: growing.size] -= growing.ravel()
        along = float(weight @ rate)
        if abs(along) <= 1e-9 * float(np.abs(weight) @ np.abs(rate)):
            raise InputError(
                "the load factor turns or branches there (a bifurcation): it has no derivative; "
                "break the symmetry by a small load or a small change of the pattern"
            )
        adjoint = seed / along * weight
        seen_through(case, q, np.zeros(len(q)), adjoint, self._pullback, total, moved.factor)

    def _soft(self, q: NDArray) -> NDArray:
        """Motion (m,) at a limit point that meets no stiffness."""
        free, block = free_block(self.case, q)
        scale = 1e-12 * float(np.abs(block.diagonal()).max())
        factors = splu(sparse.csc_array(block + scale * sparse.eye_array(block.shape[0])))
        values, shapes = softest_modes(block, factors, 1, DENSE)
        out = np.zeros(len(q))
        out[free] = shapes[:, np.abs(values).argmin()]
        return self.case.constraints.displacement(out)


def _refuse(case: Case, arguments: Mapping[str, Any]) -> None:
    """Refuse paths without derivatives, with a remedy."""
    lacks = {
        "contact": case.contact is not None,
        "creases that yield, creep or relax, and latches": bool(case.remembering),
        "folds that are actuated (Actuate, Temperature)": bool(case.rest_terms),
        "loads that depend on the displacement (Pressure, CreaseMoment), or act between the "
        "vertices of superelements": bool(case.following_terms),
        "an adaptive load": arguments.get("adaptive_load") is not None,
        "constant loads": bool(np.size(arguments.get("constant", ()))),
        "inertia relief": bool(arguments.get("inertia_relief")),
        "an initial state": arguments.get("initial") is not None,
    }
    refuse_lacking("paths", lacks)
    refuse_releases(case, "a path with gradients", "leave until out")
