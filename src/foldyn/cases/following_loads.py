"""Loads that follow the sheet: pressure on panels, moments of creases."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from foldyn.arguments import Check
from foldyn.cases.decode import Factor
from foldyn.cases.history import STEADY
from foldyn.cases.load import Load
from foldyn.cases.regions import Panels, resolve_panels
from foldyn.cases.selection import Creases, resolve_creases
from foldyn.errors import InputError
from foldyn.mechanics.following import Following, joined, moments, pressures, pushes
from foldyn.mechanics.sheet_term import NO_DOF
from foldyn.values import number, number_or_list, one_or_each, show


@dataclass(frozen=True)
class Pressure(Load):
    """Pressure on panels, which stays normal to them as they move, times a history.

    It acts along the normal of the panels' fronts: a positive pressure inflates a closed body whose
    fronts are outside. The force on a triangle is the pressure times its present area.

    Parameters
    ----------
    pressure : float
        Pa; negative towards the front.
    panels : int, sequence of int, or "all"
        Panels by number; all by default.
    history : History or callable, optional
        Factor of time; constant by default.
    """

    pressure: Annotated[float, Check(number, unit="Pa")]
    panels: Panels = "all"
    history: Factor = STEADY

    apart = "a pressure acts on panels"

    def following(self, structure: Any, place: str) -> Following:
        """See `Load`."""
        chosen = resolve_panels(structure, self.panels, f"{place}.panels")
        pressure = np.full(len(chosen), self.pressure)
        return pressures(structure.nodes, structure.triangles[chosen], pressure)

    def check(self, structure: Any, fixed: NDArray[np.bool_], place: str) -> None:
        """Refuse a pressure on panels whose nodes are all held."""
        nodes = np.unique(self.following(structure, place).triangles)
        if fixed[nodes].all():
            raise InputError(
                f".panels = {show(self.panels)}: supports hold all nodes of these panels along "
                "all axes; load other panels, or free these",
                place,
            )


@dataclass(frozen=True)
class CreaseMoment(Load):
    """Moments of creases, times a history: pairs of equal and opposite moments on their panels.

    The moment does work as the dihedral grows: a positive one opens a valley. A crease whose fold
    law is linear, M = k (angle - rest), comes to rest at rest + moment / k.

    Parameters
    ----------
    creases : int, sequence of int, or str
        Numbers in the order of `pattern.creases`, or a name: "mountain", "valley", "all", which
        are all but the flat ones, or a family of the pattern (`Pattern.families`), as "zigzag".
    moment : float or sequence of float
        N m of each whole crease, of all these creases or of each.
    history : History or callable, optional
        Factor of time; constant by default.
    """

    creases: Creases
    moment: Annotated[float | Sequence[float], Check(number_or_list, what="crease", unit="N m")]
    history: Factor = STEADY

    apart = "acts on creases"

    def of_creases(self, structure: Any, place: str) -> tuple[NDArray, NDArray]:
        """Its creases (k,), and the moment (k,), N m, of each."""
        creases = resolve_creases(structure, self.creases, f"{place}.creases")
        return creases, one_or_each(f"{place}.moment", self.moment, len(creases), "creases")

    def following(self, structure: Any, place: str) -> Following:
        """See `Load`; a shell's pieces of a crease take their part of it by their length."""
        creases, moment = self.of_creases(structure, place)
        each = np.zeros(len(structure.folds))
        each[creases] = moment
        pieces = structure.body.sheet.fold_hinges()
        chosen = np.isin(pieces.fold, creases)
        part = (each[pieces.fold] * pieces.share)[chosen]
        turning = moments(pieces.corners[chosen], pieces.nodes[chosen], part)
        hidden, back = pieces.hidden[chosen], -part[:, None] * pieces.hidden_turn[chosen]
        there = hidden != NO_DOF
        return joined([(turning, 0), (pushes(hidden[there], back[there]), 0)])

    def turns(self, structure: Any, place: str) -> NDArray | None:
        """See `Load`: the panels beside a crease give way to all of its moment."""
        sheet = structure.body.sheet
        if not sheet.offsets:
            return None
        creases, moment = self.of_creases(structure, place)
        each = np.zeros(len(structure.folds))
        each[creases] = moment
        angles = np.zeros(len(sheet.rest_angles) - sheet.offsets)
        return np.append(angles, sheet.offsets_under(each))

    def check(self, structure: Any, fixed: NDArray[np.bool_], place: str) -> None:
        """Refuse moments of creases between panels that are held."""
        creases, _ = self.of_creases(structure, place)
        pieces = structure.body.sheet.fold_hinges()
        held = fixed[pieces.nodes].all(axis=(1, 2)) & (pieces.hidden == NO_DOF).all(axis=1)
        still = np.intersect1d(creases, pieces.fold[held])
        if still.size:
            raise InputError(
                f".creases = {show(self.creases)}: supports hold the panels on both sides of "
                f"crease {still[0]}; leave it out, or free these",
                place,
            )
