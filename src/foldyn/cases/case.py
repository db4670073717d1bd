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
from foldyn.cases.damped import Damped
from foldyn.cases.damping import Damping, Rayleigh, dampings
from foldyn.cases.history import History, as_history
from foldyn.cases.loads import LOADS, Gravity, Load
from foldyn.cases.masses import PointMass, nodal_masses
from foldyn.cases.selection import resolve_nodes
from foldyn.cases.springs import packed
from foldyn.cases.straight import Straight
from foldyn.cases.supports import (
    AXES,
    SUPPORTS,
    BaseMotion,
    Fix,
    Impose,
    Link,
    Spring,
    Support,
    unit_vector,
)
from foldyn.cases.ties import equations_of, values_of
from foldyn.errors import Faults, InputError, within
from foldyn.mechanics.attached import Springs
from foldyn.mechanics.attached_body import GROUP, attached
from foldyn.mechanics.body import Body
from foldyn.mechanics.following import Following
from foldyn.structures.discretized import read_only
from foldyn.structures.mass import center_of_mass, inertia_tensor, row_sums
from foldyn.values import brief, show

Terms = tuple[tuple[NDArray[np.float64], History], ...]
Summands = Iterable[tuple[NDArray[np.float64], Any]]


@brief
@dataclass(frozen=True, eq=False)
class Case(Damped):
    """A structure with supports, loads and damping.

    Parameters
    ----------
    structure : Structure
        The discretized pattern.
    supports : sequence of Fix, Impose, BaseMotion and the other kinds of `SUPPORTS`
        Nodes held at rest, moved as prescribed, tied together, held by springs or damped, and
        motions of the base; none by default (free motion is legal in dynamics).
    loads : sequence of Force, Gravity, Actuate and the other kinds of `LOADS`
        Forces, gravity, pressure, creases that fold by themselves; none by default.
    damping : Rayleigh, ModalDamping, CreaseDamping, or a sequence of them
        Damping; none by default. Several add up.
    masses : sequence of PointMass
        What nodes carry beside the mass of the sheet; none by default.

    Attributes
    ----------
    rayleigh, modal_damping, crease_damping, dashpots, damped
        See `Damped`.
    fixed : ndarray of bool, shape (n, 3)
        True where a node is held along an axis, by `Fix` or by `Impose`. Points of a mesh between
        the ends of a clamped edge are held where both ends are.
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
    following_terms : tuple of (Following, History)
        Forces that depend on the displacement, one term for each load that has them.
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
    rest_terms : tuple of (ndarray of shape (nr,), History)
        The same of all rest angles (`body.rest_angles`: folds first), whatever changes them.

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
    damping: Damping | Sequence[Damping] = field(default_factory=Rayleigh)
    masses: Sequence[PointMass] = ()

    def __post_init__(self) -> None:
        """Check the arguments."""
        for name, kinds in (("supports", SUPPORTS), ("loads", LOADS), ("masses", (PointMass,))):
            object.__setattr__(self, name, _tuple_of(name, kinds, getattr(self, name)))
        object.__setattr__(self, "damping", dampings(self.damping))
        self._check_selections()
        _ = self.base_terms, self.actuation_terms  # check the supports and the creases
        if self.constraints:
            _ = self.imposed_terms
        for place, load in self._loads():
            load.check(self.structure, self.fixed, place)
            if isinstance(load, Gravity):
                with within(f"{place}: gravity needs the mass of the structure: "):
                    _ = self.mass

    def _check_selections(self) -> None:
        """Refuse nodes and creases that are not there, all at once."""
        faults = Faults()
        for place, support in self._supports(Fix, Impose, Link):
            with faults.collected():
                self._nodes_of(place, support)
        self._check_damping(faults)
        for name in ("springs", "point_masses"):
            with faults.collected():
                getattr(self, name)
        for place, load in self._loads():
            with faults.collected():
                load.loaded(self.structure, place)
            with faults.collected():
                load.rest_changes(self.structure, place)
            with faults.collected():
                load.following(self.structure, place)
        faults.tell()

    @cached_property
    def body(self) -> Body:
        """What solvers take: the structure with what the case adds to its stiffness."""
        body = self.structure.body
        return body if self.springs is None else attached(body, springs=self.springs)

    @cached_property
    def springs(self) -> Springs | None:
        """Its springs as arrays; None without any."""
        parts = list(self._supports(Spring))
        return packed(parts, self.structure) if parts else None

    @property
    def energy_groups(self) -> Mapping[str, str]:
        """Parts of its strain energy, and what they are."""
        groups = self.structure.energy_groups
        return groups if self.springs is None else {**groups, GROUP: "strain energy of the springs"}

    @cached_property
    def mass(self) -> sparse.csr_array:
        """Nodal mass matrix (n, n), kg: the structure's with point masses.

        Raises
        ------
        InputError
            The sheet has no density, and there are no point masses.
        """
        if not self.masses:
            return self.structure.mass
        points = sparse.csr_array(sparse.diags_array(self.point_masses))
        try:
            return sparse.csr_array(self.structure.mass + points)
        except InputError:
            if self.structure.sheet.density is not None:
                raise
            return points  # a sheet without mass

    @cached_property
    def point_masses(self) -> NDArray[np.float64]:
        """Sum (n,) of the point masses on each node, kg."""
        return read_only(nodal_masses(self.masses, self.structure))

    @cached_property
    def nodal_mass(self) -> NDArray[np.float64]:
        """Mass (n,) that moves with each node: the sums of the rows of `mass`, kg."""
        return self.structure.nodal_mass if not self.masses else read_only(row_sums(self.mass))

    @property
    def total_mass(self) -> float:
        """Mass (kg)."""
        return float(self.mass.sum())

    @property
    def center_of_mass(self) -> NDArray[np.float64]:
        """Center of mass (3,) at rest, m."""
        return center_of_mass(self.structure.nodes, self.mass)

    @property
    def inertia(self) -> NDArray[np.float64]:
        """Inertia tensor (3, 3) at rest about the center of mass, kg m2."""
        return inertia_tensor(self.structure.nodes, self.mass)

    @cached_property
    def fixed(self) -> NDArray[np.bool_]:
        """Whether each node is held along each axis, by Fix or Impose, shape (n, 3)."""
        return read_only(self._straight.held())

    @cached_property
    def imposed(self) -> NDArray[np.bool_]:
        """Whether an Impose moves each node along each axis, shape (n, 3)."""
        return read_only(self._straight.moved(self._stated))

    @cached_property
    def _straight(self) -> Straight:
        return Straight(self.structure, self._stated | self._held)

    @cached_property
    def _stated(self) -> NDArray[np.bool_]:
        """Whether an Impose names each node along each axis, shape (n, 3)."""
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
        return mask

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
            moved = self._straight.carried(vector)
            yield self._tied(moved, place, {place: support.value}), support.history

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
            yield self._tied(self._straight.carried(vector), place, along), support.history

    @cached_property
    def actuation_terms(self) -> Terms:
        """Changes (rad) of the folds' rest angles at factor 1, shape (nf,), with their history."""
        return _summed(self._actuated())

    @cached_property
    def rest_terms(self) -> Terms:
        """Changes (rad) of all rest angles at factor 1, shape (nr,), with their history."""
        return _summed(self._turned())

    def _turned(self) -> Summands:
        for change, history in self.actuation_terms:
            yield np.pad(change, (0, len(self.body.rest_angles) - len(change))), history
        for place, load in self._loads():
            turns = load.turns(self.structure, place)
            if turns is not None and turns.any():
                yield turns, load.history

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
            if isinstance(load, Gravity):
                forces = load.weight(self.nodal_mass)
            if forces is not None:
                yield forces, load.history

    @cached_property
    def following_terms(self) -> tuple[tuple[Following, History], ...]:
        """Forces that depend on the displacement, of each load that has them, with its history."""
        found = ((load.following(self.structure, place), load) for place, load in self._loads())
        return tuple((part, as_history(load.history)) for part, load in found if part is not None)

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
