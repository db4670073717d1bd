"""The table of rotational inertia errors in mass.md, computed.

`python docs/inertia_table.py` writes it anew; a test compares it with what the page shows.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np

from foldyn.errors import InputError
from foldyn.patterns import Pattern
from foldyn.structures import MASS_RULES, Sheet, Structure, discretize

PAGE = Path(__file__).with_name("mass.md")
SHEET = Sheet(youngs_modulus=1e6, poissons_ratio=0.3, thickness=0.01, density=1000.0)


def parallelogram(a: float, b: float, angle: float) -> Pattern:
    """One panel with edges a and b and an acute angle (degrees)."""
    x, y = b * math.cos(math.radians(angle)), b * math.sin(math.radians(angle))
    return Pattern([[0, 0], [a, 0], [a + x, y], [x, y]], [[0, 1, 2, 3]])


TRIANGLE = Pattern([[0, 0], [1, 0], [0.5, math.sqrt(0.75)]], [[0, 1, 2]])
TRAPEZOID = Pattern([[0, 0], [2, 0], [1.5, 1], [0.5, 1]], [[0, 1, 2, 3]])
PANELS: dict[str, tuple[Pattern, str]] = {
    "square": (parallelogram(1, 1, 90), "n5b8"),
    "rhombus 60°": (parallelogram(1, 1, 60), "n5b8"),
    "parallelogram 1 x 2, 60°": (parallelogram(1, 2, 60), "n5b8"),
    "parallelogram 1 x 4, 30°": (parallelogram(1, 4, 30), "n5b8"),
    "trapezoid 2, 1, height 1": (TRAPEZOID, "n5b8"),
    "rhombus 60°, N4B5": (parallelogram(1, 1, 60), "n4b5"),
    "equilateral triangle": (TRIANGLE, "n5b8"),
}


def rotational_inertia(structure: Structure, start: int, end: int) -> float:
    """Moment of inertia (kg m2) about the line through two nodes."""
    axis = structure.nodes[end] - structure.nodes[start]
    axis = axis / np.linalg.norm(axis)
    away = np.cross(structure.center_of_mass - structure.nodes[start], axis)
    return float(axis @ structure.inertia @ axis + structure.total_mass * (away @ away))


def errors(rule: str, pattern: Pattern, scheme: str) -> list[float]:
    """Relative error of the rotational inertia about each edge of a one-panel pattern."""
    structure = discretize(pattern, SHEET, scheme=scheme, mass=rule)
    exact = discretize(pattern, SHEET, scheme=scheme, mass="consistent")
    return [
        rotational_inertia(structure, a, b) / rotational_inertia(exact, a, b) - 1.0
        for a, b in pattern.edges.tolist()
    ]


def cell(rule: str, pattern: Pattern, scheme: str) -> str:
    """Error in percent, as a range where it differs from edge to edge."""
    try:
        found = [round(100 * error, 1) + 0.0 for error in errors(rule, pattern, scheme)]
    except InputError:
        return "refused"
    low, high = min(found), max(found)
    if low == high:
        return f"{low:+.1f}" if low else "0"
    return f"{low:+.1f} to {high:+.1f}"


def table() -> str:
    """The table in Markdown, errors in percent."""
    lines = ["| rule | " + " | ".join(PANELS) + " |", "|---" * (len(PANELS) + 1) + "|"]
    for rule in MASS_RULES:
        cells = [cell(rule, *panel) for panel in PANELS.values()]
        lines.append(f"| {rule} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def with_table(text: str) -> str:
    """The page's text with the table between its marks."""
    begin, end = "<!-- inertia table: begin -->", "<!-- inertia table: end -->"
    return re.sub(f"{begin}.*?{end}", f"{begin}\n{table()}\n{end}", text, flags=re.S)


if __name__ == "__main__":
    PAGE.write_text(with_table(PAGE.read_text("utf-8")), "utf-8")
