"""End stops of creases: kernels, term and support.

A stop pushes back with the moment k L (theta - theta_s) where the angle theta of the crease is
beyond theta_s, and does nothing before. The angle is that between the ends of the panels, which
bend: in shells and `n5b8e` the dihedral without the turns of the panels' edges; in `plate`, whose
panels are springs c in series, stop and crease of stiffness K m'(theta_s) add to one spring, and
the dihedral passes theta_s + c K m(theta_s). On meshes each piece of a crease has its share.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from foldyn.arguments import Check, Key
from foldyn.cases.decode import Part
from foldyn.cases.loads import PerCrease, check_angles
from foldyn.cases.selection import Creases, refuse_linear, resolve_creases
from foldyn.errors import InputError
from foldyn.jit.compiled import inner, inner_scalar, kernel
from foldyn.jit.context import Context, numbers_at, rows_at
from foldyn.jit.intrinsics import flat
from foldyn.mechanics.dihedral import add_hessian, dihedrals_and_gradients, gradient_at
from foldyn.mechanics.discrete_gradient import discrete_gradient, put_motion
from foldyn.mechanics.model import ranks
from foldyn.mechanics.sheet_term import NO_DOF
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

NOISE = 1e-9  # rad: turns beyond a stop below this are rounding
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
    hidden: NDArray  # (h, 2) dofs that turn the crease too, 0 for none
    turn: NDArray  # (h, 2) turn by these dofs, rad/m, 0 for none
    still: NDArray  # (h,) angle at rest, rad, if these dofs alone turn it, else nan


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
    return turn if stops.side[h] == 0.0 or stops.side[h] * turn > NOISE else 0.0


@inner_scalar
def _angle(stops, moved, h, points):
    """Angle of a hinge, and the dihedral and its gradient (13 numbers)."""
    for v in range(4):
        node = stops.hinges[h, v]
        for c in range(3):
            points[v, c] = stops.rest[node, c] + moved[node, c]
    found = gradient_at(points)
    angle = found[0] if math.isnan(stops.still[h]) else stops.still[h]
    for side in range(2):
        angle -= stops.turn[h, side] * flat(moved)[stops.hidden[h, side]]
    return angle, found


@inner
def _push(stops, h, moment, gradient, force):
    """Add a moment (N m) of hinge h to the forces, given the gradient (12,) of its dihedral."""
    for side in range(2):
        flat(force)[stops.hidden[h, side]] -= stops.turn[h, side] * moment
    if math.isnan(stops.still[h]):
        for v in range(4):
            for c in range(3):
                force[stops.hinges[h, v], c] += moment * gradient[3 * v + c]


@forces
def _forces(own, u, v, t, force, powers):
    stops, moved, out = own.stops, rows_at(u, own.rows), rows_at(force, own.rows)
    for h in range(stops.limit.size):
        angle, found = _angle(stops, moved, h, own.scratch.points)
        moment = stops.stiffness[h] * _beyond(stops, h, angle)
        if moment != 0.0:
            _push(stops, h, moment, found[1:], out)


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
        (first, old), (last, new) = (
            _angle(stops, start, e, points), _angle(stops, end, e, points)
        )  # fmt: skip
        one, two = _beyond(stops, e, first), _beyond(stops, e, last)
        if one == 0.0 and two == 0.0:
            continue
        moment = 0.5 * (one + two)
        if abs(last - first) > ALIKE:
            moment = 0.5 * (two * two - one * one) / (last - first)
        put_motion(stops.rest, stops.hinges, e, start, end, room.mean, room.change)
        discrete_gradient(
            room.mean, room.change, new[0] - old[0], points, room.plain, room.gradient
        )
        _push(stops, e, stops.stiffness[e] * moment, flat(room.gradient), out)


@kernel
def _curvatures(stops, x, gradient, moment):
    """Moments times second derivatives (h, 4, 3, 4, 3) of dihedrals at positions x (n, 3)."""
    out, points = np.zeros((stops.limit.size, 4, 3, 4, 3)), np.empty((4, 3))
    slope = np.empty((4, 3))
    for h in range(stops.limit.size):
        if moment[h] != 0.0:
            for v in range(4):
                for c in range(3):
                    points[v, c] = x[stops.hinges[h, v], c]
                    slope[v, c] = gradient[h, 3 * v + c]
            add_hessian(points, slope, moment[h], out[h])
    return out


class BeyondAngles(Term):
    """Base of terms that act where creases are beyond an angle; see `Term`."""

    def __init__(self, stops: Stops, rows: int) -> None:
        self.stops, self.rows = stops, rows

    def context(self, group: int) -> Context:
        """Context of the kernels."""
        scratch = _Scratch(*(np.zeros((4, 3)) for _ in _Scratch._fields))
        return Context(_Context(self.stops, scratch, group, self.rows))

    def coupled(self) -> tuple[NDArray, NDArray]:
        """Rows and columns (k,) of the dofs that turn a crease."""
        nodes = 3 * self.stops.hinges[:, :, None] + np.arange(3)
        dofs = np.hstack([nodes.reshape(-1, 12), self.stops.hidden])
        return np.repeat(dofs, 14, axis=1).ravel(), np.tile(dofs, (1, 14)).ravel()

    def resisted(self, q: NDArray) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        """Matrices (h, 14, 14) of what acts, its moments (h,), gradients (h, 12), positions."""
        stops, (angle, gradient, x) = self.stops, self._angles(q)
        beyond = angle - stops.limit
        acts = (stops.side == 0.0) | (stops.side * beyond > NOISE)
        moved = np.isnan(stops.still)[:, None] * gradient
        rates = np.hstack([moved, -stops.turn])
        stiffness = acts * stops.stiffness
        out = np.einsum("h,ha,hb->hab", stiffness, rates, rates)
        return out, np.where(np.isnan(stops.still), stiffness * beyond, 0.0), gradient, x

    def _angles(self, q: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        """Angles (h,), gradients (h, 12) of the dihedrals, and positions of the nodes."""
        stops, flat_q = self.stops, np.ravel(q)
        x = np.ascontiguousarray(stops.rest + nodal(q)[: len(stops.rest)])
        dihedral, gradient = dihedrals_and_gradients(x, stops.hinges)
        angle = np.where(np.isnan(stops.still), dihedral, stops.still)
        return angle - (stops.turn * flat_q[stops.hidden]).sum(axis=1), gradient, x

    def placed(self, order: NDArray, before: Any) -> Self:
        """See `Term`."""
        own = self.stops
        rest = np.ascontiguousarray(own.rest[order])
        return type(self)(own._replace(rest=rest, hinges=ranks(order)[own.hinges]), self.rows)


class StopsTerm(BeyondAngles):
    """End stops of creases as a term; see `Term`."""

    energy_groups: ClassVar[Mapping[str, str]] = {"strain_stops": "strain energy of end stops"}
    undifferentiated: ClassVar[str] = "end stops"

    def __init__(self, stops: Stops, rows: int) -> None:
        super().__init__(stops, rows)
        self.owns_hidden = bool(stops.turn.any())  # it turns with them

    def compiled(self, part: Any, kept: Any, group: int) -> CompiledTerm:
        """See `Term`."""
        kernels = {FORCES: _forces, ENERGIES: _energies, MEAN_FORCES: _mean_forces}
        return CompiledTerm(self.context(group), kernels)

    places: Any = property(BeyondAngles.coupled)

    def entries(self, q: NDArray, floor: float = -np.inf) -> NDArray:
        """See `Term`."""
        out, moment, gradient, x = self.resisted(q)
        out[:, :12, :12] += _curvatures(self.stops, x, gradient, moment).reshape(-1, 12, 12)
        return out.ravel()

    def nominal(self, q: NDArray) -> StopsTerm:
        """The stops as springs that always act; see `Term`."""
        angle = self._angles(q)[0]
        return StopsTerm(self.stops._replace(limit=angle, side=np.zeros(len(angle))), self.rows)

    def turning_moments(self) -> float:
        """See `Term`."""
        return float(self.stops.stiffness.sum())


@forces
def _resist(own, u, v, t, force, powers):
    """Resist the rate of creases beyond their stops; in `stiffness` is the damping."""
    stops, moved, out = own.stops, rows_at(u, own.rows), rows_at(force, own.rows)
    speed, lost = rows_at(v, own.rows), 0.0
    for h in range(stops.limit.size):
        angle, found = _angle(stops, moved, h, own.scratch.points)
        if _beyond(stops, h, angle) == 0.0:
            continue
        rate = 0.0
        for side in range(2):
            rate -= stops.turn[h, side] * flat(speed)[stops.hidden[h, side]]
        if math.isnan(stops.still[h]):
            for k in range(12):
                rate += found[1 + k] * speed[stops.hinges[h, k // 3], k % 3]
        _push(stops, h, stops.stiffness[h] * rate, found[1:], out)
        lost += stops.stiffness[h] * rate * rate
    numbers_at(powers, 2)[1] += lost


class StopDampersTerm(BeyondAngles):
    """Damping of end stops as a term; see `Term`."""

    damps = True
    undifferentiated: ClassVar[str] = "damped end stops"

    def compiled(self, part: Any, kept: Any, group: int) -> CompiledTerm:
        """See `Term`."""
        return CompiledTerm(self.context(group), {FORCES: _resist})

    def nominal(self, q: NDArray) -> StopDampersTerm:
        """Dampers that always act; see `Term`."""
        return StopDampersTerm(self.stops._replace(side=np.zeros(len(self.stops.side))), self.rows)

    damping_places: Any = property(BeyondAngles.coupled)

    def damping_entries(self, q: NDArray, hidden: float = 1.0) -> NDArray:
        """See `Term`."""
        out = self.resisted(q)[0]
        out[:, :, 12:] *= hidden
        return out.ravel()


def check_open_angles(name: str, value: Any) -> Any:
    """Angles (degrees) that a crease can pass, one or one for each."""
    checked = check_angles(name, value)
    if np.isin(checked, (0.0, 360.0)).any():
        raise InputError(f" = {show(value)}: panels cannot pass 0 or 360 degrees", name)
    return checked


class OnHinges(NamedTuple):
    """Springs that act on h hinges where their dihedrals have passed an angle."""

    row: NDArray  # (h,) of the fold hinges
    angle: NDArray  # (h,) rad
    side: NDArray  # (h,) 1 if it acts above the angle, -1 below
    stiffness: NDArray  # (h,) N m/rad, by which the hinge becomes stiffer
    share: NDArray  # (h,) turn of the spring per turn of the hinge


def on_hinges(part: Any, structure: Discretized, place: str) -> OnHinges:
    """Where the springs of a stop or a latch act on the hinges of folds.

    In `plate`, whose panels are springs c in series with the crease and the spring beside it, these
    two act as one on the dihedral; see the module's text.
    """
    folds = structure.body.sheet.fold_hinges()
    creases = resolve_creases(structure, part.creases, f"{place}.creases")
    angles, rest = np.zeros((2, len(structure.folds)))
    angles[creases] = np.radians(one_or_each(f"{place}.angle", part.angle, len(creases), "creases"))
    rest[creases] = structure.pattern.dihedrals[creases]
    side = np.sign((angles - rest).round(DIGITS))
    stated = getattr(part, "side", None)
    if stated is not None:
        side = np.full(len(rest), SIDES[stated])
    same = creases[side[creases] == 0.0]
    if len(same):
        sided = 'stop; say on which side it acts, side = "below" or "above"'
        rests = sided if hasattr(part, "side") else "latch; give an angle that it passes"
        raise InputError(f"{place}.angle: crease {same[0]} rests at the {rests}")
    passed = creases[(side * (rest - angles))[creases] > 0.0]
    if len(passed):
        raise InputError(
            f"{place}.side = {show(stated)}: crease {passed[0]} is beyond the stop at rest, at "
            f"{np.degrees(rest[passed[0]]):.4g} degrees; choose the other side, or another angle"
        )
    row = np.flatnonzero(np.isin(folds.fold, creases))
    fold, soft = folds.fold[row], folds.softness[row]
    crease = folds.stiffness[row] / (1.0 - soft * folds.stiffness[row])  # without its panels
    law, at = structure.fold_law.elastic.at(fold), angles[fold]
    slope = crease * law.slope(at, folds.rest[row])
    own = part.stiffness * folds.length[row]
    share = 1.0 / (1.0 + soft * (slope + own))
    angle = at + soft * crease * law.moment(at, folds.rest[row])
    return OnHinges(row, angle, side[fold], own * share / (1.0 + soft * slope), share)


@dataclass(frozen=True)
class Stop(Part):
    """An end stop of creases: beyond an angle, it pushes the panels back.

    The moment is k L (theta - angle) with theta the dihedral between the panels' ends and L the
    length of the crease at rest, and 0 before the stop.

    Parameters
    ----------
    creases : int, sequence of int, or str
        Numbers in the order of `pattern.creases`, or a name: "mountain", "valley", "all" (all
        except flat creases), or a family of the pattern, such as "zigzag".
    angle : float or sequence of float
        Angle at which it begins to act (degrees, between 0 and 360, flat 180): one for all
        creases, or one for each.
    stiffness : float
        k per length of the crease (N m/rad per m), above 0.
    side : {"below", "above"}, optional
        The side of the angle on which it acts; by default the side on which the crease is not at
        rest.
    damping : float
        Damping per length of the crease (N m s/rad per m) while it acts, at least 0.
    """

    creases: Creases
    angle: Annotated[PerCrease, Check(check_open_angles, unit="degrees"), Key("stop")]
    stiffness: Annotated[
        float, Check(number, above=0.0, unit="N m/rad per m"), Key("stop_stiffness")
    ]
    side: Annotated[str | None, Check(choice, known=tuple(SIDES))] = None
    damping: Annotated[
        float, Check(number, least=0.0, unit="N m s/rad per m"), Key("stop_damping")
    ] = 0.0

    apart = "stops of creases are a support of their own"

    @classmethod
    def term(cls, parts: Sequence[tuple[str, Any]], structure: Discretized) -> StopsTerm:
        """See `Part`."""
        refuse_linear(structure, parts[0][0], "stops")
        on = [on_hinges(part, structure, place) for place, part in parts]
        stiffness = np.concatenate([one.stiffness for one in on])
        return StopsTerm(_packed(on, stiffness, structure), structure.body.sheet.rows)


def stop_dampers(
    parts: Sequence[tuple[str, Stop]], structure: Discretized
) -> StopDampersTerm | None:
    """Damping of stops, each with its place; None without any."""
    damped = [(place, part) for place, part in parts if part.damping]
    if not damped:
        return None
    length = structure.body.sheet.fold_hinges().length
    on = [on_hinges(part, structure, place) for place, part in damped]
    own = [
        part.damping * length[one.row] * one.share**2
        for one, (_, part) in zip(on, damped, strict=True)
    ]
    return StopDampersTerm(_packed(on, np.concatenate(own), structure), structure.body.sheet.rows)


def _packed(on: Sequence[OnHinges], strength: NDArray, structure: Discretized) -> Stops:
    """Arrays of stops with their strengths (h,), where they act."""
    folds = structure.body.sheet.fold_hinges()
    row, limit, side = (
        np.concatenate([getattr(one, name) for one in on]) for name in ("row", "angle", "side")
    )
    rest = np.ascontiguousarray(structure.nodes, float)
    hidden = np.where(folds.hidden == NO_DOF, 0, folds.hidden)[row]
    corners = np.arange(4 * len(row)).reshape(-1, 4)
    still, _ = dihedrals_and_gradients(folds.corners[row].reshape(-1, 3), corners)
    still = np.where(folds.alone[row], still, np.nan)
    arrays = limit, side, strength, hidden, folds.hidden_turn[row], still
    return Stops(rest, folds.nodes[row], *arrays)
