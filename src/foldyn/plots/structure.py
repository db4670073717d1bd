"""Picture of a structure: panels, creases, node numbers, supports and loads."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from mpl_toolkits.mplot3d import Axes3D
from numpy.typing import ArrayLike

from foldyn.cases import Case, Fix, Impose, Pressure, Temperature
from foldyn.errors import InputError
from foldyn.patterns import Pattern
from foldyn.plots import attachments, load_curves, marks, scene, style
from foldyn.plots.marks import Mark
from foldyn.plots.scene import Points, Sheet3D, View
from foldyn.plots.sheet import DrawnSheet, add_undeformed, edge_keys, panel_keys, rest_keys
from foldyn.structures import Structure

_MOST_LOADS_LISTED = 4
_LEGEND_COLUMNS = 3


def draw_structure(
    case_or_structure: Case | Structure | Pattern | xr.Dataset,
    displacement: ArrayLike | None = None,
    *,
    numbers: bool | Literal["all"] = True,
    supports: bool = True,
    loads: bool = True,
    elements: bool = False,
    scale: float = 1.0,
    view: tuple[float, float] = (28.0, -60.0),
    title: str = "",
) -> Figure:
    """Draw a sheet in three dimensions with its supports and loads.

    Parameters
    ----------
    case_or_structure : Case, Structure or Pattern, or a result with its case
        Only a case has supports and loads.
    displacement : array_like, shape (n, 3), or None
        Node displacements (m): the deformed sheet is drawn, with the undeformed one behind in gray.
    numbers : bool or "all"
        Write the numbers of the pattern's vertices; "all" adds all other nodes.
    supports : bool
        Mark held and moved nodes by one triangle for each direction, and by the name of the
        direction if it is an axis. Arrows show displacements imposed on nodes, and on a moving base
        (from its middle). Springs are zigzags, dashpots a cup and a piston, clamped edges are
        hatched; dotted lines and rings show nodes that are linked.
    loads : bool
        Draw arrows: from each loaded node along its force, with the full length at the largest
        load; from each panel under pressure; two about each crease with a moment, towards the
        panels if the moment opens the crease; and one from the center of mass along gravity.
        Actuated creases are highlighted, point masses are dots, and panels that are warmed have
        stars.
    elements : bool
        Draw the bars inside the panels too, or the sides of a shell's triangles.
    scale : float
        Factor on the displacement in the picture.
    view : tuple of float
        Elevation above the xy plane and azimuth around z (degrees).
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        One orthographic view at equal scale, with the legend below.

    Raises
    ------
    InputError
        The displacement has the wrong shape or contains NaN, or `numbers` is unknown.
    """
    if numbers not in (True, False, "all"):
        raise InputError(f'numbers: {numbers!r}; use True, False or "all"')
    sheet = Sheet3D.of(case_or_structure)
    points = sheet.nodes + scale * checked_displacement(sheet, displacement)
    sight = View(*view)
    if sheet.case is None:
        supports = loads = False
    size = sheet.size
    # Marks scale with the sheet, but must not cover the panels of a large sheet.
    edge = float(np.median(np.linalg.norm(np.ptp(sheet.nodes[sheet.edges], axis=1), axis=1)))
    marked = min(0.055 * size, 0.25 * edge)
    length = min(0.17 * size, 0.8 * edge)
    groups = _supports(sheet, points, marked, sight) if supports else []
    attached = attachments.springs_and_masses(sheet, points, marked, sight, supports, loads)
    arrows = _motions(sheet, points, length, sight) if supports else []
    arrows += _dashpots(sheet, points, 0.5 * length, sight) if supports else []
    arrows += _loads(sheet, points, length, sight) if loads else []
    others = _warm(sheet, points) if loads else []
    others += attachments.links(sheet.case, points) if supports and sheet.case else []
    shown = [*(group.mark for group in groups), *attached, *arrows, *others]
    triangles = np.concatenate([np.zeros((0, 3, 3)), *(group.mark.triangles for group in groups)])
    # The names of held directions stand beyond the feet of the triangles.
    feet = triangles[:, :1] + 1.6 * (triangles - triangles[:, :1])
    everything = [points, feet.reshape(-1, 3), *(mark.points for mark in shown)]
    if numbers:  # room for the labels above the highest nodes
        everything.append(points + np.array([0.0, 0.0, 0.06 * size]))
    keys: list[Any] = []
    if displacement is not None:
        everything.append(sheet.nodes)
        keys += rest_keys(scale)
    keys += [*edge_keys(sheet, elements, loads), *panel_keys(sheet)]
    keys += [key for mark in shown for key in mark.keys]

    columns = style.columns_that_fit(keys, scene.WIDTH, _LEGEND_COLUMNS)
    figure, axes = scene.view_figure(np.vstack(everything), sight, title, -(-len(keys) // columns))
    if displacement is not None:
        add_undeformed(axes, sheet)
    DrawnSheet(axes, sheet, points, sight, elements, loads)
    for mark in shown:
        mark.draw(axes)
    obstacles = [points, marks.along_lines(points[sheet.pieces])]
    obstacles += [marks.along_lines(line) for mark in arrows for line in mark.lines]
    obstacles += [marks.outline(part) for part in (triangles, *(mark.triangles for mark in arrows))]
    _write_labels(axes, sheet, points, numbers, groups, np.vstack(obstacles), sight)
    return style.finish(figure, keys, columns)


def checked_displacement(sheet: Sheet3D, displacement: ArrayLike | None) -> Points:
    """Return displacements of all nodes (n, 3), zero for None."""
    if displacement is None:
        return np.zeros_like(sheet.nodes)
    u = np.asarray(displacement, dtype=np.float64)
    if u.shape != sheet.nodes.shape:
        raise InputError(
            f"displacement: shape {u.shape}, but the structure has {len(sheet.nodes)} nodes; "
            f"give shape {sheet.nodes.shape}"
        )
    if not np.isfinite(u).all():
        raise InputError("displacement: contains NaN or infinity; draw an earlier state")
    return u


class _Supports(NamedTuple):
    """Marks of one kind of support, and for labels the axes held at each node and the color."""

    mark: Mark
    axes: list[tuple[int, str]]
    ink: str


def _supports(sheet: Sheet3D, points: Points, size: float, sight: View) -> list[_Supports]:
    """Marks of held nodes and of moved nodes."""
    fixed, imposed = np.asarray(sheet.case.fixed), np.asarray(sheet.case.imposed)
    moves = sum((vectors for vectors, _ in sheet.case.prescribed_terms), np.zeros(points.shape))
    kinds = [
        (Fix, fixed & ~imposed, style.SUPPORT, style.SUPPORT, "support (directions held)"),
        (Impose, imposed, style.IMPOSED, style.IMPOSED_TEXT, "imposed displacement (directions)"),
    ]
    groups = []
    for kind, mask, color, ink, text in kinds:
        straight, axes = marks.support_triangles(points, mask, size, sight, moves)
        oblique = attachments.direction_triangles(sheet.case, kind, points, size, sight)
        if len(straight) or len(oblique):
            triangles = np.concatenate([straight, oblique])
            keys = [Patch(facecolor=color, label=text)]
            groups.append(_Supports(Mark(color, keys, (), triangles, zorder=5.5), axes, ink))
    return groups


def _motions(sheet: Sheet3D, points: Points, length: float, sight: View) -> list[Mark]:
    """Arrows of imposed displacements, and of the base (at the mean position of its nodes)."""
    imposed = [
        (points, vectors, f"moved {load_curves.describe(vectors, 'm')}")
        for vectors, _ in sheet.case.prescribed_terms
    ]
    base = []
    for vectors, _ in sheet.case.base_terms:
        moved = load_curves.base_vectors(sheet.case, vectors)
        peak = load_curves.signed_peak(moved)
        middle = points[moved.any(axis=1)].mean(axis=0)
        text = load_curves.describe_vector("base moved", peak, "m")
        base.append((middle[None], peak[None], text))
    moved = _arrows(imposed, length, sight, style.IMPOSED)
    return [*moved, *_arrows(base, length, sight, style.BASE)]


def _dashpots(sheet: Sheet3D, points: Points, size: float, sight: View) -> list[Mark]:
    """Mark of all dashpots, with their legend entries."""
    lines = attachments.dashpot_lines(sheet.case, points, size, sight)
    if not len(lines):
        return []
    texts = dict.fromkeys(attachments.describe_dashpot(one) for _, one in sheet.case.dashpots)
    keys = [style.key(text, color=style.DASHPOT, linewidth=1.8) for text in texts]
    return [Mark(style.DASHPOT, keys[:_MOST_LOADS_LISTED], [lines])]


def _loads(sheet: Sheet3D, points: Points, length: float, sight: View) -> list[Mark]:
    """Arrows of forces, pressure and moments, and of gravity at the center of mass."""
    case, vertices = sheet.case, len(sheet.pattern.vertices)
    forces = [(points, f, load_curves.describe(f, "N")) for f, _ in case.force_terms]
    pressure = [
        (*load_curves.panel_arrows(case, points, share), load_curves.describe_pressure(share))
        for share in load_curves.on_panels(case, Pressure)
    ]
    gravity = []
    for vector, _ in case.gravity_terms:  # only gravity needs masses
        center = case.nodal_mass @ points / case.nodal_mass.sum()
        text = load_curves.describe_vector("gravity", vector, "m/s2")
        gravity.append((center[None], vector[None], text))
    return [
        *_arrows(forces, length, sight, style.LOAD, vertices),
        *_arrows(pressure, length, sight, style.LOAD),
        *_turns(sheet, points, length, sight),
        *_arrows(gravity, 1.5 * length, sight, style.GRAVITY),
    ]


def _turns(sheet: Sheet3D, points: Points, length: float, sight: View) -> list[Mark]:
    """Curved arrows of crease moments."""
    shares = load_curves.moments(sheet.case)
    if not shares:
        return []
    arcs = [load_curves.crease_arcs(sheet.case, points, share, 0.6 * length) for share in shares]
    drawn = [marks.arc_arrows(each, 0.22 * length, sight) for each in arcs]
    look = {"color": style.LOAD, "marker": ">", "markersize": 6.0, "linewidth": 1.8}
    keys = [style.key(load_curves.describe_moment(share), **look) for share in shares]
    pieces, heads = (np.concatenate(parts) for parts in zip(*drawn, strict=True))
    return [Mark(style.LOAD, keys, [pieces], heads)]


def _warm(sheet: Sheet3D, points: Points) -> list[Mark]:
    """Stars on warmed panels."""
    look, found = {"marker": "*", "markersize": 9.0, "markeredgecolor": "white"}, []
    for share in load_curves.on_panels(sheet.case, Temperature):
        key = style.key(
            load_curves.describe_temperature(share), color=style.WARM, marker="*", linestyle="none",
            markersize=8.0,
        )  # fmt: skip
        middles = load_curves.panel_middles(sheet.structure, points, share)
        found.append(Mark(style.WARM, [key], dots=middles, zorder=6.4, look=look))
    return found


def _arrows(
    terms: list[tuple[Points, Points, str]],
    length: float,
    sight: View,
    color: str,
    vertices: int | None = None,
) -> list[Mark]:
    """Arrows from points along vectors; each term has points and vectors (k, 3), and a text.

    vertices : nodes with this number or a higher one get no arrow if they are many and too close.
    """
    terms = [term for term in terms if term[1].any()]
    if not terms:
        return []
    longest = max(float(np.linalg.norm(vectors, axis=1).max()) for _, vectors, _ in terms)
    drawn = [
        marks.load_arrows(at, marks.thinned(at, vectors, length, vertices), longest, length, sight)
        for at, vectors, _ in terms
    ]
    look = {"color": color, "marker": ">", "markersize": 6.0, "linewidth": 1.8}
    keys = [style.key(text, **look) for *_, text in terms[:_MOST_LOADS_LISTED]]
    hidden = len(terms) - _MOST_LOADS_LISTED
    if hidden > 0:
        keys.append(style.key(f"and {hidden} more", linestyle="none"))
    shafts, heads = (np.concatenate(parts) for parts in zip(*drawn, strict=True))
    return [Mark(color, keys, [shafts], heads)]


def _write_labels(
    axes: Axes3D,
    sheet: Sheet3D,
    points: Points,
    numbers: bool | str,
    groups: list[_Supports],
    obstacles: Points,
    sight: View,
) -> None:
    """Write node numbers and support directions at places where they hide little."""
    count = len(sheet.pattern.vertices)
    shown = len(points) if numbers == "all" else count if numbers else 0
    # Large sheets get smaller numbers, closer to the nodes.
    crowd = float(np.clip(np.sqrt(20.0 / max(shown, 1)), 0.6, 1.0))
    labels = marks.Labels(axes, sight, 0.036 * crowd * sheet.size, obstacles)
    for node in range(shown):
        inner = node >= count
        color = style.GRAY if inner else style.BLACK
        labels.add(points[node], str(node), color, crowd * (style.TICK if inner else style.LABEL))
    for group in groups:
        for node, names in group.axes:
            triangles = group.mark.triangles
            apart = np.abs(triangles[:, 0] - points[node]).max(axis=1)
            corners = triangles[apart < 1e-6 * sheet.size]
            # Next to the foot of the lowest triangle, away from the node number.
            foot = corners[:, 1:].mean(axis=1)
            lowest = foot[np.argmin(sight.flat(foot)[:, 1])]
            labels.add(lowest, names, group.ink, max(crowd, 0.75) * style.TICK)
