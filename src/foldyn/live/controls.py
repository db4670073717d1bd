"""The numbers of a case file that a reader can change, and their ranges."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from inspect import signature
from typing import Any

from foldyn.analyses.keys import dotted
from foldyn.arguments import arguments
from foldyn.cases.damping import Rayleigh
from foldyn.cases.units import unit_of
from foldyn.errors import InputError
from foldyn.patterns import GENERATORS
from foldyn.structures import Sheet
from foldyn.values import choice, number, whole

ANGLES: Mapping[str, tuple[float, float]] = {
    "dihedral": (1.0, 179.0), "panel_angle": (1.0, 89.0), "second_angle": (1.0, 89.0),
    "twist": (0.0, 120.0), "arc": (1.0, 360.0),
}  # fmt: skip
"""Arguments of patterns in degrees, with the ranges of their sliders; others are lengths (m)."""
SPAN: Mapping[str, float] = {"pattern": 4.0, "sheet": 10.0, "damping": 10.0}
"""Factor by which a positive number can be changed, either way."""
UNDAMPED: Mapping[str, float] = {"alpha": 10.0, "beta": 0.01}
"""Upper ends of damping sliders that begin at 0."""
MOST_COUNT, MOST_PARTS = 12, 1000
"""Upper end of the slider of a small whole number, and largest total number of cells or sides of a
pattern, which is recomputed for each picture."""


@dataclass(frozen=True)
class Control:
    """A number that the reader can change.

    Attributes
    ----------
    place : tuple of str and int
        Place of the number in the case file, such as ("pattern", "cells", 0).
    value : float
        The value in the file, or the default.
    low, high : float
        Ends of its slider; a typed number may lie outside.
    unit : str
    counts : bool
        Whether the number is whole.
    relative : bool
        Whether the slider is logarithmic.
    """

    place: tuple[str | int, ...]
    value: float
    low: float
    high: float
    unit: str = ""
    counts: bool = False
    relative: bool = False

    @property
    def name(self) -> str:
        """The key as messages write it, such as "pattern.cells[0]"."""
        return dotted(self.place)

    def described(self) -> dict[str, Any]:
        """Description for the page."""
        own = {key: each for key, each in vars(self).items() if key != "place"}
        group, *label = self.place
        return {"name": self.name, "group": group, "label": dotted(label), **own}


def controls(document: Mapping[str, Any]) -> list[Control]:
    """Numbers of [pattern], [sheet] and [damping] of a valid case file, in the order of their keys.

    Keys left at their default are included; keys without any value are not.
    """
    pattern, sheet = document["pattern"], document.get("sheet", {})
    return [*_of_pattern(pattern), *_of_sheet(sheet), *_of_damping(document)]


def changed(
    document: Mapping[str, Any], known: Sequence[Control], wanted: Mapping[str, Any]
) -> dict[str, Any]:
    """Return the case file with new numbers for some controls; the others keep theirs.

    Raises
    ------
    InputError
        The control does not exist, the number is invalid, or the pattern is too large to recompute
        for each picture.
    """
    by_name = {control.name: control for control in known}
    given: dict[str, Any] = deepcopy(dict(document))
    for name, value in wanted.items():
        control = by_name[choice("numbers", name, by_name)]
        exact = whole(name, value, least=1) if control.counts else number(name, value)
        if exact != control.value:
            _put(given, control.place, exact, known)
    counts = [int(wanted.get(one.name, one.value)) for one in known if one.counts]
    if math.prod(counts) > MOST_PARTS:
        raise InputError(
            f": {' x '.join(map(str, counts))} is more than {MOST_PARTS}, too large to be computed "
            "anew with each change; take less, or save the case file and use foldyn run",
            "pattern",
        )
    return given


def _put(
    document: dict[str, Any], place: tuple[str | int, ...], value: float, known: Sequence[Control]
) -> None:
    """Set a number; create its table or list if the file does not contain it."""
    table: Any = document.setdefault(str(place[0]), {})
    *between, last = place[1:]
    for key in between:
        if isinstance(table, dict) and key not in table:
            table[key] = [one.value for one in known if one.place[:-1] == place[:-1]]
        table = table[key]
    table[last] = value


def _of_pattern(table: Mapping[str, Any]) -> Iterator[Control]:
    if "kind" not in table:
        if isinstance(table.get("scale"), int | float):
            yield _positive(("pattern", "scale"), table["scale"])
        return
    for name, parameter in signature(GENERATORS[table["kind"]]).parameters.items():
        given = table.get(name, parameter.default)
        if isinstance(given, list | tuple):
            places = [(("pattern", name, k), value) for k, value in enumerate(given)]
        else:
            places = [(("pattern", name), given)]
        counts = all(type(value) is int for _, value in places)
        counts = counts and "int" in str(parameter.annotation)
        for place, value in places:
            if counts:
                yield Control(place, value, 1, max(MOST_COUNT, 2 * value), counts=True)
            elif name in ANGLES and _is_number(value):
                low, high = ANGLES[name]
                yield Control(place, value, min(low, value), max(high, value), "°")
            elif _is_number(value):
                yield _positive(place, value, "m")


def _of_sheet(table: Mapping[str, Any]) -> Iterator[Control]:
    for name, argument in arguments(Sheet).items():
        value = table.get(name, argument.default)
        if not _is_number(value):
            continue
        if name == "poissons_ratio":
            yield Control(("sheet", name), value, min(0.0, value), max(0.49, value))
        else:
            yield _positive(("sheet", name), value, unit_of(name, value))


def _of_damping(document: Mapping[str, Any]) -> Iterator[Control]:
    table = document.get("damping", {})
    if "ratios" in table:
        for i, pair in enumerate(table["ratios"]):
            for k, (value, unit) in enumerate(zip(pair, ("Hz", ""), strict=True)):
                yield _positive(("damping", "ratios", i, k), value, unit)
        return
    for name, end in UNDAMPED.items():
        value = table.get(name, arguments(Rayleigh)[name].default)
        most = SPAN["damping"] * value or end
        yield Control(("damping", name), value, 0.0, most, unit_of(name, value))


def _positive(place: tuple[str | int, ...], value: float, unit: str = "") -> Control:
    """A logarithmic control for a positive number, a linear one for others."""
    span = SPAN[str(place[0])]
    if value > 0.0:
        return Control(place, value, value / span, value * span, unit, relative=True)
    reach = span * abs(value) or 1.0
    return Control(place, value, -reach, reach, unit)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
