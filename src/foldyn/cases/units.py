"""Units of case-file keys, as declared by the arguments of data classes."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

from foldyn.arguments import arguments
from foldyn.cases.air import Air
from foldyn.cases.contact import Contact, Plane
from foldyn.cases.damping import DAMPINGS
from foldyn.cases.histories import HISTORIES
from foldyn.cases.loads import LOADS
from foldyn.cases.masses import PointMass
from foldyn.cases.supports import SUPPORTS
from foldyn.materials import HINGE_LAWS
from foldyn.structures import ModelOptions, Sheet

OTHERS: Mapping[str, str] = {
    "velocity": "m/s", "dihedral": "degrees", "panel_angle": "degrees", "twist": "degrees",
}  # fmt: skip
"""Units of keys that are not arguments of data classes."""


@cache
def units() -> dict[str, str]:
    """Units by key."""
    parts = (Sheet, ModelOptions, *SUPPORTS, *LOADS, *DAMPINGS, PointMass, Contact, Plane, Air)
    kinds = (*parts, *HISTORIES.values(), *HINGE_LAWS.values())
    found = {one.key: one.unit for kind in kinds for one in arguments(kind).values() if one.unit}
    return {**found, **OTHERS}


def unit_of(key: str, value: Any) -> str:
    """Unit of the value of a key; "" if the value has no unit or is a word."""
    return "" if isinstance(value, str) else units().get(key, "")
