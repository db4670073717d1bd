"""The case: what a solver gets, a structure with supports, loads and damping."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.cases.constraints import Constraints
from foldyn.cases.damping import Rayleigh
from foldyn.cases.history import History, as_history
from foldyn.cases.loads import LOADS, Gravity, Load
from foldyn.cases.selection import resolve_nodes
from foldyn.cases.supports import (
    AXES,
    SUPPORTS,
    BaseMotion,
    Fix,
    Impose,
    Link,
    Support,
    unit_vector,
)
from foldyn.cases.ties import equations_of, values_of
from foldyn.errors import Faults, InputError
from foldyn.mechanics.body import Body
from foldyn.structures.discretized import read_only
from foldyn.values import brief, show

Terms = tuple[tuple[NDArray[np.float64], History], ...]
Summands = Iterable[tuple[NDArray[np.float64], Any]]


@brief
@dataclass(frozen=True, eq=False)
class Case:
    """A structure with supports, loads and damping.

    Parameters
    ----------
    structure : Structure
        The discretized pattern.
    supports : sequence of Fix, Impose, BaseMotion and Link
        Nodes held at rest or moved as prescribed, motions of the base, and nodes tied together;
        none by default (free motion is legal in dynamics).
    loads : sequence of Force, Gravity and Actuate
        Forces, gravity and creases that fold by themselves; none by default.
    damping : Rayleigh
        Damping; none by default.

    Attributes
    ----------
    fixed : ndarray of bool, shape (n, 3)
        True where a node is held along an axis, by `Fix` or by `Impose`.
    imposed : ndarray of bool, shape (n, 3)
        True where an `Impose` moves a node along an axis.
    constraints : Constraints
        What ties displacements together: directions that are held, links, rigid panels.
    free_dofs, supported_dofs : ndarray of int64
        Numbers 3 * node + axis of the free ones, on which all others depend, and of the held ones,
        increasing.
    reaction_dofs : ndarray of int64
        The held ones and those on which supports act along a direction, increasing.
    load_terms : tuple of (ndarray of shape (n, 3), History)
        Forces (N) on all nodes with their history; loads with equal histories are one term.
        Forces on held nodes are kept: the reactions carry them.
    force_terms : tuple of (ndarray of shape (n, 3), History)
        The same of the forces on nodes alone, without gravity.
    gravity_terms : tuple of (ndarray of shape (3,), History)
        Accelerations of gravity (m/s2) with their history.
    imposed_terms : tuple of (ndarray of shape (n, 3), History)
        Displacements (m) at factor 1 of the imposed dofs and of those that constraints tie to
        them, zero elsewhere, with their history; equal histories are one term.
    base_terms : tuple of (ndarray of shape (n, 3), History)
        The same of the dofs that `Fix` holds along the axis of a `BaseMotion`, from where they
        stand at the start of the motion.
    actuation_terms : tuple of (ndarray of shape (nf,), History)
        Changes (rad) of the rest angles of the folds at factor 1, zero elsewhere, with their
        history; equal histories are one term.

    Raises
    ------
    InputError
        A node or crease is out of range; a dof is held and imposed, or imposed twice; a base
        motion has no support to move; a crease is actuated twice; a force acts on held axes only;
        or gravity meets a structure whose mass is not known.

    Warns
    -----
    FoldynWarning
        A force acts on held axes in part.
    """

    structure: Any
    supports: Sequence[Support] = ()
    loads: Sequence[Load] = ()
    damping: Rayleigh = field(default_factory=Rayleigh)

    def __post_init__(self) -> None:
        """Check the arguments."""
        for name, kinds in (("supports", SUPPORTS), ("loads", LOADS)):
            object.__setattr__(self, name, _tuple_of(name, kinds, getattr(self, name)))
        if not isinstance(self.damping, Rayleigh):
            raise InputError(
                f"damping = {show(self.damping)}: must be Rayleigh(alpha=..., beta=...)"
            )
        self._check_selections()
        _ = self.base_terms, self.actuation_terms  # check the supports and the creases
        if self.constraints:
            _ = self.imposed_terms
        for place, load in self._loads():
            load.check(self.structure, self.fixed, place)

    def _check_selections(self) -> None:
        """Refuse nodes and creases that are not there, all at once."""
        faults = Faults()
        for place, support in self._supports(Fix, Impose, Link):
            with faults.collected():
                self._nodes_of(place, support)
        for place, load in self._loads():
            with faults.collected():
                load.loaded(self.structure, place)
            with faults.collected():
                load.rest_changes(self.structure, place)
        faults.tell()

    @property
    def body(self) -> Body:
        """What solvers take: the structure with what the case adds to its stiffness."""
        return self.structure.body

    @property
    def energy_groups(self) -> Mapping[str, str]:
        """Parts of its strain energy, and what they are."""
        return self.structure.energy_groups

    @property
    def mass(self) -> sparse.csr_array:
        """Nodal mass matrix (n, n), kg: the structure's with what the case adds to it."""
        return self.structure.mass

    @property
    def nodal_mass(self) -> NDArray[np.float64]:
        """Mass (n,) that moves with each node: the sums of the rows of `mass`, kg."""
        return self.structure.nodal_mass

    @cached_property
    def fixed(self) -> NDArray[np.bool_]:
        """Whether each node is held along each axis, by Fix or Impose, shape (n, 3)."""
        return read_only(self.imposed | self._held)

    @cached_property
    def imposed(self) -> NDArray[np.bool_]:
        """Whether an Impose moves each node along each axis, shape (n, 3)."""
        mask = np.zeros((len(self.structure.nodes), 3), dtype=bool)
        for place, support in self._supports(Impose):
            if support.axis is None:
                continue
            nodes, axis = self._nodes_of(place, support), AXES.index(support.axis)
            for taken, both in ((self._held, "held and imposed"), (mask, "imposed twice")):
                twice = nodes[taken[nodes, axis]]
                if twice.size:
                    raise InputError(
                        f"{place}: node {twice[0]} is {both} along {support.axis}, a "
                        "contradictory support; leave out one of the two"
                    )
            mask[nodes, axis] = True
        return read_only(mask)

    @cached_property
    def _held(self) -> NDArray[np.bool_]:
        """Whether a Fix holds each node along each axis, shape (n, 3)."""
        mask = np.zeros((len(self.structure.nodes), 3), dtype=bool)
        for place, support in self._supports(Fix):
            nodes = self._nodes_of(place, support)
            for axis in support.axes or "":
                mask[nodes, AXES.index(axis)] = True
        return mask

    def _nodes_of(self, place: str, support: Any) -> NDArray[np.int64]:
        return resolve_nodes(self.structure, support.nodes, f"{place}.nodes")

    @cached_property
    def constraints(self) -> Constraints:
        """What ties displacements together: directions that are held, links, rigid panels."""
        equations = equations_of(self.structure, self._supports(Fix, Impose, Link))
        return Constraints(equations, self.fixed.ravel())

    @property
    def free_dofs(self) -> NDArray[np.int64]:
        """Numbers 3 * node + axis that are free, increasing; all others depend on them."""
        return self.constraints.free

    @property
    def imposed_slaves(self) -> NDArray[np.int64]:
        """Numbers of the dofs that `Impose` along a direction moves with others of their nodes."""
        return self.constraints.slaves_of([place for place, _ in self._supports(Impose)])

    @property
    def reaction_dofs(self) -> NDArray[np.int64]:
        """Numbers 3 * node + axis on which supports exert forces, increasing."""
        return self.constraints.supported

    @cached_property
    def supported_dofs(self) -> NDArray[np.int64]:
        """Numbers 3 * node + axis that are held, increasing."""
        return np.flatnonzero(self.fixed.ravel()).astype(np.int64)

    @cached_property
    def imposed_terms(self) -> Terms:
        """Displacements (m) of imposed dofs at factor 1, shape (n, 3), each with its history."""
        return _summed(self._imposed())

    def _imposed(self) -> Summands:
        for place, support in self._supports(Impose):
            vector = np.zeros((len(self.structure.nodes), 3))
            if support.axis is not None:
                vector[self._nodes_of(place, support), AXES.index(support.axis)] = support.value
            yield self._tied(vector, place, {place: support.value}), support.history

    @cached_property
    def prescribed_terms(self) -> Terms:
        """What each `Impose` says, alone, along its axis or direction: (n, 3), m, with history."""
        return _summed(self._prescribed()) if self.constraints else self.imposed_terms

    def _prescribed(self) -> Summands:
        for place, support in self._supports(Impose):
            vector = np.zeros((len(self.structure.nodes), 3))
            along = np.multiply.outer(support.value, unit_vector(support.direction or support.axis))
            vector[self._nodes_of(place, support)] = along
            yield vector, support.history

    def _tied(self, shape: NDArray, place: str, values: Mapping[str, Any]) -> NDArray:
        """Displacements (n, 3), m, when supports move as in a shape and by values along theirs."""
        ties = self.constraints
        return ties.moved(shape, values_of(ties.owners, values), place) if ties else shape

    @cached_property
    def base_terms(self) -> Terms:
        """Displacements (m) of the base at factor 1, shape (n, 3), each with its history."""
        return _summed(self._moved_by_the_base())

    def _moved_by_the_base(self) -> Summands:
        base = self.fixed & ~self.imposed
        for place, support in self._supports(BaseMotion):
            axis = AXES.index(support.axis)
            along = {
                where: support.value * unit_vector(other.direction)[axis]
                for where, other in self._supports(Fix)
                if other.direction is not None
            }
            if not base[:, axis].any() and not any(along.values()):
                raise InputError(
                    f"{place}: the base moves along {support.axis}, but no support holds a "
                    f'node along {support.axis}; add one with axes = "{support.axis}", or leave '
                    "out the base motion"
                )
            vector = np.zeros(base.shape)
            vector[base[:, axis], axis] = support.value
            yield self._tied(vector, place, along), support.history

    @cached_property
    def actuation_terms(self) -> Terms:
        """Changes (rad) of the folds' rest angles at factor 1, shape (nf,), with their history."""
        return _summed(self._actuated())

    def _actuated(self) -> Summands:
        first: dict[int, str] = {}  # the load that actuates a crease
        for place, load in self._loads():
            actuated = load.rest_changes(self.structure, place)
            if actuated is None:
                continue
            creases, change = actuated
            for crease in creases.tolist():
                if crease in first:
                    raise InputError(
                        f"{place}.creases: crease {crease} is actuated by {first[crease]} already; "
                        "leave it out of one of the two"
                    )
                first[crease] = place
            vector = np.zeros(len(self.structure.folds))
            vector[creases] = change
            yield vector, load.history

    @cached_property
    def load_terms(self) -> Terms:
        """Forces (N) on all nodes, shape (n, 3), each with its history."""
        return _summed(self._forces(self._loads()))

    @cached_property
    def force_terms(self) -> Terms:
        """The terms of `load_terms` without gravity."""
        return _summed(self._forces(pair for pair in self._loads() if pair[1].arrows))

    def _forces(self, loads: Iterable[tuple[str, Load]]) -> Summands:
        for place, load in loads:
            forces = load.forces(self.structure, place)
            if forces is not None:
                yield forces, load.history

    @cached_property
    def gravity_terms(self) -> Terms:
        """Accelerations of gravity (m/s2), shape (3,), each with its history."""
        gravity = (load for load in self.loads if isinstance(load, Gravity))
        return _summed((np.array(load.acceleration), load.history) for load in gravity)

    @cached_property
    def loaded_nodes(self) -> NDArray[np.int64]:
        """Nodes on which a force acts, increasing; gravity, which acts on all, does not count."""
        return _union([load.loaded(self.structure, place) for place, load in self._loads()])

    @cached_property
    def actuated_creases(self) -> NDArray[np.int64]:
        """Creases that a load actuates, increasing."""
        pairs = [load.rest_changes(self.structure, place) for place, load in self._loads()]
        return _union([pair[0] for pair in pairs if pair is not None])

    def _supports(self, *kinds: type) -> Iterator[tuple[str, Any]]:
        """Supports of some kinds, with their places for messages."""
        places = ((f"supports[{i}]", support) for i, support in enumerate(self.supports))
        return ((place, support) for place, support in places if isinstance(support, kinds))

    def _loads(self) -> Iterator[tuple[str, Load]]:
        """Loads with their places for messages."""
        return ((f"loads[{i}]", load) for i, load in enumerate(self.loads))


def _union(numbers: Sequence[NDArray[np.int64]]) -> NDArray[np.int64]:
    return np.unique(np.concatenate([np.zeros(0, np.int64), *numbers]))


def _summed(parts: Summands) -> Terms:
    """Vectors with their histories, those with equal histories added."""
    terms: list[tuple[NDArray[np.float64], History]] = []
    for vector, given in parts:
        history = as_history(given)
        same = next((total for total, other in terms if other == history), None)
        if same is None:
            terms.append((vector, history))
        else:
            same += vector
    return tuple((read_only(vector), history) for vector, history in terms)


def _tuple_of(name: str, kinds: tuple[type, ...], given: Any) -> tuple:
    listed = " or ".join(kind.__name__ for kind in kinds)
    if isinstance(given, str) or not isinstance(given, Sequence):
        raise InputError(f"{name} = {show(given)}: must be a list of {listed}")
    for i, item in enumerate(given):
        if not isinstance(item, kinds):
            raise InputError(f"{name}[{i}] = {show(item)}: must be a {listed}")
    return tuple(given)
