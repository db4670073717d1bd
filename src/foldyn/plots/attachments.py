"""Marks of attachments to a sheet: springs, clamped edges, masses, dashpots, and tied nodes."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.patches import Patch

from foldyn import cases
from foldyn.cases.directions import unit_vector
from foldyn.cases.selection import resolve_creases, resolve_nodes
from foldyn.mechanics.lines import GROUND
from foldyn.patterns.topology import around, edge_of
from foldyn.plots import marks, style
from foldyn.plots.marks import Mark
from foldyn.plots.scene import Points, Sheet3D, View

_TURNS = (4, 14)  # smallest and largest number of turns of a zigzag
_LEAD = 0.2  # length of each straight end of a zigzag, relative to its whole length
_HATCHES = 8  # hatches of a clamped edge


def springs_and_masses(
    sheet: Sheet3D, points: Points, size: float, view: View, supports: bool, loads: bool
) -> list[Mark]:
    """Marks of springs, clamped edges and point masses of a case at node positions (n, 3).

    size : length of a support's mark, m.
    supports : whether springs and clamps are shown.
    loads : whether point masses are shown.
    """
    case, found = sheet.case, []
    clamped = getattr(sheet.structure.options, "clamped", ()) if supports else ()
    if clamped:
        hatches = _hatched(sheet, points, clamped, 0.7 * size)
        look = {"facecolor": "white", "edgecolor": style.SUPPORT, "hatch": "////", "linewidth": 0.0}
        key = Patch(label="clamped edge", **look)
        found.append(Mark(style.SUPPORT, [key], [hatches], zorder=6.2, width=1.3))
    springs = [
        line[None]
        for i, part in enumerate(case.supports if supports else ())
        if isinstance(part, cases.Spring)
        for line in _of_part(sheet, points, part, f"supports[{i}]", size, view)
    ]
    polylines = case.polylines() if supports else ()
    for kind, text, width in ((cases.Bar, "bar", 2.2), (cases.Cable, "cable", 1.1)):
        lines = [
            np.where(node[:, None] < 0, x, points[node])[None]
            for _, part, node, x in polylines
            if isinstance(part, kind)
        ]
        if lines:
            key = style.key(text, color=style.SPRING, linewidth=width)
            found.append(Mark(style.SPRING, [key], lines, zorder=6.5, width=width))
    if springs:
        key = style.key("spring", color=style.SPRING, linewidth=1.1)
        found.append(Mark(style.SPRING, [key], springs, zorder=6.5, width=1.1))
    for kind, text, marker in ((cases.Stop, "end stop", "s"), (cases.Latch, "latch", "D")):
        chosen = [
            resolve_creases(sheet.structure, part.creases)
            for part in (case.supports if supports else ())
            if isinstance(part, kind)
        ]
        if chosen:
            ends = sheet.structure.pattern.creases[np.unique(np.concatenate(chosen))]
            look = {"marker": marker, "markersize": 5.5, "markeredgecolor": "white"}
            key = style.key(text, color=style.SUPPORT, linestyle="none", **look)
            dots = points[ends].mean(axis=1)
            found.append(Mark(style.SUPPORT, [key], dots=dots, zorder=7.5, look=look))
    if loads and case.masses:
        there = np.flatnonzero(case.point_masses)
        own = case.point_masses[there]
        sizes = np.round(4.0 + 5.0 * np.cbrt(own / own.max()), 1)
        span = " to ".join(dict.fromkeys(f"{value:.3g}" for value in (own.min(), own.max())))
        dot = {"marker": "o", "linestyle": "none", "markersize": 7.0}
        keys = [style.key(f"point mass, {span} kg", color=style.MASS, **dot)]
        for size_ in np.unique(sizes):
            look = {"marker": "o", "markersize": size_, "markeredgecolor": "white"}
            dots = points[there[sizes == size_]]
            found.append(Mark(style.MASS, keys, dots=dots, zorder=8.0, look=look))
            keys = []
    return found


def _of_part(
    sheet: Sheet3D, points: Points, spring: cases.Spring, place: str, size: float, view: View
) -> list[Points]:
    """Zigzags of the springs of a support."""
    axes, lines = spring.directions, []
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    for a, b in spring.ends(sheet.structure, place).tolist():
        if b != GROUND:
            lines.append(_zigzag(points[a], points[b], 0.3 * size, view))
            continue
        for axis in np.zeros((0, 3)) if axes is None else axes:
            outside = axis if axis @ (points[a] - middle) > 0.05 * size and not axis[2] else -axis
            foot = points[a] + 1.5 * size * outside * (np.sign(axis[2]) or 1.0)
            lines.append(_zigzag(points[a], foot, 0.3 * size, view))
            across = 0.35 * size * view.across(foot - points[a])
            lines.append(np.array([foot - across, foot + across]))  # the ground
    return lines


def _zigzag(start: Points, end: Points, width: float, view: View) -> Points:
    """A spring (p, 3) from one point to another."""
    line = end - start
    turns = int(np.clip(np.linalg.norm(line) / width, *_TURNS))
    inner = _LEAD + (1.0 - 2.0 * _LEAD) * np.arange(2 * turns + 1) / (2 * turns)
    offset = np.where(np.arange(2 * turns + 1) % 2, 0.5, -0.5)
    offset[[0, -1]] = 0.0
    share = np.concatenate([[0.0], inner, [1.0]])
    offset = np.concatenate([[0.0], offset, [0.0]])
    return start + share[:, None] * line + width * offset[:, None] * view.across(line)


def _hatched(sheet: Sheet3D, points: Points, edges: Any, size: float) -> Points:
    """Hatches outside clamped edges."""
    faces = {edge_of(a, b): face for face in sheet.pattern.faces for a, b in around(face)}
    lines = []
    for a, b in edges:
        along = points[b] - points[a]
        unit = along / np.linalg.norm(along)
        inward = points[list(faces[edge_of(a, b)])].mean(axis=0) - points[a]
        outward = -(inward - (inward @ unit) * unit)
        outward *= size / np.linalg.norm(outward)
        for share in np.linspace(0.0, 1.0, _HATCHES):
            start = points[a] + share * along
            lines.append([start, start + outward - 0.5 * size * unit])
    return np.array(lines).reshape(-1, 2, 3)


def direction_triangles(
    case: cases.Case, kind: type[cases.Fix | cases.Impose], points: Points, size: float, sight: View
) -> Points:
    """Triangles (k, 3, 3) at nodes held along directions by one kind, `Fix` or `Impose`."""
    middle, found = points.mean(axis=0), []
    for support in case.supports:
        if not isinstance(support, kind) or support.direction is None:
            continue
        nodes, unit = resolve_nodes(case.structure, support.nodes), unit_vector(support.direction)
        values = np.broadcast_to(getattr(support, "value", 0.0), (len(nodes),))
        for node, value in zip(nodes, values, strict=True):
            # the triangle pushes a moving node; otherwise it stands below or outside the sheet
            outward = unit[2] if abs(unit[2]) > 1e-9 else unit @ (middle - points[node])
            along = unit * (np.sign(value) or np.sign(outward) or 1.0)
            found.append(marks.billboard(points[node], along, size, 0.38 * size, sight))
    return np.array(found).reshape(-1, 3, 3)


def links(case: cases.Case, points: Points) -> list[Mark]:
    """Lines from the first of some linked nodes to the others, or from riders to carriers."""
    segments, tied = [], []
    for support in case.supports:
        if isinstance(support, cases.Link):
            nodes = resolve_nodes(case.structure, support.nodes).tolist()
            first, others = ([nodes[0]], nodes[1:]) if support.to is None else (support.to, nodes)
            segments += [[points[a], points[b]] for a in first for b in others]
            tied += [points[node] for node in nodes]
    if not tied:
        return []
    look = {"marker": "o", "markersize": 5.0, "markerfacecolor": "none"}
    key = style.key("link (nodes tied together)", color=style.LINK, linestyle="dotted", **look)
    lines, dots = np.array(segments), np.array(tied)
    return [
        Mark(style.LINK, [key], [lines], dots=dots, zorder=6.5, width=1.4, dashes="dotted",
             look=look)
    ]  # fmt: skip


CUP = (-0.5, 0.5)  # start and end of the cup along the line, relative to the cup's length
PISTON = 0.1  # position of the piston along the line, relative to the cup's length
SHARE = 0.4  # largest part of the line that the cup takes
HALF = 0.45  # half of the cup's width, relative to its length
REACH = 1.8  # length of the line from a node to the ground, in cups


def dashpot_lines(case: cases.Case, points: Points, size: float, view: View) -> Points:
    """Segments (k, 2, 3) of the symbols of all dashpots of a case, at node positions (n, 3).

    size : length of a cup, m.
    """
    segments: list[Points] = []
    for place, dashpot in case.dashpots:
        direction = dashpot.direction  # to the ground: along this, or else below the node
        along = np.array([0.0, 0.0, -1.0]) if direction is None else unit_vector(direction)
        for a, b in dashpot.ends(case.structure, place).tolist():
            end = points[a] + REACH * size * along if b == GROUND else points[b]
            segments += _symbol(points[a], end, size, view, b == GROUND)
    return np.array(segments).reshape(-1, 2, 3)


def describe_dashpot(dashpot: cases.Dashpot) -> str:
    """Describe a dashpot in words: how strong it is, and what it connects."""
    to = "to the ground" if dashpot.between is None else "between nodes"
    return f"dashpot {dashpot.coefficient:.4g} N s/m {to}"


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
