"""Frequency above which panels vibrate as plates, independent of their creases."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from foldyn.patterns import Pattern
from foldyn.structures.discretized import Discretized
from foldyn.structures.rigid_plates import rigid_panels
from foldyn.structures.sheet import Sheet

FIRST_OF_A_SQUARE = 13.47  # omega L^2 sqrt(rho t/G) of a free square plate, nu = 0.3 (Leissa 1973)
BELOW = 0.6  # of the plate frequency: limit up to which bars and hinges have the sheet's modes
GIVING, AMPLITUDES = 0.8, 2.0  # the same for n5b8e, and for n5b8e with internal amplitudes


def plate_frequency(pattern: Pattern, sheet: Sheet, rigid: Collection[int] = ()) -> float:
    """First frequency (Hz) of a free square plate as large as a panel.

    The side is the panel's longest edge, or the root of its area if that is longer, as with five or
    more corners. Returns the lowest frequency of all panels that are not rigid; inf without any,
    nan for a sheet without density.
    """
    count, x = len(pattern.faces), pattern.vertices
    speed = (sheet.values("bending_modulus", count) / sheet.values("areal_density", count)) ** 0.5
    sides = (x[list(face)] - np.roll(x[list(face)], 1, axis=0) for face in pattern.faces)
    longest = np.array([np.linalg.norm(side, axis=1).max() for side in sides])
    side2 = np.maximum(longest**2, pattern.face_areas)
    frequency = FIRST_OF_A_SQUARE / (2.0 * np.pi) * speed / side2
    return float(np.delete(frequency, list(rigid)).min(initial=np.inf))


def range_of(structure: Discretized, internal: int = 0) -> tuple[float, float]:
    """Frequency (Hz) up to which a model has the sheet's modes, and its ratio to the plates' own.

    inf for shells and for structures made by hand.
    """
    if structure.kind != "bars_and_hinges" or structure.pattern is None:
        return np.inf, np.inf
    share = BELOW if structure.options.scheme != "n5b8e" else AMPLITUDES if internal else GIVING
    rigid = rigid_panels(structure.options.rigid, len(structure.pattern.faces))
    return share * plate_frequency(structure.pattern, structure.sheet, rigid), share
