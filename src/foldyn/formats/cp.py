"""CP, the crease patterns of ORIPA, Oriedita and Orihime: a line of text for each drawn line.

Each line of text has five numbers, ``type x1 y1 x2 y2``: type 1 the outline or a cut, 2 a mountain,
3 a valley, 4 (and 0) an auxiliary line, which is flat. y points down, as on the screen of these
programs (Oriedita's DxfExporter.java turns it over); their paper is 400 units wide, taken as
millimeters.
"""

from __future__ import annotations

import numpy as np

from foldyn.errors import InputError
from foldyn.formats.drawing import Drawing, coordinate
from foldyn.formats.writers import flat_points, letters, warn_of_angles
from foldyn.patterns import Pattern
from foldyn.values import show

LETTERS = {"0": "F", "1": "B", "2": "M", "3": "V", "4": "F"}
KINDS = {"B": 1, "C": 1, "M": 2, "V": 3, "F": 4, "U": 4}
PER_METER = 1e3


def read(text: str) -> Drawing:
    """Lines of a CP file.

    Parameters
    ----------
    text : str
        The file's content. Empty lines, and text after "#", are ignored.

    Returns
    -------
    Drawing
        In the file's unit, with y up.

    Raises
    ------
    InputError
        A line of text does not describe a line of a crease pattern; the message names it.
    """
    kinds: list[str] = []
    points: list[tuple[float, float]] = []
    places: list[str] = []
    for row, line in enumerate(text.splitlines(), 1):
        words = line.partition("#")[0].replace(",", " ").split()
        if not words:
            continue
        place = f"line {row}"
        if len(words) != 5 or words[0] not in LETTERS:
            raise InputError(
                f" = {show(line)}: give a type (1 outline, 2 mountain, 3 valley, 4 flat) and four "
                "coordinates, as `2 0 0 100 50`",
                place,
            )
        x1, y1, x2, y2 = (coordinate(word, place, line) for word in words[1:])
        kinds.append(LETTERS[words[0]])
        points += [(x1, -y1), (x2, -y2)]
        places.append(place)
    if not kinds:
        raise InputError(": there are none; give a file with a crease pattern", "lines")
    return Drawing.of_lines(points, kinds, assumed=1e-3, places=tuple(places))


def write(pattern: Pattern) -> str:
    """Text of a CP file: kind, x1, y1, x2, y2, with y downwards as on the screen.

    Parameters
    ----------
    pattern : Pattern
        A flat pattern. The format has only boundary, mountain, valley and auxiliary lines; facets
        and unassigned creases become auxiliary.

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
