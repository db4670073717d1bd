"""OPX, ORIPA's own crease patterns, as Java's XMLEncoder writes them.

Each line is an object of the class ``oripa.OriLineProxy`` with x0, y0, x1, y1 and a type (1 the
outline, 2 a mountain, 3 a valley, 4 and 0 flat); values of 0 are left out. y points down, as in CP
files. Source of the format: fold's src/oripa.coffee (https://github.com/edemaine/fold).
"""

from __future__ import annotations

from xml.etree.ElementTree import Element

from foldyn.errors import InputError
from foldyn.formats.cp import LETTERS
from foldyn.formats.drawing import Drawing, coordinate
from foldyn.formats.xml_text import from_xml, local
from foldyn.values import show

_COORDINATES = ("x0", "y0", "x1", "y1")


def read(text: str) -> Drawing:
    """Lines of an OPX file.

    Parameters
    ----------
    text : str
        The file's content.

    Returns
    -------
    Drawing
        In the file's unit, with y up.

    Raises
    ------
    InputError
        The text is not OPX, or a line is invalid; the message names it.
    """
    root = from_xml(text, "an OPX file")
    objects = [element for element in root.iter() if local(element) == "object"]
    objects = [one for one in objects if one.get("class", "").rpartition(".")[2] == "OriLineProxy"]
    if not objects:
        raise InputError(": there are none (of the class OriLineProxy)", "lines")
    letters: list[str] = []
    points: list[tuple[float, float]] = []
    for number, element in enumerate(objects):
        values = _properties(element)
        kind = values.get("type", "0")
        if kind not in LETTERS:
            raise InputError(
                f" = {show(kind)}: give 1 (outline), 2 (mountain), 3 (valley) or 4 (flat)",
                f"lines[{number}].type",
            )
        letters.append(LETTERS[kind])
        x0, y0, x1, y1 = (
            coordinate(values.get(name, "0"), f"lines[{number}].{name}") for name in _COORDINATES
        )
        points += [(x0, -y0), (x1, -y1)]
    return Drawing.of_lines(points, letters, assumed=1e-3, name=_title(root))


def _properties(element: Element) -> dict[str, str]:
    """Text of the properties of an object."""
    return {
        child.get("property", ""): (value.text or "").strip()
        for child in element
        for value in list(child)[:1]
    }


def _title(root: Element) -> str:
    titles = (own["title"] for element in root.iter() if "title" in (own := _properties(element)))
    return " ".join(next(titles, "").split())[:200]
