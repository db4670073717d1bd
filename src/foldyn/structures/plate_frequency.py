"""The frequency above which panels vibrate as plates, whatever their creases do."""

from __future__ import annotations

import numpy as np

from foldyn.patterns import Pattern
from foldyn.structures.sheet import Sheet

FIRST_OF_A_SQUARE = 13.47  # omega L^2 sqrt(rho t/G) of a free square plate, nu = 0.3 (Leissa 1973)
BELOW = 0.6  # of the plate frequency: where bars and hinges have the modes of a sheet


def plate_frequency(pattern: Pattern, sheet: Sheet) -> float:
    """First frequency (Hz) of a free square plate as large as a panel.

    Its side is the panel's longest edge, or the root of its area where that is longer: with five
    corners and more. Of all panels the lowest one; nan of a sheet without density.
    """
    count, x = len(pattern.faces), pattern.vertices
    speed = (sheet.values("bending_modulus", count) / sheet.values("areal_density", count)) ** 0.5
    sides = (x[list(face)] - np.roll(x[list(face)], 1, axis=0) for face in pattern.faces)
    longest = np.array([np.linalg.norm(side, axis=1).max() for side in sides])
    side2 = np.maximum(longest**2, pattern.face_areas)
    return float((FIRST_OF_A_SQUARE / (2.0 * np.pi) * speed / side2).min())
