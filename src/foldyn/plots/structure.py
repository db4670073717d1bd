"""Picture of a structure: panels, creases, node numbers, supports and loads."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from mpl_toolkits.mplot3d import Axes3D
from numpy.typing import ArrayLike, NDArray

from foldyn.errors import InputError
from foldyn.plots import marks, scene, style
from foldyn.plots.loads import describe_gravity, describe_load
from foldyn.plots.scene import Sheet3D, View
from foldyn.plots.sheet import DrawnSheet, add_undeformed, edge_keys

if TYPE_CHECKING:
    from foldyn.cases import Case
    from foldyn.patterns import Pattern
    from foldyn.structures import Structure

_MOST_LOADS_LISTED = 4
_LEGEND_COLUMNS = 3


def draw_structure(
    case_or_structure: Case | Structure | Pattern,
    displacement: ArrayLike | None = None,
    numbers: bool | Literal["all"] = True,
    supports: bool = True,
    loads: bool = True,
    elements: bool = False,
    scale: float = 1.0,
    view: tuple[float, float] = (28.0, -60.0),
    title: str = "",
) -> Figure:
    """Draw a sheet in three dimensions with all that acts on it.

    Parameters
    ----------
    case_or_structure : Case, Structure or Pattern
        Supports and loads are those of a case.
    displacement : array_like, shape (n, 3), or None
        Node displacements (m): the deformed sheet is drawn over the undeformed one in gray.
    numbers : bool or "all"
        Write the numbers of the pattern's vertices; "all" also those of the panels' inner nodes.
    supports : bool
        Mark held nodes: one triangle per held direction, and the names of the directions.
    loads : bool
        Draw an arrow from each loaded node along its force, at the largest load's full length,
        and one from the center of mass along gravity.
    elements : bool
        Draw the bars inside the panels too.
    scale : float
        Factor on the displacement in the picture.
    view : tuple of float
        Elevation above the xy plane and azimuth around z (degrees).
    title : str
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        One orthographic view at equal scale, the legend below.

    Raises
    ------
    InputError
        A displacement of the wrong shape or with NaN, or an unknown `numbers`.
    """
    if numbers not in (True, False, "all"):
        raise InputError(f'numbers: {numbers!r}; use True, False or "all"')
    sheet = Sheet3D.of(case_or_structure)
    points = sheet.nodes + scale * checked_displacement(sheet, displacement)
    sight = View(*view)
    size = sheet.size
    # Marks suit the sheet's size, but not so that they cover the panels of a large sheet.
    edge = float(np.median(np.linalg.norm(np.ptp(sheet.nodes[sheet.edges], axis=1), axis=1)))
    triangles, held = np.zeros((0, 3, 3)), []
    shafts, heads, forces, gravity = np.zeros((0, 2, 3)), np.zeros((0, 3, 3)), [], []
    if sheet.case is not None and supports:
        triangles, held = marks.support_triangles(
            points, np.asarray(sheet.case.fixed), min(0.055 * size, 0.25 * edge), sight
        )
    if sheet.case is not None and loads:
        forces = [np.asarray(vectors, dtype=np.float64) for vectors, _ in sheet.case.force_terms]
        gravity = [vector for vector, _ in sheet.case.gravity_terms]
    length = min(0.17 * size, 0.8 * edge)
    longest = max((np.linalg.norm(f, axis=1).max() for f in forces), default=0.0)
    for vectors in forces:
        more = marks.load_arrows(points, vectors, longest, length, sight)
        shafts, heads = np.vstack([shafts, more[0]]), np.vstack([heads, more[1]])
    own = len(shafts)  # arrows of forces; those of gravity follow
    if gravity:
        middle = np.tile(_center_of_mass(sheet, points), (len(gravity), 1))
        strongest = max(float(np.linalg.norm(g)) for g in gravity)
        more = marks.load_arrows(middle, np.array(gravity), strongest, 1.5 * length, sight)
        shafts, heads = np.vstack([shafts, more[0]]), np.vstack([heads, more[1]])

    # The names of the held directions stand beyond the triangles' feet.
    feet = triangles[:, :1] + 1.6 * (triangles - triangles[:, :1])
    everything = [points, feet.reshape(-1, 3), heads.reshape(-1, 3)]
    if numbers:  # room for the labels above the highest nodes
        everything.append(points + np.array([0.0, 0.0, 0.06 * size]))
    keys: list[Any] = []
    if displacement is not None:
        everything.append(sheet.nodes)
        keys.append(Line2D([], [], color=style.LIGHT, linewidth=1.2, label="undeformed"))
        if scale != 1.0:
            keys.append(Line2D([], [], linestyle="none", label=f"displacement times {scale:g}"))
    keys += edge_keys(sheet, elements)
    if len(triangles):
        keys.append(Patch(facecolor=style.SUPPORT, label="support (directions held)"))
    keys += _load_keys(forces)
    keys += [_arrow_key(style.GRAVITY, describe_gravity(g)) for g in gravity]

    rows = -(-len(keys) // _LEGEND_COLUMNS)
    figure, axes = scene.view_figure(np.vstack(everything), sight, title, rows)
    if displacement is not None:
        add_undeformed(axes, sheet)
    DrawnSheet(axes, sheet, points, sight, elements)
    if len(triangles):
        marks.add_triangles(axes, triangles, style.SUPPORT, 6.0)
    for part, color in ((slice(own), style.LOAD), (slice(own, None), style.GRAVITY)):
        if len(heads[part]):
            scene.add_segments(axes, shafts[part], color, 1.8, zorder=7.0)
            marks.add_triangles(axes, heads[part], color, 7.5)
    _write_labels(axes, sheet, points, numbers, held, (triangles, shafts, heads), sight)
    style.legend_below(figure, keys, _LEGEND_COLUMNS)
    return style.finish(figure)


def checked_displacement(sheet: Sheet3D, displacement: ArrayLike | None) -> NDArray[np.float64]:
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


def _load_keys(forces: list[NDArray[np.float64]]) -> list[Line2D]:
    """Return the legend entries of the loads, one per history."""
    keys = [_arrow_key(style.LOAD, describe_load(f)) for f in forces[:_MOST_LOADS_LISTED]]
    hidden = len(forces) - _MOST_LOADS_LISTED
    if hidden > 0:
        keys.append(Line2D([], [], linestyle="none", label=f"and {hidden} more loads"))
    return keys


def _arrow_key(color: str, text: str) -> Line2D:
    return Line2D([], [], color=color, marker=">", markersize=6.0, linewidth=1.8, label=text)


def _center_of_mass(sheet: Sheet3D, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the center (3,) of the nodes' masses at these positions (n, 3)."""
    mass = np.asarray(sheet.structure.mass.sum(axis=0)).ravel()
    return mass @ points / mass.sum()


def _write_labels(
    axes: Axes3D,
    sheet: Sheet3D,
    points: NDArray[np.float64],
    numbers: bool | str,
    held: list[tuple[int, str]],
    drawn: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]],
    sight: View,
) -> None:
    """Write node numbers and held directions where they hide least."""
    count = len(sheet.pattern.vertices)
    shown = len(points) if numbers == "all" else count if numbers else 0
    # Large sheets get smaller numbers, closer to their nodes.
    crowd = float(np.clip(np.sqrt(20.0 / max(shown, 1)), 0.6, 1.0))
    triangles, shafts, heads = drawn
    obstacles = np.vstack(
        [
            points,
            marks.along_lines(points[sheet.edges]),
            marks.along_lines(shafts),
            marks.outline(triangles),
            marks.outline(heads),
        ]
    )
    labels = marks.Labels(axes, sight, 0.036 * crowd * sheet.size, obstacles)
    for node in range(shown):
        inner = node >= count
        color = style.GRAY if inner else style.BLACK
        labels.add(points[node], str(node), color, crowd * (style.TICK if inner else style.LABEL))
    for node, names in held:
        corners = triangles[[np.allclose(t[0], points[node]) for t in triangles]]
        # Beside the foot of the lowest triangle, away from the node's own number.
        foot = corners[:, 1:].mean(axis=1)
        lowest = foot[np.argmin(sight.flat(foot)[:, 1])]
        labels.add(lowest, names, style.SUPPORT, max(crowd, 0.75) * style.TICK)
