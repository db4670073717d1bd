"""The Yoshimura pattern, a sheet that rolls up into a faceted cylinder."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from foldyn.errors import within
from foldyn.patterns.generators.arguments import cell_counts, check_turn, fold_dihedral, sizes
from foldyn.patterns.generators.assembly import assembled
from foldyn.patterns.pattern import Pattern
from foldyn.patterns.topology import Edge


def yoshimura(
    cells: Sequence[int] = (6, 4), a: float = 0.5, *, b: float = 1.0, dihedral: float = 160.0
) -> Pattern:
    """Yoshimura pattern: rows of equal isosceles triangles, which roll up as they fold.

    Rings of points run along x, `cells[0] + 1` in an even and `cells[0]` in an odd ring, which is
    shifted by half a base; they are numbered ring by ring along y. Folded, ring r lies on a circle
    about an axis along y, at y = r h, at which a base takes up the angle p: with the half dihedral
    c, h = a sin c, tan(p/4) = (2 a/b) cos c, and the radius is b/(2 sin(p/2)).

    Parameters
    ----------
    cells : sequence of two int
        Bases along x, and rows along y.
    a, b : float
        Height of a triangle along y, and length of its base along x (m).
    dihedral : float
        Angle across the bases, the valleys (degrees, above 0, 180 is flat).

    Returns
    -------
    Pattern
        Front to +z in the middle, outside the cylinder. Families: "ring", the bases (valleys), and
        "diagonal", the legs (mountains).

    Raises
    ------
    InputError
        An argument of the wrong type or out of range; a sheet that rolls up by more than a full
        turn.

    Notes
    -----
    Y. Yoshimura, On the mechanism of buckling of a circular cylindrical shell under axial
    compression, NACA TM 1390, 1955. A cylinder that is closed is a `kresling` tower with
    twist = -180/sides.
    """
    with within("yoshimura: "):
        nx, ny = cell_counts(cells, 1)
        a, b = sizes(a, b)
        half = math.radians(fold_dihedral(dihedral)) / 2
        bent = 0.0 if dihedral == 180 else 4.0 * math.atan(2.0 * a / b * math.cos(half))
        check_turn("cells[0]", nx, math.degrees(bent), "bases")
    rise = a * math.sin(half)
    vertices: list[tuple[float, float, float]] = []
    first = []
    for ring in range(ny + 1):
        first.append(len(vertices))
        place = np.arange(nx + 1 - ring % 2) + 0.5 * (ring % 2) - nx / 2  # in bases
        if bent:
            radius = b / (2.0 * math.sin(bent / 2.0))
            x, z = radius * np.sin(place * bent), -2.0 * radius * np.sin(place * bent / 2.0) ** 2
        else:
            x, z = b * place, 0.0 * place
        vertices += [(float(u), rise * ring, float(w)) for u, w in zip(x, z, strict=True)]
    faces: list[tuple[int, ...]] = []
    families: dict[str, list[Edge]] = {"ring": [], "diagonal": []}
    for row in range(ny):
        long, short = (first[row], first[row + 1])[:: -1 if row % 2 else 1]
        up = 1 if row % 2 == 0 else -1
        for k in range(nx):
            faces.append((long + k, long + k + 1, short + k)[::up])
            families["ring"].append((long + k, long + k + 1))
            families["diagonal"] += [(long + k, short + k), (long + k + 1, short + k)]
        for k in range(1, nx):
            faces.append((short + k - 1, long + k, short + k)[::up])
            families["ring"].append((short + k - 1, short + k))
    letters = {"ring": "V", "diagonal": "M"}
    periods = [] if ny % 2 else [[(k, first[ny] + k) for k in range(nx + 1)]]
    return assembled("yoshimura", vertices, faces, families, letters, periods=periods)
