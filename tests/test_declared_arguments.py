"""Arguments of data classes: what they declare is found, checked and kept."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import pytest

import foldyn as fd
from foldyn.arguments import Check, Checked, Key, Unit, arguments
from foldyn.cases.damping import DAMPINGS
from foldyn.cases.histories import HISTORIES
from foldyn.cases.loads import LOADS
from foldyn.cases.supports import SUPPORTS
from foldyn.errors import InputError
from foldyn.json_schema import Schema
from foldyn.linear.frf import METHODS
from foldyn.materials import BAR_LAWS, HINGE_LAWS
from foldyn.statics import Settings
from foldyn.tables import ListOf, Section, TableOf, read, schema_of, told
from foldyn.values import number, whole

KINDS = [*SUPPORTS, *LOADS, *DAMPINGS, *HISTORIES.values(), *BAR_LAWS.values()]
KINDS += [*HINGE_LAWS.values(), *(method.options for method in METHODS.values()), Settings]
KINDS += [
    fd.Sheet,
    fd.PanelSheet,
    fd.PointMass,
    fd.Contact,
    fd.Plane,
    fd.State,
    fd.Laminate,
    fd.Ply,
]
OTHERWISE = {"law", "name", "solver"}
"""Arguments that are looked up where they are used."""
Length = Annotated[float, Check(number, above=0.0, unit="m")]


@dataclass(frozen=True)
class Box(Checked):
    """A class with a declaration of each kind."""

    width: Length
    count: Annotated[int, Check(whole, least=1), Key("number")] = 1
    height: Annotated[Length | None, Key("tall")] = None
    tint: Annotated[str, Unit("K")] = ""

    place = "box: "

    def agree(self) -> None:
        """Refuse what is taller than wide."""
        if self.height is not None and self.height > self.width:
            raise InputError(f" = {self.height:g}: is more than the width", "height")


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_every_argument_of_a_case_is_checked(kind):
    unchecked = {name for name, one in arguments(kind).items() if not one.checks}
    assert unchecked <= OTHERWISE


def test_declarations_are_found_in_names_and_unions():
    found = arguments(Box)
    assert [one.key for one in found.values()] == ["width", "number", "tall", "tint"]
    assert [one.unit for one in found.values()] == ["m", "", "m", "K"]
    assert [len(one.checks) for one in found.values()] == [1, 1, 1, 0]


def test_values_are_kept_as_the_checks_return_them():
    box = Box(2, height=1)
    assert repr(box) == "Box(width=2.0, count=1, height=1.0, tint='')"
    assert Box(1.0) == Box(1, 1, None)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"width": None}, "box: width = None: must be a number (m)"),
        ({"width": 0}, "box: width = 0: must be greater than 0 m"),
        ({"width": 1, "count": None}, "box: count = None: must be a whole number, at least 1"),
        ({"width": 1, "height": 0}, "box: height = 0: must be greater than 0 m"),
        ({"width": 1, "height": 2}, "box: height = 2: is more than the width"),
    ],
)
def test_bad_values_are_refused(given, message):
    with pytest.raises(InputError) as caught:
        Box(**given)
    assert str(caught.value) == message


class Crate(Section):
    """A table that only files have.

    Parameters
    ----------
    boxes : table
        What is in it.
    """

    box: Annotated[Box, TableOf(Box)]
    boxes: Annotated[list[Box], ListOf(TableOf(Box))] = ()


def test_tables_are_read_by_the_same_declarations():
    crate = read(Crate, "", {"box": {"width": 2, "tall": 1}})
    assert crate.box == Box(2.0, 1, 1.0) and crate.stated == {"box"} and crate.boxes == ()
    assert read(Crate, "", {"box": {"width": 1}, "boxes": [{"width": 3}]}).boxes == [Box(3.0)]


def test_all_mistakes_of_a_file_are_told_with_their_places():
    bad = {"box": {"number": 0, "tall": -1}, "boxes": [{"width": 1, "tall": 2}, {"widht": 1}, 3]}
    with pytest.raises(InputError) as caught:
        read(Crate, "", bad)
    assert str(told(caught.value, "crate.toml")).split("\n  also ") == [
        "crate.toml: boxes[1].widht: unknown key; did you mean 'width'? known keys: width, number, "
        "tall, tint",
        "box.width: missing; give it (m)",
        "box.number = 0: must be a whole number, at least 1",
        "box.tall = -1: must be greater than 0 m",
        "boxes[0].tall = 2: is more than the width",
        "boxes[2] = 3: must be a table",
    ]


def test_the_schema_of_a_table_has_types_limits_and_texts():
    definitions: dict[str, Schema] = {}
    assert schema_of(Crate, definitions) == {"$ref": "#/definitions/Crate"}
    box, crate = definitions["Box"], definitions["Crate"]
    assert box["required"] == ["width"] and not box["additionalProperties"]
    assert box["properties"]["number"] == {"type": "integer", "minimum": 1, "default": 1}
    assert box["properties"]["tall"] == {"type": "number", "exclusiveMinimum": 0.0}
    assert crate["properties"]["boxes"]["items"] == {"$ref": "#/definitions/Box"}
    assert crate["properties"]["boxes"]["description"] == "What is in it."
