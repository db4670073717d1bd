"""Thick panels: boards hinged on their faces, as in thick origami.

A crease is a line at some height along the front normal of the adjacent boards. By default a valley
lies in the front face, because the two front faces meet when it closes, and a mountain in the back
face. Each panel of the thick pattern lies in the plane through its hinge lines; a board moves with
its panel. The dihedrals of flat boards, and areas and pictures of boards, follow from
`Pattern.boards`.

For a board with one hinge line, or with two parallel hinge lines at opposite heights, this plane
runs through opposite edges of the board's section. The mass on the plane then has the board's
center of mass and moment of inertia about the hinge: (w^2 + t^2) m / 3 for a board of width w that
is hinged in its face.

Sources: T. Tachi, Rigid-foldable thick origami, Origami 5, 2011 (axes at the valley sides);
Y. Chen, R. Peng, Z. You, Origami of thick panels, Science 349, 2015 (a vertex at which hinge lines
of different heights meet moves only if the thicknesses satisfy certain conditions).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.patterns.boards import Boards
from foldyn.patterns.crease_data import crease_values
from foldyn.patterns.facets import flattened
from foldyn.patterns.pattern import Pattern, pattern_of, refuse_junctions
from foldyn.patterns.topology import around, edge_lookup, edge_of, walk
from foldyn.patterns.transforms import refuse_boards
from foldyn.values import SHORTEST, number, number_or_list, one_or_each

SAME = 1e-9  # positions and heights closer than this, relative to the size, are equal
SIDES = {"V": 0.5, "M": -0.5, "F": 0.0}  # height of a hinge line divided by the thickness
CONDITIONS = (
    "hinge lines at different heights do not meet in a point, and boards of one thickness around "
    "such a vertex cannot fold (Chen, Peng and You, Science 349, 2015); give offsets that are the "
    "same at all creases of a vertex, or a pattern whose creases do not meet"
)


def thicken(
    pattern: Pattern,
    thickness: float | Sequence[float],
    *,
    offsets: float | Sequence[float] | Mapping[str, float] | None = None,
) -> Pattern:
    """Give panels a thickness, and place each crease at a height within the thickness.

    Parameters
    ----------
    pattern : Pattern
        Flat or folded, with flat panels; its panels are the middle surfaces of the boards.
    thickness : float or sequence of float
        Thickness (m), one value for all panels or one for each panel.
    offsets : float, sequence of float or mapping, optional
        Height (m) of hinge lines above the middle surfaces, along the front normals, at most half a
        thickness in magnitude. Either one height for all creases, or one for each crease, or
        heights by name ("mountain", "valley", "flat", or a family of the pattern), such as
        {"flat": 0.01}. By default valleys are hinged in the front face, mountains in the back face,
        and flat creases in the middle.

    Returns
    -------
    Pattern
        The thick pattern, with the same numbering of vertices, panels and creases. Its `boards` are
        the thick panels, and its `flat_dihedrals` the angles at which the boards lie flat.

    Raises
    ------
    InputError
        A value is out of range, an unassigned crease has no offset, creases of different heights
        meet at a vertex, or the boards of a closed ring of panels cannot all be connected.

    Examples
    --------
    >>> import foldyn as fd
    >>> strip = fd.Pattern([(0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (2, 1)],
    ...                    [(0, 1, 4, 3), (1, 2, 5, 4)], {(1, 4): "V"})
    >>> fd.thicken(strip, 0.1).vertices[[1, 2], 2].round(12).tolist()
    [0.05, -0.05]
    """
    pattern = pattern_of(pattern)
    refuse_boards(pattern, "its panels are thick already; thicken the thin one")
    sizes = _thickness(thickness, pattern)
    height = _heights(offsets, sizes, pattern)
    corners = _corner_heights(height, pattern)
    shift = _shifts(height, pattern)
    vertices = pattern.vertices.copy()
    placed = np.zeros(len(vertices), bool)
    middles = []
    for panel, face in enumerate(pattern.faces):
        middle = pattern.vertices[list(face)] + shift[panel]
        middles.append(middle)
        places = middle + corners[panel][:, None] * pattern.face_normals[panel]
        for vertex, place in zip(face, places, strict=True):
            if placed[vertex] and np.abs(place - vertices[vertex]).max() > SAME * pattern.size:
                raise InputError(
                    f": thick panels would part at vertex {vertex}, where they meet in a "
                    "corner alone; give the panels vertices of their own there",
                    "pattern",
                )
            vertices[vertex], placed[vertex] = place, True
    starts = np.concatenate([[0], np.cumsum([len(face) for face in pattern.faces])])
    return pattern.changed(vertices=vertices, boards=Boards(starts, np.concatenate(middles), sizes))


def _thickness(given: Any, pattern: Pattern) -> NDArray[np.float64]:
    """Thickness of each panel (np,)."""
    each = number_or_list("thickness", given, "panel", above=0.0, unit="m", smallest=SHORTEST)
    sizes = one_or_each("thickness", each, len(pattern.faces), "panels")
    if len(pattern.welds):
        one, two = pattern.weld_faces[0].tolist()
        raise InputError(
            f": panels {one} and {two} are welded to one sheet, and boards are not; make the weld "
            "a crease",
            "pattern",
        )
    refuse_junctions(
        pattern, "and boards hinge in pairs; give some of them vertices of their own there"
    )
    bent = np.flatnonzero(pattern.face_planarity > SAME)
    if bent.size:
        raise InputError(f": panel {bent[0]} is not flat, and a board is; cut it in two", "pattern")
    return sizes


def _heights(offsets: Any, sizes: NDArray, pattern: Pattern) -> NDArray[np.float64]:
    """Height (nc, 2) of each crease above the middle of the panel on either side."""
    beside = sizes[pattern.crease_faces]
    given, named = _given_heights(offsets, pattern)
    letters = np.array(pattern.assignments, dtype="<U1")
    unknown = np.flatnonzero(~named & ~np.isin(letters, list(SIDES)))
    if unknown.size:
        raise InputError(
            f": crease {unknown[0]} is unassigned: give offsets, or make it a mountain, a valley "
            "or flat",
            "offsets",
        )
    least = 0.5 * beside.min(axis=1, initial=np.inf)
    beyond = np.flatnonzero(np.abs(given) > least * (1.0 + SAME))
    if beyond.size:
        k = beyond[0]
        raise InputError(
            f": crease {k} has {given[k]:g} m: must be at most half the thickness of the panels "
            f"at the crease in size, {least[k]:g} m",
            "offsets",
        )
    own = beside * np.array([SIDES.get(letter, 0.0) for letter in letters])[:, None]
    return np.where(named[:, None], given[:, None], own)


def _given_heights(offsets: Any, pattern: Pattern) -> tuple[NDArray[np.float64], NDArray]:
    """Height of each crease (nc,), and whether the height is given (nc,)."""
    count = len(pattern.creases)
    if isinstance(offsets, Mapping):
        each = {word: number(f"offsets.{word}", value) for word, value in offsets.items()}
        return crease_values("offsets", each, pattern)
    if offsets is None:
        return np.zeros(count), np.zeros(count, bool)
    height = number_or_list("offsets", offsets, "crease")
    return one_or_each("offsets", height, count, "creases"), np.ones(count, bool)


def _corner_heights(height: NDArray, pattern: Pattern) -> list[NDArray[np.float64]]:
    """Heights (k,) of each panel's corners above its middle, on the plane of the hinge lines."""
    row = edge_lookup(pattern.creases)
    out = []
    for panel, face in enumerate(pattern.faces):
        found: dict[int, tuple[float, int]] = {}
        for a, b in around(face):
            crease = row.get(edge_of(a, b))
            if crease is None:
                continue
            own = height[crease, int(pattern.crease_faces[crease, 0] != panel)]
            for vertex in (a, b):
                before, other = found.setdefault(vertex, (own, crease))
                if abs(before - own) > SAME * pattern.size:
                    raise InputError(
                        f": creases {other} and {crease} meet at vertex {vertex} at different "
                        f"heights, {before:g} and {own:g} m: {CONDITIONS}",
                        "pattern",
                    )
        out.append(_plane(panel, face, {v: h for v, (h, _) in found.items()}, pattern))
    return out


def _plane(
    panel: int, face: tuple[int, ...], known: dict[int, float], pattern: Pattern
) -> NDArray[np.float64]:
    """Heights (k,) of a panel's corners on a plane through the corners with `known` heights.

    If these corners are collinear, the plane goes through the panel's centroid, so that the mass on
    the plane has the board's center of mass.
    """
    if not known:
        return np.zeros(len(face))
    flat = flattened(pattern.vertices[list(face)], pattern.face_normals[panel])
    span = float(np.ptp(flat, axis=0).max())
    points = np.array([flat[face.index(v)] for v in known])
    heights = np.array([*known.values()])
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    if spread[-1] < SAME * span:  # collinear
        import shapely  # slow to import

        centroid = shapely.Polygon(flat).centroid.coords[0]
        points = np.vstack([points, centroid])
        heights = np.append(heights, 0.0)
    system = np.column_stack([np.ones(len(points)), points / span])
    plane = np.linalg.lstsq(system, heights, rcond=None)[0]
    if np.abs(system @ plane - heights).max() > SAME * pattern.size:
        raise InputError(
            f": hinge lines of panel {panel} do not lie in one plane: make them parallel, or give "
            "them one height",
            "pattern",
        )
    return np.column_stack([np.ones(len(flat)), flat / span]) @ plane


def _shifts(height: NDArray, pattern: Pattern) -> NDArray[np.float64]:
    """Displacement (np, 3) of each board from its thin panel, so that the hinge lines coincide.

    The first panel of each connected part stays fixed.
    """
    normal = pattern.face_normals
    step = height[:, :1] * normal[pattern.crease_faces[:, 0]]
    step = step - height[:, 1:] * normal[pattern.crease_faces[:, 1]]
    shift = np.zeros((len(pattern.faces), 3))
    for panel, other, crease, way in walk(pattern.crease_faces, len(shift)):
        shift[other] = shift[panel] + way * step[crease]
    one, two = pattern.crease_faces.T
    torn = np.abs(shift[two] - shift[one] - step).max(axis=1, initial=0.0) > SAME * pattern.size
    if torn.any():
        k = int(np.flatnonzero(torn)[0])
        a, b = pattern.creases[k].tolist()
        raise InputError(
            f": thick panels do not close a ring: they part at crease {k} (vertices {a}, {b}); cut "
            "the ring open there, or give offsets",
            "pattern",
        )
    return shift
