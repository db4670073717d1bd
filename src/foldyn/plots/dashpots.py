"""Dashpots in pictures: a cup and a piston, to another node or to the ground."""

from __future__ import annotations

import numpy as np

from foldyn.cases import Case, Dashpot
from foldyn.cases.directions import unit_vector
from foldyn.mechanics.springs import GROUND
from foldyn.plots.scene import Points, View

CUP = (-0.5, 0.5)  # start and end of the cup along the line, relative to its length
PISTON = 0.1  # position of the piston
SHARE = 0.4  # largest part of the line that the cup takes
HALF = 0.45  # width of the cup, relative to twice its length
REACH = 1.8  # length of the line from a node to the ground, in cups


def dashpot_lines(case: Case, points: Points, size: float, view: View) -> Points:
    """Segments (k, 2, 3) of all dashpots of a case, at node positions (n, 3).

    size : length of a cup, m.
    """
    segments: list[Points] = []
    for place, dashpot in case.dashpots:
        for a, b in dashpot.ends(case.structure, place).tolist():
            grounded = b == GROUND
            end = _ground(dashpot, points[a], size) if grounded else points[b]
            segments += _symbol(points[a], end, size, view, grounded)
    return np.array(segments).reshape(-1, 2, 3)


def describe_dashpot(dashpot: Dashpot) -> str:
    """Describe a dashpot in words: how strong it is, and what it connects."""
    to = "to the ground" if dashpot.between is None else "between nodes"
    return f"dashpot {dashpot.coefficient:.4g} N s/m {to}"


def _ground(dashpot: Dashpot, node: Points, size: float) -> Points:
    """Position of the ground: along the direction, or below."""
    down = np.array([0.0, 0.0, -1.0])
    along = down if dashpot.direction is None else unit_vector(dashpot.direction)
    return node + REACH * size * along


def _symbol(start: Points, end: Points, size: float, view: View, grounded: bool) -> list[Points]:
    length = float(np.linalg.norm(end - start))
    if length <= 0.0:
        return []
    along = (end - start) / length
    cup = min(size, SHARE * length)
    middle, half = 0.5 * (start + end), HALF * cup * view.across(along)
    bottom, top = (middle + at * cup * along for at in CUP)
    piston = middle + PISTON * cup * along
    lines = [
        (start, bottom),
        (bottom - half, bottom + half),
        (bottom - half, top - half),
        (bottom + half, top + half),
        (piston - 0.7 * half, piston + 0.7 * half),
        (piston, end),
    ]
    if grounded:
        lines.append((end - 1.3 * half, end + 1.3 * half))
    return [np.array(line) for line in lines]
