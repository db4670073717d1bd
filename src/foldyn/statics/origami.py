"""A case of bars and hinges as a problem of equilibrium."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn import mechanics
from foldyn.cases import Actuate, Case
from foldyn.errors import FoldynWarning, InputError
from foldyn.mechanics import BarsHinges
from foldyn.statics.actuation import Actuation
from foldyn.statics.mixed import add_extrapolated_stress
from foldyn.statics.relief import Relief
from foldyn.statics.tolerance import EPS

FLOOR = 1e-3  # of a hinge's stiffness: its least slope in steps, as in MERLIN2
PROBE = 1e-4  # change of the load factor that gives derivatives of what is not linear in it

AdaptiveLoad = Callable[[NDArray, float], NDArray]


class OrigamiProblem:
    """Equilibrium of a case along the load factor; dof = 3 node + axis.

    Parameters
    ----------
    case : Case
        Its loads, imposed displacements and actuations are multiplied by the factor; its
        histories and motions of the base play no part.
    constant : sequence of int
        Numbers of the loads that act in full at every factor.
    rest : ndarray, shape (n, 3), optional
        Displacement (m) at which supports hold their nodes; zero unless given.
    adaptive_load : callable, optional
        Further forces (n, 3), N, from (displacement (n, 3), factor). Their stiffness is left out
        of the tangent.
    inertia_relief : bool
        Balance the loads of a free body by its inertia.

    Attributes
    ----------
    constant, growing : ndarray, shape (3n,)
        Forces (N) at every factor, and per unit of the factor.
    motion : ndarray, shape (3n,)
        Displacements (m) imposed per unit of the factor.
    actuation : Actuation
        The model at each factor.
    supported : ndarray of int
        The case's supported dofs: those held, but for the pins of inertia relief.
    """

    def __init__(
        self, case: Case, constant: Sequence[int] = (), rest: NDArray | None = None,
        adaptive_load: AdaptiveLoad | None = None, inertia_relief: bool = False,
    ) -> None:  # fmt: skip
        self.case, structure = case, case.structure
        self.structure, self._adaptive = structure, adaptive_load
        self._shape, size = structure.nodes.shape, structure.nodes.size
        self._rest = np.zeros(size) if rest is None else np.asarray(rest, float).ravel()
        self.constant = _forces(_selected(case, constant, True)).ravel()
        self.growing = _forces(_selected(case, constant, False)).ravel()
        self.motion = np.zeros(size)
        for vector, _ in case.imposed_terms:
            self.motion += vector.ravel()
        self._moves = case.imposed.ravel()
        self.actuation = Actuation(
            structure,
            _actuation(_selected(case, constant, False)),
            _actuation(_selected(case, constant, True)),
        )
        self._relief = Relief(case, self._rest) if inertia_relief else None
        pins = self._relief.pins if self._relief else np.zeros(0, np.int64)
        self.free = np.setdiff1d(case.free_dofs, pins)
        self.held = np.union1d(case.supported_dofs, pins)
        self.supported = case.supported_dofs
        self._work = mechanics.workspace(structure.model)
        self.length = float(np.linalg.norm(structure.model.rest))
        ea = structure.sheet.youngs_modulus * structure.bar_area
        nodal = np.zeros(len(structure.nodes))
        np.add.at(nodal, structure.bars, ea[:, None])
        self.force_rounding = EPS * float(np.linalg.norm(np.repeat(nodal, 3)[self.free]))

    def start(self) -> NDArray:
        """Displacements (3n,) from which the path is sought."""
        return self._rest.copy()

    def prescribed(self, factor: float) -> NDArray:
        """Displacements of held dofs: imposed ones times the factor, others where they stood."""
        return np.where(self._moves, factor * self.motion, self._rest)[self.held]

    def external(self, u: NDArray, factor: float) -> NDArray:
        """External forces (3n,), N."""
        force = self.constant + factor * self.growing
        if self._adaptive is not None:
            force = force + self._adapted(u, factor)
        if self._relief is not None:
            force = force - self._relief.inertia(u, force)
        return force

    def _adapted(self, u: NDArray, factor: float) -> NDArray:
        assert self._adaptive is not None
        added = np.asarray(self._adaptive(u.reshape(self._shape).copy(), factor), float)
        if added.shape != self._shape:
            raise InputError(
                f"adaptive_load: returned forces of shape {added.shape}, give {self._shape}"
            )
        return added.ravel()

    def internal(self, u: NDArray, factor: float) -> NDArray:
        """Internal forces (3n,), N."""
        return self._internal(self.actuation.model(factor), u)

    def residual(self, u: NDArray, factor: float) -> NDArray:
        """Internal minus external force (3n,), N."""
        return self.internal(u, factor) - self.external(u, factor)

    def tangent(self, u: NDArray, factor: float, before: NDArray | None = None) -> sparse.csr_array:
        """Tangent stiffness (3n, 3n), N/m.

        Slopes of the built-in hinge laws are raised to `FLOOR`; those of a user's own law, which
        may fall on purpose, are exact. With the state `before` the last step, the bars' stresses
        are extrapolated from there (see `statics.mixed`).
        """
        model, state = self.actuation.model(factor), u.reshape(self._shape)
        own = model.hinge_runs[:, 2] < 0
        pattern = self.structure.sparsity
        runs = model.hinge_runs
        matrix = mechanics.tangent(model._replace(hinge_runs=runs[~own]), pattern, state, FLOOR)
        if own.any():
            exact = model._replace(hinge_runs=runs[own], bar_runs=model.bar_runs[:0])
            matrix.data += mechanics.tangent(exact, pattern, state).data
        if before is not None:
            law, old = self.structure.bar_law, before.reshape(self._shape)
            add_extrapolated_stress(model, pattern, law, state, old, matrix.data)
        return matrix.tocsr()

    def rate(self, u: NDArray, factor: float) -> NDArray:
        """Derivative (3n,) of the residual with respect to the factor at fixed u."""
        if not self.actuation.acts and self._adaptive is None and self._relief is None:
            return -self.growing
        ahead, behind = self.residual(u, factor + PROBE), self.residual(u, factor - PROBE)
        return (ahead - behind) / (2.0 * PROBE)

    def reference(self, u: NDArray, factor: float) -> float:
        """Largest of the norms of the external forces and of the hinges' forces alone, N."""
        model = self.actuation.model(factor)
        hinges = self._internal(model._replace(bar_runs=model.bar_runs[:0]), u)
        external = self.external(u, factor)
        return max(float(np.linalg.norm(hinges)), float(np.linalg.norm(external)))

    def turn(self, u: NDArray, v: NDArray) -> float:
        """Largest turn (rad) of a hinge, or of a bar with the rest of it; inf on penetration."""
        structure, model = self.structure, self.structure.model
        shift = (v - u).reshape(self._shape)
        apart = np.linalg.norm(shift[structure.bars[:, 1]] - shift[structure.bars[:, 0]], axis=1)
        largest = float((apart / structure.bar_length).max(initial=0.0))
        before = mechanics.angles(model.rest + u.reshape(self._shape), model.hinges)
        after = mechanics.angles(model.rest + v.reshape(self._shape), model.hinges)
        hinges = float(np.abs(after - before).max(initial=0.0))
        if hinges > math.pi or not np.isfinite(hinges + largest):
            return math.inf
        return max(largest, hinges)

    def energies(self, u: NDArray, factor: float) -> NDArray:
        """Strain energies (J) of bars, folds and bends."""
        out = np.empty(3)
        mechanics.strain_energies(self.actuation.model(factor), u.reshape(self._shape), out)
        return out

    def actuation_rate(self, u: NDArray, factor: float) -> float:
        """Derivative (J) of the energy with respect to the factor at fixed u: by actuation."""
        if not self.actuation.acts:
            return 0.0
        ahead, behind = self.energies(u, factor + PROBE), self.energies(u, factor - PROBE)
        return float((ahead - behind)[1:].sum() / (2.0 * PROBE))

    def _internal(self, model: BarsHinges, u: NDArray) -> NDArray:
        force = np.empty(self._shape)
        state = np.ascontiguousarray(u.reshape(self._shape))
        mechanics.internal_force(model, state, force, self._work)
        return force.ravel()


def _selected(case: Case, constant: Sequence[int], inside: bool) -> Case:
    """The case with only those of its loads that are (not) constant."""
    loads = [load for i, load in enumerate(case.loads) if (i in set(constant)) == inside]
    with warnings.catch_warnings():  # they were given when the case was made
        warnings.simplefilter("ignore", FoldynWarning)
        return replace(case, loads=loads)


def _forces(case: Case) -> NDArray:
    total = np.zeros(case.structure.nodes.shape)
    for vector, _ in case.load_terms:
        total += vector
    return total


def _actuation(case: Case) -> NDArray:
    total = np.zeros(len(case.structure.folds))
    for change, _ in case.actuation_terms:
        total += change
    return total


def drives(case: Case, constant: Sequence[int]) -> bool:
    """Whether anything of a case grows with the load factor."""
    growing = any(i not in set(constant) for i in range(len(case.loads)))
    return growing or bool(case.imposed.any())


def is_actuated(case: Case) -> bool:
    """Whether a case actuates folds."""
    return any(isinstance(load, Actuate) for load in case.loads)
