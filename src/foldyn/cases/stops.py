"""End stops of creases: kernels, term and support.

A stop pushes back with the moment k L (theta - theta_s) where the dihedral theta between the panels
is beyond theta_s, and does nothing before. On meshes each piece of a crease has its share.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.arguments import Check, Key
from foldyn.cases.decode import Part
from foldyn.cases.loads import PerCrease, check_angles
from foldyn.cases.selection import Creases, resolve_creases
from foldyn.errors import InputError
from foldyn.jit.compiled import inner_scalar, kernel
from foldyn.jit.context import Context, numbers_at, rows_at
from foldyn.mechanics.block_matrix import pairs_within, places_of
from foldyn.mechanics.dihedral import add_hessian, dihedrals_and_gradients, gradient_at
from foldyn.mechanics.discrete_gradient import discrete_gradient, put_motion
from foldyn.mechanics.model import ranks
from foldyn.mechanics.term import (
    ENERGIES,
    FORCES,
    MEAN_FORCES,
    CompiledTerm,
    Term,
    energies,
    forces,
    mean_forces,
    nodal,
)
from foldyn.structures.discretized import Discretized
from foldyn.values import choice, number, one_or_each, show

ALIKE = 1e-9  # rad: turns below this have the moment of their middle
DIGITS = 6  # of radians, to which a crease rests at its stop
SIDES = {"below": -1.0, "above": 1.0}


class Stops(NamedTuple):
    """Arrays of h hinges."""

    rest: NDArray  # (n, 3) m
    hinges: NDArray  # (h, 4) axis j, k, wings i, l
    limit: NDArray  # (h,) rad
    side: NDArray  # (h,) 1 if it acts above the limit, -1 below, 0 on both sides
    stiffness: NDArray  # (h,) N m/rad


class _Scratch(NamedTuple):
    points: NDArray  # (4, 3), as all of these
    mean: NDArray
    change: NDArray
    plain: NDArray
    gradient: NDArray


class _Context(NamedTuple):
    stops: Stops
    scratch: _Scratch
    group: int
    rows: int


@inner_scalar
def _beyond(stops, h, angle):
    """How far (rad) a dihedral is beyond a stop, with the sign of the turn; 0 before it."""
    turn = angle - stops.limit[h]
    return turn if stops.side[h] * turn >= 0.0 else 0.0


@inner_scalar
def _angle(stops, moved, h, points):
    """Dihedral of a hinge and its gradient (13 numbers)."""
    for v in range(4):
        node = stops.hinges[h, v]
        for c in range(3):
            points[v, c] = stops.rest[node, c] + moved[node, c]
    return gradient_at(points)


@forces
def _forces(own, u, v, t, force, powers):
    stops, moved, out = own.stops, rows_at(u, own.rows), rows_at(force, own.rows)
    for h in range(stops.limit.size):
        found = _angle(stops, moved, h, own.scratch.points)
        moment = stops.stiffness[h] * _beyond(stops, h, found[0])
        if moment != 0.0:
            for p in range(4):
                for c in range(3):
                    out[stops.hinges[h, p], c] += moment * found[1 + 3 * p + c]


@energies
def _energies(own, u, out):
    stops, moved, energy = own.stops, rows_at(u, own.rows), 0.0
    for h in range(stops.limit.size):
        beyond = _beyond(stops, h, _angle(stops, moved, h, own.scratch.points)[0])
        energy += 0.5 * stops.stiffness[h] * beyond * beyond
    numbers_at(out, own.group + 1)[own.group] = energy


@mean_forces
def _mean_forces(own, u0, u1, before, h, t, force, powers):
    stops, out = own.stops, rows_at(force, own.rows)
    start, end = rows_at(u0, own.rows), rows_at(u1, own.rows)
    room, points = own.scratch, own.scratch.points
    for e in range(stops.limit.size):
        first, last = _angle(stops, start, e, points)[0], _angle(stops, end, e, points)[0]
        one, two = _beyond(stops, e, first), _beyond(stops, e, last)
        if one == 0.0 and two == 0.0:
            continue
        moment = 0.5 * (one + two)
        if abs(last - first) > ALIKE:
            moment = 0.5 * (two * two - one * one) / (last - first)
        put_motion(stops.rest, stops.hinges, e, start, end, room.mean, room.change)
        discrete_gradient(room.mean, room.change, last - first, points, room.plain, room.gradient)
        for p in range(4):
            for c in range(3):
                out[stops.hinges[e, p], c] += stops.stiffness[e] * moment * room.gradient[p, c]


@kernel
def _blocks(stops, x, angle, gradient):
    """Derivatives (h, 4, 3, 4, 3) of the forces at positions x (n, 3)."""
    out, points = np.zeros((stops.limit.size, 4, 3, 4, 3)), np.empty((4, 3))
    slope = np.empty((4, 3))
    for h in range(stops.limit.size):
        beyond = _beyond(stops, h, angle[h])
        if beyond == 0.0 and stops.side[h] != 0.0:
            continue
        for v in range(4):
            for c in range(3):
                points[v, c] = x[stops.hinges[h, v], c]
                slope[v, c] = gradient[h, 3 * v + c]
        for v in range(4):
            for c in range(3):
                for w in range(4):
                    for d in range(3):
                        out[h, v, c, w, d] = stops.stiffness[h] * slope[v, c] * slope[w, d]
        add_hessian(points, slope, stops.stiffness[h] * beyond, out[h])
    return out


class StopsTerm(Term):
    """End stops of creases as a term; see `Term`."""

    energy_groups: ClassVar[Mapping[str, str]] = {"strain_stops": "strain energy of end stops"}
    undifferentiated: ClassVar[str] = "end stops"

    def __init__(self, stops: Stops) -> None:
        self.stops = stops

    def compiled(self, part: Any, kept: Any, group: int) -> CompiledTerm:
        """See `Term`."""
        scratch = _Scratch(*(np.zeros((4, 3)) for _ in _Scratch._fields))
        own = Context(_Context(self.stops, scratch, group, int(part.own[1])))
        return CompiledTerm(own, {FORCES: _forces, ENERGIES: _energies, MEAN_FORCES: _mean_forces})

    @property
    def places(self) -> tuple[NDArray, NDArray]:
        """See `Term`."""
        return places_of(pairs_within(self.stops.hinges))

    def entries(self, q: NDArray, floor: float = -np.inf) -> NDArray:
        """See `Term`."""
        x, hinges = self._at(q)
        blocks = _blocks(self.stops, x, *dihedrals_and_gradients(x, hinges))
        return blocks.transpose(0, 1, 3, 2, 4).ravel()

    def _at(self, q: NDArray) -> tuple[NDArray, NDArray]:
        rest = self.stops.rest
        return np.ascontiguousarray(rest + nodal(q)[: len(rest)]), self.stops.hinges

    def nominal(self, q: NDArray) -> StopsTerm:
        """The stops as springs that always act; see `Term`."""
        angle = dihedrals_and_gradients(*self._at(q))[0]
        return StopsTerm(self.stops._replace(limit=angle, side=np.zeros(len(angle))))

    def turning_moments(self) -> float:
        """See `Term`."""
        return float(self.stops.stiffness.sum())

    def placed(self, order: NDArray, before: Any) -> StopsTerm:
        """See `Term`."""
        own = self.stops
        rest = np.ascontiguousarray(own.rest[order])
        return StopsTerm(own._replace(rest=rest, hinges=ranks(order)[own.hinges]))


@dataclass(frozen=True)
class Stop(Part):
    """An end stop of creases: beyond an angle, it pushes the panels back.

    The moment is k L (theta - angle) with theta the dihedral between the panels and L the length of
    the crease at rest, and 0 before the stop.

    Parameters
    ----------
    creases : int, sequence of int, or str
        Numbers in the order of `pattern.creases`, or a name: "mountain", "valley", "all" (all
        except flat creases), or a family of the pattern, such as "zigzag".
    angle : float or sequence of float
        Dihedral at which it begins to act (degrees, 0 to 360, flat 180): one for all creases, or
        one for each.
    stiffness : float
        k per length of the crease (N m/rad per m), above 0.
    side : {"below", "above"}, optional
        The side of the angle on which it acts; by default the side on which the crease is not at
        rest.
    """

    creases: Creases
    angle: Annotated[PerCrease, Check(check_angles, unit="degrees"), Key("stop")]
    stiffness: Annotated[
        float, Check(number, above=0.0, unit="N m/rad per m"), Key("stop_stiffness")
    ]
    side: Annotated[str | None, Check(choice, known=tuple(SIDES))] = None

    apart = "stops of creases are a support of their own"

    @classmethod
    def term(cls, parts: Sequence[tuple[str, Any]], structure: Discretized) -> StopsTerm:
        """See `Part`."""
        if structure.kind == "superelements":
            raise InputError(
                f"{parts[0][0]}: superelements are linear, and stops are not; take bars and hinges "
                "or a shell"
            )
        folds = structure.body.sheet.fold_hinges()
        found = [one._on(structure, folds, place) for place, one in parts]
        row, limit, side, stiffness = (np.concatenate(each) for each in zip(*found, strict=True))
        rest = np.ascontiguousarray(structure.nodes, float)
        return StopsTerm(Stops(rest, folds.nodes[row], limit, side, stiffness))

    def _on(self, structure: Discretized, folds: Any, place: str) -> tuple[NDArray, ...]:
        """Hinges (h,), their limits and sides, and their stiffness, N m/rad."""
        creases = resolve_creases(structure, self.creases, f"{place}.creases")
        angles, rest = np.zeros((2, len(structure.folds)))
        given = one_or_each(f"{place}.angle", self.angle, len(creases), "creases")
        angles[creases] = np.radians(given)
        rest[creases] = structure.pattern.dihedrals[creases]
        side = np.sign((angles - rest).round(DIGITS))
        if self.side is not None:
            side = np.full(len(rest), SIDES[self.side])
        same = creases[side[creases] == 0.0]
        if len(same):
            raise InputError(
                f"{place}.angle: crease {same[0]} rests at the stop; say on which side it acts, "
                'side = "below" or "above"'
            )
        passed = creases[(side * (rest - angles))[creases] > 0.0]
        if len(passed):
            raise InputError(
                f"{place}.side = {show(self.side)}: crease {passed[0]} is beyond the stop at rest, "
                f"at {np.degrees(rest[passed[0]]):.4g} degrees; choose the other side, or another "
                "angle"
            )
        row = np.flatnonzero(np.isin(folds.fold, creases))
        fold, length = folds.fold[row], folds.length[row]
        return row, angles[fold], side[fold], self.stiffness * length
