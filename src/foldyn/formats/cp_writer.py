"""CP crease patterns (ORIPA, Oriedita) as they are written: a line for each edge."""

from __future__ import annotations

import numpy as np

from foldyn.formats.writers import flat_points, letters, warn_of_angles
from foldyn.patterns import Pattern

KINDS = {"B": 1, "C": 1, "M": 2, "V": 3, "F": 4, "U": 4}
PER_METER = 1e3


def write(pattern: Pattern) -> str:
    """Text of a CP file: kind, x1, y1, x2, y2, with the y of the screen, which runs down.

    Parameters
    ----------
    pattern : Pattern
        A flat one; the format knows boundary, mountain, valley and auxiliary lines alone, so that
        facets and unassigned creases become the last.

    Returns
    -------
    str

    Raises
    ------
    InputError
        The pattern is folded.
    """
    warn_of_angles(pattern, "CP")
    points = (PER_METER * flat_points(pattern, "CP") * np.array([1.0, -1.0])).tolist()
    lines = [
        f"{KINDS[letter]} " + " ".join(map(repr, [*points[a], *points[b]]))
        for (a, b), letter, _ in letters(pattern)
    ]
    return "\n".join(lines) + "\n"
