"""Assembly of a `Case`: the effects of its supports, loads and damping on a structure."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, wraps
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases.clamped_edges import between_ends, held_edges, supported_points
from foldyn.cases.connectors import Dashpot
from foldyn.cases.constraints import Constraints, equations_of, values_of
from foldyn.cases.damping import CreaseDamping, Damping, ModalDamping, Rayleigh, StrainDamping
from foldyn.cases.directions import AXES, unit_vector
from foldyn.cases.history import History
from foldyn.cases.loads import Gravity, Load
from foldyn.cases.springs import Cable, rubbing
from foldyn.cases.stops import Stop, StopDampersTerm, stop_dampers
from foldyn.cases.supports import BaseMotion, Fix, Impose, Link
from foldyn.errors import Faults, InputError
from foldyn.mechanics.capstan import CapstanTerm
from foldyn.mechanics.following import Following, pushes
from foldyn.mechanics.term import Term
from foldyn.structures.discretized import Discretized, read_only
from foldyn.structures.swelling import Swelling

Terms = tuple[tuple[NDArray[np.float64], History], ...]
Summands = Iterable[tuple[NDArray[np.float64], Any]]


def summed(parts: Callable[[Any], Summands]) -> cached_property[Terms]:
    """Property: the vectors that a method yields, added up by their histories."""
    return cached_property(wraps(parts)(lambda self: _sum_by_history(parts(self))))


class Supported:
    """The part of `Case` about supports; needs the fields `structure` and `supports`."""

    structure: Discretized
    supports: Sequence[Any]

    @cached_property
    def fixed(self) -> NDArray[np.bool_]:
        """Whether each node is held along each axis, by Fix or Impose, shape (n, 3)."""
        held = self._stated | self._held
        for nodes in self.structure.clamped_nodes:
            held[nodes[1:-1]] |= held[nodes[0]] & held[nodes[-1]]
        return read_only(held)

    @cached_property
    def imposed(self) -> NDArray[np.bool_]:
        """Whether an Impose moves each node along each axis, shape (n, 3)."""
        moved = self._stated.copy()
        for nodes in self.structure.clamped_nodes:
            inner, ends = nodes[1:-1], moved[nodes[0]] | moved[nodes[-1]]
            moved[inner] |= self._straight[inner] & ends
        return read_only(moved)

    @cached_property
    def _straight(self) -> NDArray[np.bool_]:
        """Whether mesh points between the ends of clamped edges follow these, shape (n, 3)."""
        return self.fixed & ~(self._stated | self._held)

    @cached_property
    def _stated(self) -> NDArray[np.bool_]:
        """Whether an Impose names each node along each axis, shape (n, 3)."""
        mask = np.zeros((len(self.structure.nodes), 3), dtype=bool)
        for place, support in self._supports(Impose):
            if support.axis is None:
                continue
            nodes, _ = supported_points(self.structure, support, place)
            axis = AXES.index(support.axis)
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
            nodes, _ = supported_points(self.structure, support, place)
            for axis in support.axes or "":
                mask[nodes, AXES.index(axis)] = True
        return mask

    @cached_property
    def held_edges(self) -> dict[int, NDArray[np.float64]]:
        """Edges of the pattern that are held along their whole length, and directions (h, 3)."""
        supports = [support for _, support in self._supports(Fix, Impose)]
        return held_edges(self.structure, supports, self.fixed)

    @cached_property
    def constraints(self) -> Constraints:
        """Equations between displacements: held directions, links, rigid panels."""
        equations = equations_of(self.structure, self._supports(Fix, Impose, Link))
        return Constraints(equations, self.fixed.ravel())

    @property
    def free_dofs(self) -> NDArray[np.int64]:
        """Numbers 3 * node + axis that are free, increasing; all others depend on them."""
        return self.constraints.free

    @cached_property
    def still(self) -> NDArray[np.bool_]:
        """Whether supports keep each node in place along each axis, shape (n, 3)."""
        held = self.fixed & ~self.imposed
        for vector, _ in self.base_terms:
            held &= vector == 0.0
        return read_only(held)

    @property
    def imposed_slaves(self) -> NDArray[np.int64]:
        """Dofs that an `Impose` along a direction ties to the other dofs of their nodes."""
        return self.constraints.slaves_of([place for place, _ in self._supports(Impose)])

    @property
    def reaction_dofs(self) -> NDArray[np.int64]:
        """Numbers 3 * node + axis on which supports exert forces, increasing."""
        return self.constraints.supported

    @cached_property
    def supported_dofs(self) -> NDArray[np.int64]:
        """Numbers 3 * node + axis that are held, increasing."""
        return np.flatnonzero(self.fixed.ravel()).astype(np.int64)

    @summed
    def imposed_terms(self) -> Summands:
        """Displacements (m) of imposed dofs at factor 1, shape (n, 3), each with its history."""
        for place, support in self._supports(Impose):
            nodes, value = supported_points(self.structure, support, place)
            vector, along = np.zeros((len(self.structure.nodes), 3)), {place: value}
            if support.axis is not None:
                vector[nodes, AXES.index(support.axis)] = value
                along = {}
            yield self._carry_supports(vector, place, along), support.history

    @cached_property
    def prescribed_terms(self) -> Terms:
        """Displacements (n, 3), m, that each `Impose` prescribes, with their history."""
        return _sum_by_history(self._prescribed()) if self.constraints else self.imposed_terms

    def _prescribed(self) -> Summands:
        for place, support in self._supports(Impose):
            vector = np.zeros((len(self.structure.nodes), 3))
            nodes, value = supported_points(self.structure, support, place)
            vector[nodes] = np.multiply.outer(value, unit_vector(support.direction or support.axis))
            yield vector, support.history

    def _carry_supports(self, stated: NDArray, place: str, values: Mapping[str, Any]) -> NDArray:
        """Displacements (n, 3), m, of all dofs when supports move as in `stated` and `values`.

        stated : displacements (n, 3) along axes.
        values : displacements along directions, by the place of the support.
        """
        shape, ties = stated.copy(), self.constraints
        for nodes in self.structure.clamped_nodes:
            inner, between = nodes[1:-1], between_ends(self.structure, nodes[None], stated)[0]
            shape[inner] = np.where(self._straight[inner], between, stated[inner])
        return ties.moved(shape, values_of(ties.owners, values), place) if ties else shape

    @summed
    def base_terms(self) -> Summands:
        """Displacements (m) of the base at factor 1, shape (n, 3), each with its history."""
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
            yield self._carry_supports(vector, place, along), support.history

    @cached_property
    def terms(self) -> tuple[Term, ...]:
        """Energy terms of the supports, one for each kind of support that stores energy."""
        kinds = dict.fromkeys(support.family() for support in self.supports)
        terms = (kind.term(list(self._supports(kind)), self.structure) for kind in kinds)
        return tuple(term for term in terms if term is not None)

    def _supports(self, *kinds: type) -> Iterator[tuple[str, Any]]:
        """Supports of the given kinds, with their places for messages."""
        places = ((f"supports[{i}]", support) for i, support in enumerate(self.supports))
        return ((place, support) for place, support in places if isinstance(support, kinds))


class Loaded:
    """The part of `Case` about loads; needs `structure`, `loads` and `nodal_mass`."""

    structure: Discretized
    loads: Sequence[Load]
    nodal_mass: Any
    point_masses: Any
    held_edges: Any

    @summed
    def rest_terms(self) -> Summands:
        """Changes (rad) of all rest angles at factor 1, shape (nr,), with their history."""
        found = list(self.actuation_terms)
        for place, load in self._loads():
            turns = load.turns(self.structure, place)
            if turns is not None and turns.any():
                found.append((turns, load.history))
        for change, history in found:  # a body is made only if something turns
            count = len(self.structure.body.sheet.rest_angles)
            yield np.pad(change, (0, count - len(change))), history

    @summed
    def actuation_terms(self) -> Summands:
        """Changes (rad) of the folds' rest angles at factor 1, shape (nf,), with their history."""
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

    @summed
    def load_terms(self) -> Summands:
        """Forces (N) on all nodes, shape (n, 3), each with its history."""
        return self._forces(self._loads())

    @summed
    def force_terms(self) -> Summands:
        """The terms of `load_terms` without gravity."""
        return self._forces(pair for pair in self._loads() if pair[1].arrows)

    def _forces(self, loads: Iterable[tuple[str, Load]]) -> Summands:
        for place, load in loads:
            forces = load.forces(self.structure, place)
            if isinstance(load, Gravity):
                linear = self.structure.linear  # see `_following`
                forces = load.weight(self.point_masses if linear else self.nodal_mass)
            if forces is not None:
                yield forces, load.history

    @cached_property
    def following_terms(self) -> tuple[tuple[Following, History], ...]:
        """Displacement-dependent forces of each load that has any, with the load's history."""
        found = ((self._following(load, place), load) for place, load in self._loads())
        return tuple((part, load.history) for part, load in found if part is not None)

    def _following(self, load: Load, place: str) -> Following | None:
        """Displacement-dependent forces; in a linear model what `_forces` lacks, on all dofs."""
        spread = load.distributed(self.structure, place) if self.structure.linear else None
        if spread is None:
            return load.following(self.structure, place)
        forces = self.structure.spread(spread, self.held_edges)
        nodal = load.forces(self.structure, place)
        if nodal is not None:
            forces[: nodal.size] -= nodal.ravel()
        return pushes(np.arange(len(forces)), forces)

    @cached_property
    def swellings(self) -> tuple[tuple[Swelling, History], ...]:
        """Free stretching and curling of panels due to each load, with its history."""
        found = []
        for place, load in self._loads():
            own = load.swelling(self.structure, place)
            if own is not None:
                found.append((own._replace(forces=self._following(load, place)), load.history))
        return tuple(found)

    @summed
    def gravity_terms(self) -> Summands:
        """Accelerations of gravity (m/s2), shape (3,), each with its history."""
        return ((np.array(load.acceleration), load.history) for _, load in self.loads_of(Gravity))

    @cached_property
    def loaded_nodes(self) -> NDArray[np.int64]:
        """Nodes on which a force acts, increasing; without gravity, which acts on all nodes."""
        return _union([load.loaded(self.structure, place) for place, load in self._loads()])

    @cached_property
    def actuated_creases(self) -> NDArray[np.int64]:
        """Creases that a load actuates, increasing."""
        pairs = [load.rest_changes(self.structure, place) for place, load in self._loads()]
        return _union([pair[0] for pair in pairs if pair is not None])

    def loads_of(self, kind: type) -> Iterator[tuple[str, Any]]:
        """Loads of one kind, with their places for messages."""
        return (pair for pair in self._loads() if isinstance(pair[1], kind))

    def _loads(self) -> Iterator[tuple[str, Load]]:
        """Loads with their places for messages."""
        return ((f"loads[{i}]", load) for i, load in enumerate(self.loads))


@dataclass(frozen=True, eq=False)
class SomeLoads(Loaded):
    """Some of the loads of a case, which has checked all of them.

    Parameters
    ----------
    case : Case
    numbers : sequence of int
        Indices of the chosen loads among the loads of the case.
    """

    case: Loaded
    numbers: Sequence[int]

    def __getattr__(self, name: str) -> Any:
        """Structure and masses, which are those of the case."""
        return getattr(self.case, name)

    def _loads(self) -> Iterator[tuple[str, Load]]:
        return ((f"loads[{i}]", self.case.loads[i]) for i in self.numbers)


class Damped(Supported):
    """The part of `Case` about damping; needs `damping`, and `supports` for dashpots."""

    damping: Damping | Sequence[Damping]

    @property
    def dampings(self) -> tuple[Damping, ...]:
        """All dampings of the case."""
        return tuple(self.damping) if isinstance(self.damping, Sequence) else (self.damping,)

    def _check_damping(self, faults: Faults) -> None:
        """Refuse nodes and creases that do not exist."""
        for place, dashpot in self.dashpots:
            with faults.collected():
                dashpot.ends(self.structure, place)
        for part in self.dampings:
            if isinstance(part, CreaseDamping):
                with faults.collected():
                    part.per_length(self.structure, "damping")
        if self.strain_damping and self.structure.body.strains() is None:
            text = (
                "damping: StrainDamping takes bars and hinges, and the panels of this model bend "
                'as plates; take preset = "plate", which has hinges in panels, CreaseDamping, or '
                "Rayleigh for what hardly turns"
            )
            faults.add(InputError(text))

    @cached_property
    def rayleigh(self) -> Rayleigh:
        """The Rayleigh part of the damping; zero if there is none."""
        return next((part for part in self.dampings if isinstance(part, Rayleigh)), Rayleigh())

    @cached_property
    def modal_damping(self) -> ModalDamping | None:
        """Damping ratios of modes, if there are any."""
        return next((part for part in self.dampings if isinstance(part, ModalDamping)), None)

    @cached_property
    def crease_damping(self) -> NDArray[np.float64]:
        """Damping (nf,) of each fold, N m s/rad per m of crease."""
        parts = [part for part in self.dampings if isinstance(part, CreaseDamping)]
        none = np.zeros(len(self.structure.folds))
        return read_only(sum((part.per_length(self.structure, "damping") for part in parts), none))

    @property
    def strain_damping(self) -> float:
        """Damping of strain rates, s."""
        return next((part.beta for part in self.dampings if isinstance(part, StrainDamping)), 0.0)

    @cached_property
    def dashpots(self) -> tuple[tuple[str, Dashpot], ...]:
        """Dashpots among the supports, with their places for messages."""
        return tuple(self._supports(Dashpot))

    @cached_property
    def damped_stops(self) -> StopDampersTerm | None:
        """The damping of end stops; None without any."""
        return stop_dampers(list(self._supports(Stop)), self.structure)

    @cached_property
    def rubbing_cables(self) -> CapstanTerm | None:
        """The friction of cables; None without any."""
        return rubbing(list(self._supports(Cable)), self.structure)

    @property
    def damped_at_start(self) -> bool:
        """Whether any damping refers to the state in which a motion begins."""
        return any(getattr(part, "state", "rest") == "initial" for part in self.dampings)

    @property
    def damped(self) -> bool:
        """Whether anything dissipates energy."""
        rayleigh = self.rayleigh.alpha > 0.0 or self.rayleigh.beta > 0.0
        modal = self.modal_damping is not None and bool(np.any(self.modal_damping.ratios))
        dashpots = any(dashpot.coefficient > 0.0 for _, dashpot in self.dashpots)
        strain = self.strain_damping > 0.0
        terms = self.damped_stops is not None or self.rubbing_cables is not None
        others = strain or bool(self.crease_damping.any()) or terms
        return rayleigh or modal or dashpots or others


def _union(numbers: Sequence[NDArray[np.int64]]) -> NDArray[np.int64]:
    """Sorted union of several sets of numbers."""
    return np.unique(np.concatenate([np.zeros(0, np.int64), *numbers]))


def _sum_by_history(parts: Summands) -> Terms:
    """Vectors with their histories; vectors with equal histories are added up."""
    terms: list[tuple[NDArray[np.float64], History]] = []
    for vector, history in parts:
        same = next((total for total, other in terms if other == history), None)
        if same is None:
            terms.append((vector, history))
        else:
            same += vector
    return tuple((read_only(vector), history) for vector, history in terms)
