"""Units of length that pattern files name."""

from __future__ import annotations

from typing import Any

from foldyn.errors import InputError
from foldyn.values import choice, number

METERS = {
    "m": 1.0,
    "cm": 1e-2,
    "mm": 1e-3,
    "um": 1e-6,
    "nm": 1e-9,
    "km": 1e3,
    "in": 0.0254,
    "ft": 0.3048,
    "pt": 0.0254 / 72,
    "px": 0.0254 / 96,
}
"""Lengths (m)."""


def chosen(unit: Any, scale: Any) -> float | None:
    """Length (m) of the unit that a user gives by name or as a number, or None.

    Raises
    ------
    InputError
        Both are given, an unknown unit, or a scale that is no length.
    """
    if unit is not None and scale is not None:
        raise InputError(": give unit or scale, not both", "scale")
    if unit is not None:
        return METERS[choice("unit", unit, METERS)]
    return None if scale is None else number("scale", scale, above=0.0, unit="m")
