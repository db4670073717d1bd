"""A tube of two Miura-ori strips, and two such tubes coupled as a zipper."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError, within
from foldyn.patterns.generators.arguments import acute, check_size, fold_dihedral, sizes
from foldyn.patterns.generators.assembly import assembled
from foldyn.patterns.generators.miura import miura
from foldyn.patterns.pattern import Pattern
from foldyn.patterns.topology import Edge
from foldyn.values import whole

CLOSED = "at both of which the tube is flat"


def miura_tube(
    cells: int = 3,
    a: float = 1.0,
    *,
    b: float = 1.0,
    panel_angle: float = 60.0,
    dihedral: float = 90.0,
) -> Pattern:
    """Tube along x of two mirrored Miura-ori strips, open at its ends.

    Station i along x has four corners, numbers 4 i to 4 i + 3: the vertices (i, 0), (i, 1) and
    (i, 2) of one cell of `miura`, and the mirror image of (i, 1) in the plane z = 0. Cross-sections
    are rhombs. The tube folds rigidly, and is flat at both ends of its motion.

    Parameters
    ----------
    cells : int
        Unit cells along x, of two stations each.
    a, b, panel_angle : float
        Edges around the tube and along it (m) and acute angle (degrees) of the panels, as in
        `miura`.
    dihedral : float
        Angle inside the tube across the upper and lower zigzag creases (degrees, between 0 and
        180, at both of which the tube is flat). The other two angles are 180 minus this.

    Returns
    -------
    Pattern
        4 (2 cells + 1) vertices and 8 cells faces, front outside. Families: "zigzag", the four
        lines of creases along x (mountains), and "ring", those around the tube.

    Raises
    ------
    InputError
        An argument of the wrong type or out of range.

    Notes
    -----
    T. Tachi, One-DOF cylindrical deployable structures with rigid quadrilateral panels, IASS 2009;
    M. Schenk, S. D. Guest, PNAS 110, 2013.
    """
    with within("miura_tube: "):
        vertices = tube(cells, a, b, panel_angle, dihedral)
    faces, families = tube_panels(len(vertices) // 4)
    last = len(vertices) - 4
    along = [(corner, last + corner) for corner in range(4)]
    return assembled("miura tube", vertices, faces, families, periods=[along])


def tube(cells: int, a: float, b: float, panel_angle: float, dihedral: float) -> NDArray:
    """Vertices (4 stations, 3), m, of a tube, with checks of its arguments."""
    cells = whole("cells", cells, least=1)
    check_size(f"cells = {cells}", 8 * cells + 4)
    sizes(a, b)
    acute("panel_angle", panel_angle)
    dihedral = fold_dihedral(dihedral, flat_allowed=False, otherwise=CLOSED)
    half = miura((cells, 1), a, b=b, panel_angle=panel_angle, dihedral=dihedral)
    strip = half.vertices.reshape(-1, 3, 3)
    return np.concatenate([strip, strip[:, 1:2] * [1.0, 1.0, -1.0]], axis=1).reshape(-1, 3)


def tube_panels(stations: int, first: int = 0) -> tuple[list[tuple[int, ...]], dict]:
    """Faces of a tube with four corners per station, front outside, and its families of edges."""
    faces: list[tuple[int, ...]] = []
    families: dict[str, list[Edge]] = {"zigzag": [], "ring": []}
    for i in range(stations):
        here = [first + 4 * i + c for c in range(4)]
        families["ring"] += [(here[c], here[c - 3]) for c in range(4)]
        if i + 1 < stations:
            there = [vertex + 4 for vertex in here]
            faces += [(here[c], there[c], there[c - 3], here[c - 3]) for c in range(4)]
            families["zigzag"] += [(here[c], there[c]) for c in range(4)]
    return faces, families


TIES = "foldyn:ties"


def zipper_tubes(
    cells: int = 3,
    a: float = 1.0,
    *,
    b: float = 1.0,
    panel_angle: float = 60.0,
    dihedral: float = 90.0,
) -> Pattern:
    """Two tubes as in `miura_tube` whose zigzag walls fit together, like the rows of a zipper.

    To get the second tube, the first is turned by 180 degrees about an axis at right angles to its
    wall between corners 2 and 3, and shifted until one of its walls lies in that wall. The panels
    of the two walls lie in the same planes but lean in opposite directions, so they overlap only
    in part. This remains so throughout the folding: their corners lie on common lines, at constant
    distances. Vertex k of the first tube becomes vertex k + 4 (2 cells + 1) of the second.

    A pattern cannot join two walls, so the tubes are separate until a case ties them. Each entry
    of `pattern.custom["foldyn:ties"]` has a vertex of the second tube, and three vertices of the
    first tube in whose plane it lies::

        links = [fd.Link([node], to=corners) for node, corners in pattern.custom["foldyn:ties"]]

    Parameters
    ----------
    cells, a, b, panel_angle, dihedral
        Arguments of each tube, as in `miura_tube`; b cos(panel_angle) must be less than a for the
        walls to overlap.

    Returns
    -------
    Pattern
        8 (2 cells + 1) vertices and 16 cells faces, fronts outside. Families: "zigzag" and "ring",
        as in `miura_tube`; "zigzag_1", "ring_1", "zigzag_2" and "ring_2" for each tube alone.

    Raises
    ------
    InputError
        An argument of the wrong type or out of range.

    Notes
    -----
    E. T. Filipov, T. Tachi, G. H. Paulino, Origami tubes assembled into stiff, yet reconfigurable
    structures and metamaterials, PNAS 112, 2015: coupled in this way they fold as softly as one
    tube, and are much stiffer in all other ways.
    """
    with within("zipper_tubes: "):
        one = tube(cells, a, b, panel_angle, dihedral)
        lean = b * math.cos(math.radians(panel_angle)) / a
        if lean >= 1.0:
            raise InputError(
                f" = {b:g}: walls that lean by {lean:.3g} of their width do not overlap; must be "
                f"below {b / lean:.4g} m with these a and panel_angle",
                "b",
            )
    stations = len(one) // 4
    other, first = _turned(one, lean), len(one)
    faces, families = tube_panels(stations)
    more, more_families = tube_panels(stations, first)
    named = {f"{name}_1": pairs for name, pairs in families.items()}
    named |= {f"{name}_2": pairs for name, pairs in more_families.items()}
    both = {name: [*families[name], *more_families[name]] for name in families}
    ties = [
        [first + 4 * (stations - 1 - i) + c, _corners(i, stations)]
        for i in range(stations)
        for c in (0, 1)
    ]
    vertices, custom = np.concatenate([one, other]), {TIES: ties}
    along = [(c, first - 4 + c) for c in range(4)]
    along += [(2 * first - 4 + c, first + c) for c in range(4)]  # the second tube runs backwards
    return assembled(
        "zipper tubes", vertices, [*faces, *more], {**both, **named}, custom=custom,
        periods=[along],
    )  # fmt: skip


def _turned(one: NDArray, lean: float) -> NDArray[np.float64]:
    """The second tube, with the wall of its corners 0 and 1 in the first's wall of 3 and 2.

    Positions along the walls' edges, divided by their length: in the first tube, corners are at 0
    and 1 in even stations, at `lean` and 1 + lean in odd ones; in the second tube it is reversed.
    """
    edge = one[1] - one[0]
    x = one - one[0]
    along = x @ edge / (edge @ edge)
    turned = x - 2.0 * along[:, None] * edge
    turned[:, 0] = one[-4, 0] - one[:, 0]
    return one[3] + (1.0 + lean) * edge + turned


def _corners(i: int, stations: int) -> list[int]:
    """Three corners of a panel in the first tube's wall, two of them at station i."""
    beside = i + 1 if i + 1 < stations else i - 1
    return [4 * i + 3, 4 * i + 2, 4 * beside + 3]
