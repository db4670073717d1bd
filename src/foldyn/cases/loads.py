"""Loads: forces on nodes, gravity, self-folding creases, and the registry of all loads.

Creases fold to a dihedral, a fold angle, or a fraction of fully folded. The fold angle follows the
FOLD format: 0 if the panels are flat, positive for a valley, negative for a mountain, 180 or -180
degrees if closed. It is the dihedral with flat panels minus the current dihedral: 180 degrees minus
the dihedral, except for thick panels (`Pattern.flat_dihedrals`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, cast

import numpy as np
from numpy.typing import NDArray

from foldyn.arguments import Check, Key
from foldyn.cases.decode import Factor, PartOf
from foldyn.cases.directions import signed
from foldyn.cases.history import STEADY
from foldyn.cases.load import Load, check_held
from foldyn.cases.region_loads import CreaseMoment, LineLoad, Pressure, Temperature, TotalForce
from foldyn.cases.selection import Creases, Nodes, resolve_creases, resolve_nodes
from foldyn.errors import InputError, within
from foldyn.structures.discretized import Discretized, Distributed
from foldyn.values import doubt_degrees, number, number_or_list, one_or_each, parsed, show, vector

FOLDED = ("angle", "fold_angle", "fraction")  # `Actuate` takes exactly one of these arguments
STANDARD = 9.80665  # m/s2, standard gravity (3rd CGPM, 1901)


SIGNS: Mapping[str, float] = {"V": 1.0, "M": -1.0}
"""Sign of the fold angle of each assignment."""
ROUNDING = 1e-9  # degrees
Angles = float | tuple[float, ...]
PerCrease = float | Sequence[float]


def check_angles(name: str, value: Any) -> Angles:
    """Return a dihedral (degrees) for all creases, or a tuple with one for each."""
    return _within(name, value, 0.0, 360.0, " (flat: 180)")


def check_fold_angles(name: str, value: Any) -> Angles:
    """Return a fold angle (degrees) for all creases, or a tuple with one for each."""
    return _within(name, value, -180.0, 180.0, " (flat: 0; valleys above, mountains below)")


def check_fraction(name: str, value: Any) -> float:
    """Return a fraction between 0 and 1 from a number or a text such as "80%"."""
    given = value
    if isinstance(value, str):
        try:
            given = parsed(value.strip().removesuffix("%")) / 100.0
        except ValueError:
            given = None
        if given is None or not value.strip().endswith("%"):
            raise InputError(
                f' = {show(value)}: must be as in "80%", or a number from 0 to 1', name
            )
    return number(name, given, least=0.0, most=1.0)


def _within(name: str, value: Any, low: float, high: float, hint: str) -> Angles:
    checked = number_or_list(name, value, "crease")
    listed = isinstance(checked, tuple)
    for i, angle in enumerate(checked if listed else (checked,)):
        if not low <= angle <= high:
            place = f"{name}[{i}]" if listed else name
            raise InputError(
                f" = {angle:g}: must lie between {low:g} and {high:g} degrees{hint}", place
            )
    doubt_degrees(name, checked)
    return checked


def dihedrals(
    angle: Angles | None,
    fold_angle: Angles | None,
    fraction: float | None,
    assigned: bool,
    letters: NDArray[np.str_],
    flat: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Dihedrals (degrees) of creases (nc,), from one given of angle, fold angle and fraction.

    letters : assignments of the creases.
    flat : dihedrals (degrees) of the creases if the panels are flat.
    assigned : whether the creases were chosen by a word. A single fold angle then has no sign, and
        each crease folds as it is assigned.
    """
    if angle is not None:
        return one_or_each("angle", angle, len(letters), "creases")
    if fraction is not None:
        return flat - 180.0 * fraction * _signs("fraction", letters)
    folded = one_or_each("fold_angle", fold_angle, len(letters), "creases")
    if not assigned or isinstance(fold_angle, tuple):
        return flat - folded
    if folded[0] < 0.0:
        raise InputError(
            f" = {folded[0]:g}: must be at least 0 for creases chosen by assignment, which "
            "decides the direction in which each folds",
            "fold_angle",
        )
    return flat - folded * _signs("fold_angle", letters)


def within_reach(angles: NDArray[np.float64], creases: NDArray[np.int64]) -> NDArray[np.float64]:
    """Dihedrals (degrees), clipped to 0 to 360 if only rounding exceeds it; otherwise an error."""
    beyond = creases[(angles < -ROUNDING) | (angles > 360.0 + ROUNDING)]
    if beyond.size:
        raise InputError(
            f": crease {beyond[0]} cannot fold that far: its thick panels are hinged on the other "
            "side; fold it less, or give its hinge another offset"
        )
    return np.clip(angles, 0.0, 360.0)


def _signs(name: str, letters: NDArray[np.str_]) -> NDArray[np.float64]:
    """Sign of the fold angle of each crease; all must be mountains or valleys."""
    unknown = [letter for letter in letters.tolist() if letter not in SIGNS]
    if unknown:
        what = {"F": "flat", "U": "unassigned"}[unknown[0]]
        raise InputError(
            f": a crease is {what}, so it is unknown in which direction it folds; give mountains "
            "and valleys, or an angle for each crease",
            name,
        )
    return np.array([SIGNS[letter] for letter in letters.tolist()])


@dataclass(frozen=True)
class Force(Load):
    """The same force on each of some nodes, times a history.

    Parameters
    ----------
    nodes : int, sequence of int, or str
        Node numbers, or an expression that selects vertices ("xmin", "zmax and y>0").
    vector : sequence of float, shape (3,)
        Force (N) on each of these nodes.
    history : History or callable, optional
        Factor of time; constant by default.
    """

    nodes: Nodes
    vector: Annotated[Sequence[float], Check(vector, unit="N"), Key("force")]
    history: Factor = STEADY

    apart = "acts on some nodes"
    arrows = True

    def loaded(self, structure: Discretized, place: str) -> NDArray[np.int64]:
        """See `Load`."""
        return resolve_nodes(structure, self.nodes, f"{place}.nodes")

    def forces(self, structure: Discretized, place: str) -> NDArray[np.float64]:
        """See `Load`."""
        forces = np.zeros((len(structure.nodes), 3))
        forces[self.loaded(structure, place)] = self.vector
        return forces

    def check(self, structure: Discretized, fixed: NDArray[np.bool_], place: str) -> None:
        """Refuse a force that acts only on held axes; warn if some of its axes are held."""
        nodes, acts = self.loaded(structure, place), np.flatnonzero(self.vector)
        check_held(f"the force {show(self.vector)}", nodes, acts, fixed, place)


def _acceleration(name: str, value: Any) -> tuple[float, ...]:
    """Return an acceleration that is not zero, or standard gravity along a direction."""
    if isinstance(value, str):
        axis, sign = signed(name, value)
        return tuple(sign * STANDARD * (k == axis) + 0.0 for k in range(3))
    return vector(name, value, nonzero=True)


@dataclass(frozen=True)
class Gravity(Load):
    """Gravity on the whole structure, times a history.

    The force on a node is the sum of the node's row of the mass matrix, times the acceleration. So
    the weight is exact with every mass rule, and a free structure falls with exactly this
    acceleration. Point masses are included. The weight of held nodes adds to the reactions.

    Parameters
    ----------
    acceleration : sequence of float, shape (3,), or str
        Acceleration (m/s2) of free fall, such as (0, 0, -9.81), not zero; or a direction, such as
        "-z", for standard gravity, 9.80665 m/s2.
    history : History or callable, optional
        Factor of time; constant by default.
    """

    acceleration: Annotated[
        Sequence[float] | str, Check(_acceleration, unit="m/s2"), Key("gravity")
    ]
    history: Factor = STEADY

    apart = "acts on the whole structure"

    def distributed(self, structure: Discretized, place: str) -> Distributed:
        """See `Load`."""
        mass = structure.sheet.values("areal_density", len(structure.pattern.faces))
        return Distributed(panels=self.weight(mass * structure.board_share))

    def weight(self, mass: NDArray[np.float64]) -> NDArray[np.float64]:
        """Forces (n, 3), N, on nodes with masses (n,), kg."""
        return mass[:, None] * np.array(self.acceleration)


@dataclass(frozen=True)
class Actuate(Load):
    """Creases that fold or unfold by themselves.

    The rest dihedral of each crease changes from `Structure.fold_rest` to the given dihedral, in
    proportion to the factor of the history. Give one of `angle`, `fold_angle` and `fraction`.

    Parameters
    ----------
    creases : int, sequence of int, or str
        Numbers in the order of `pattern.creases`, or a name: "mountain", "valley", "all" (all
        except flat creases), or a family of the pattern (`Pattern.families`), such as "zigzag".
    angle : float or sequence of float, optional
        Rest dihedral (degrees, 0 to 360, flat 180) at factor 1: one for all creases, or one for
        each.
    history : History or callable, optional
        Factor of time; constant by default.
    fold_angle : float or sequence of float, optional
        Instead of `angle`, the fold angle of the FOLD format (degrees, -180 to 180): 180 minus the
        dihedral; 0 if flat, positive for valleys, negative for mountains. For creases chosen by a
        word, a single number must be at least 0; each crease folds in its assigned direction.
    fraction : float or str, optional
        Instead of `angle`, the fraction of the way to fully folded, 0 to 1 or a text such as "80%":
        valleys fold to 180 degrees times the fraction, mountains to -180 degrees times the
        fraction.
    """

    creases: Creases
    angle: Annotated[PerCrease | None, Check(check_angles, unit="degrees")] = None
    history: Factor = STEADY
    fold_angle: Annotated[PerCrease | None, Check(check_fold_angles, unit="degrees")] = None
    fraction: Annotated[float | str | None, Check(check_fraction)] = None

    apart = "creases that fold are a load of their own"
    moves = True

    def agree(self) -> None:
        """Require exactly one of `angle`, `fold_angle` and `fraction`."""
        given = self.given(*FOLDED)
        if not given:
            raise InputError(": missing; give it (degrees), or fold_angle or fraction", "angle")
        if len(given) > 1:
            raise InputError(f": give only one of {' and '.join(given)}", given[1])

    def rest_changes(
        self, structure: Discretized, place: str
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """See `Load`; refuses rest angles that the fold law does not allow."""
        creases = resolve_creases(structure, self.creases, f"{place}.creases")
        with within(f"{place}."):
            angles = dihedrals(
                cast(Any, self.angle), cast(Any, self.fold_angle), cast(Any, self.fraction),
                isinstance(self.creases, str), *_of_creases(structure, creases),
            )  # fmt: skip
        (name,) = self.given(*FOLDED)
        with within(f"{place}.{name}"):
            angles = within_reach(angles, creases)
        closed = angles[(angles == 0.0) | (angles == 360.0)]
        if closed.size and not structure.fold_law.closed_at_rest:
            shut = float(closed[0])
            turned = 180.0 - shut if isinstance(self.fold_angle, tuple) else self.fold_angle
            said = {"angle": shut, "fold_angle": turned, "fraction": self.fraction}
            raise InputError(
                f"{place}.{name} = {said[name]:g}: this fold law, free of stress at rest, has an "
                "infinite moment there; give a dihedral between 0 and 360 degrees (flat: 180), or "
                "another fold_law"
            )
        return creases, np.radians(angles) - structure.fold_rest[creases]


def _of_creases(structure: Discretized, creases: NDArray[np.int64]) -> tuple[NDArray, NDArray]:
    """Assignments of creases, and their dihedrals (degrees) if the panels are flat."""
    pattern, count = structure.pattern, len(structure.folds)
    if pattern is None:
        return np.full(count, "U")[creases], np.full(count, 180.0)[creases]
    letters = np.array(pattern.assignments, dtype="<U1")
    return letters[creases], np.degrees(pattern.flat_dihedrals)[creases]


LOADS: tuple[type[Load], ...] = (
    Force,
    Gravity,
    Actuate,
    TotalForce,
    LineLoad,
    Pressure,
    CreaseMoment,
    Temperature,
)
"""All kinds. The keys of a table in a case file determine the kind."""
LOAD = PartOf(LOADS, "loads")
"""A load in a case file."""
