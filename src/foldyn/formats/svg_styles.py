"""Styles of SVG elements: attributes, style sheets and inheritance, as far as lines need them."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from xml.etree.ElementTree import Element

from foldyn.errors import InputError
from foldyn.formats.drawing import read_number
from foldyn.formats.line_colors import RGB
from foldyn.formats.svg_shapes import SHAPES
from foldyn.formats.xml_text import local
from foldyn.values import choice, show

PROPERTIES = (
    "stroke", "stroke-opacity", "opacity", "display", "visibility", "color", "transform",
    "transform-origin", "transform-box",
)  # fmt: skip
_MOVING = ("translate", "rotate", "scale", "zoom")
_UNMOVED = ("none", "auto", "normal", "1", "100%")
_SHAPING = ("d", "x", "y", "width", "height", "cx", "cy", "r", "rx", "ry")
"""CSS properties that are only read as attributes."""
ASSIGNMENT, ANGLE = "data-assignment", "data-foldangle"
"""Attributes in which programs for FOLD files store the kind of a line."""
_SELECTOR = re.compile(r"(\*|[A-Za-z][\w-]*)?((?:[.#][\w-]+)*)")
_HEX = re.compile(r"#(?:[0-9a-f]{3,4}|[0-9a-f]{6}|[0-9a-f]{8})")
_COMMENT = re.compile(r"/\*.*?(?:\*/|\Z)", re.DOTALL)
_LONGEST = 200  # longest value, in characters


@dataclass(frozen=True)
class Style:
    """Drawing style of an element's lines.

    Attributes
    ----------
    color : (int, int, int) or None
        Red, green and blue of the stroke, 0 to 255; None if lines are not drawn.
    opacity : float
        Opacity of the stroke, multiplied by the opacity of enclosing groups.
    stated : bool
        Whether any opacity is given.
    visible : bool
        Whether the element itself is visible; parts of a hidden group may be visible.
    current : (int, int, int)
        Value of "currentColor".
    """

    color: RGB | None = None
    opacity: float = 1.0
    stated: bool = False
    visible: bool = True
    current: RGB = (0, 0, 0)
    own: float = 1.0  # stroke-opacity, which is inherited; opacities of groups multiply
    letter: str = ""  # letter of the line, if an attribute gives it
    angle: float = math.nan  # fold angle in degrees, if an attribute gives it

    @property
    def shown(self) -> bool:
        """Whether the element has visible lines."""
        drawn = self.color is not None or bool(self.letter)
        return self.visible and drawn and self.opacity * self.own > 0.0


Rules = list[tuple[tuple[int, int], str, str, frozenset[str], dict[str, str]]]
"""Style rules in order: (specificity), tag, id, classes, declarations."""


def declarations(text: str) -> dict[str, str]:
    """Values of relevant properties in a text such as "stroke:#f00; opacity: 0.5"."""
    found = {}
    for declaration in text.split(";"):
        name, _, value = declaration.partition(":")
        if name.strip().lower() in (*PROPERTIES, *_MOVING, *_SHAPING):
            found[name.strip().lower()] = value.partition("!")[0].strip()
    return found


def rules_of(text: str) -> tuple[Rules, int]:
    """Rules of a style sheet, weakest first, and the number of unsupported rules."""
    rules: Rules = []
    left = 0
    for order, block in enumerate(_COMMENT.sub("", text).split("}")):
        selectors, brace, body = block.rpartition("{")
        found = declarations(body)
        if not brace or not found:
            continue
        for selector in selectors.rpartition("{")[2].split(","):
            match = _SELECTOR.fullmatch(selector.strip()[:_LONGEST])
            if not match or not selector.strip():
                left += 1
                continue
            names = re.findall(r"([.#])([\w-]+)", match[2])
            ids = [name for kind, name in names if kind == "#"]
            classes = frozenset(name for kind, name in names if kind == ".")
            tag = match[1] if match[1] not in (None, "*") else ""
            weight = 100 * len(ids) + 10 * len(classes) + (1 if tag else 0)
            rules.append(((weight, order), tag, ids[0] if ids else "", classes, found))
    return sorted(rules, key=lambda rule: rule[0]), left


def styled(given: Mapping[str, str], inherited: Style, place: str) -> Style | None:
    """Style of an element from its declarations, within the parent's style.

    None if nothing in it is displayed.

    Raises
    ------
    InputError
        A value is invalid; the message names the place.
    """
    if given.get("display") == "none":
        return None
    style = inherited
    if ASSIGNMENT in given:
        letter = choice(f"{place}.{ASSIGNMENT}", given[ASSIGNMENT].upper(), "BMVFUCJ")
        style = replace(style, letter=letter)
    if ANGLE in given:
        angle = read_number(given[ANGLE], f"{place}.{ANGLE}", "give degrees")
        style = replace(style, angle=angle)
    if "visibility" in given and given["visibility"] != "inherit":
        style = replace(style, visible=given["visibility"] == "visible")
    if given.get("color", "inherit") not in ("inherit", "currentColor"):
        style = replace(style, current=_rgba(given["color"], style, place)[0] or (0, 0, 0))
    if given.get("stroke", "inherit") != "inherit":
        color, alpha = _rgba(given["stroke"], style, place)
        style = replace(style, color=color)
        if alpha < 1.0:
            style = replace(style, own=alpha, stated=True)
    if given.get("stroke-opacity", "inherit") != "inherit":
        own = _share(given["stroke-opacity"], f"{place}.stroke-opacity")
        style = replace(style, own=own, stated=True)
    if given.get("opacity", "inherit") != "inherit":
        share = _share(given["opacity"], f"{place}.opacity")
        style = replace(style, opacity=style.opacity * share, stated=True)
    return style


def declared(element: Element, rules: Rules, place: str) -> Mapping[str, str]:
    """Declarations on looks and place from attributes, rules and the style of an element.

    Raises
    ------
    InputError
        CSS moves or shapes the element by a property that is only supported as an attribute.
    """
    given = {name: element.get(name, "").strip() for name in PROPERTIES if element.get(name)}
    css: dict[str, str] = {}
    if rules:
        tag, name = local(element), element.get("id", "")
        classes = set(element.get("class", "").split())
        for _, rule_tag, rule_id, rule_classes, found in rules:
            if rule_tag in ("", tag) and rule_id in ("", name) and rule_classes <= classes:
                css |= found
    css |= declarations(element.get("style", ""))
    shaped = _SHAPING if local(element) in (*SHAPES, "use") else ()
    for name in (*_MOVING, *shaped):
        if css.get(name, "none") not in (_UNMOVED if name == "zoom" else _UNMOVED[:2]):
            how = 'a "transform"' if name in _MOVING else "an attribute"
            raise InputError(
                f" = {show(css[name])}: is not read from CSS; write it as {how}", f"{place}.{name}"
            )
    said = {key.lower(): value.strip() for key, value in element.attrib.items()}
    return given | css | {name: said[name] for name in (ASSIGNMENT, ANGLE) if said.get(name)}


def _rgba(value: str, style: Style, place: str) -> tuple[RGB | None, float]:
    """Color and opacity of a paint; gradients count as black."""
    from svgelements import Color

    word = value.lower()
    if word in ("none", "transparent", ""):
        return None, 1.0
    if word == "currentcolor":
        return style.current, 1.0
    if word.startswith("url("):
        return (0, 0, 0), 1.0
    color = None
    if len(word) <= _LONGEST and (not word.startswith("#") or _HEX.fullmatch(word)):
        try:
            color = Color(word)
        except (ValueError, TypeError, IndexError, AttributeError, OverflowError):
            color = None
    # svgelements returns black for unknown colors too
    black = word == "black" or word.startswith(("#", "rgb", "hsl"))
    if color is None or color.value is None or (color.rgb == 0 and not black):
        raise InputError(f" = {show(value)}: is no color", f"{place}.stroke")
    return (color.red, color.green, color.blue), color.alpha / 255


def _share(value: str, place: str) -> float:
    share = read_number(value.removesuffix("%"), place, "give a number from 0 to 1")
    share = share / 100 if value.endswith("%") else share
    return min(1.0, max(0.0, share)) if share == share else 1.0
