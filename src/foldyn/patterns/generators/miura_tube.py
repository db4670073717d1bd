"""A tube of two Miura-ori strips."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import within
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

    Station i along x has four corners, number 4 i to 4 i + 3: those of one cell of `miura` at
    (i, 0), (i, 1) and (i, 2), and the image of (i, 1) in the plane z = 0. Cross-sections are
    rhombs; the tube folds rigidly, flat at both ends of its motion.

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
    strip = miura((cells, 1), a, b=b, panel_angle=panel_angle, dihedral=dihedral).vertices.reshape(
        -1, 3, 3
    )
    mirrored = strip[:, 1:2] * [1.0, 1.0, -1.0]
    return np.concatenate([strip, mirrored], axis=1).reshape(-1, 3)


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
