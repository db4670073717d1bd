"""The square twist."""

from __future__ import annotations

import math

import numpy as np

from foldyn.errors import InputError, within
from foldyn.patterns.frames import composed
from foldyn.patterns.generators.arguments import acute, fold_dihedral, sizes
from foldyn.patterns.pattern import Pattern
from foldyn.patterns.topology import Edge, edge_of
from foldyn.values import flag


def square_twist(
    a: float = 1.0,
    b: float = 1.0,
    *,
    panel_angle: float = 45.0,
    dihedral: float = 100.0,
    symmetric: bool = False,
) -> Pattern:
    """Square twist: a square with a pleat from each side.

    Vertices 0 to 3 are the corners of the square, counter-clockwise from the origin. Two parallel
    creases of length b run outwards from the ends of side i, at the acute angle g = panel_angle to
    the side at its beginning. Their outer ends are vertices 4 + i and 8 + i; vertex 12 + i is the
    outer corner between two pleats. At every corner the panels have 90, g, 90 and 180 - g degrees.

    The assignment decides whether the pattern folds rigidly. By default sides 0 and 2 fold by p in
    opposite directions, and sides 1 and 3 by q, with tan(q/2) = tan(45 - g/2) tan(p/2): then all
    panels stay flat. With `symmetric` all sides are mountains. This pattern has four-fold symmetry
    and is flat-foldable, but cannot fold without bending its panels; it is available only flat,
    with the angles to fold to (`Pattern.fold_angles`).

    Parameters
    ----------
    a, b : float
        Side of the square and length of the pleats (m).
    panel_angle : float
        Angle g of the pleats with the sides (degrees, between 0 and 90).
    dihedral : float
        Angle of the panels across sides 0 and 2 (degrees, above 0, 180 is flat); of the symmetric
        one 180.
    symmetric : bool
        Whether all sides are mountains.

    Returns
    -------
    Pattern
        16 vertices, 9 faces, 12 creases, front of the square to +z. Families: "center", the sides
        of the square, and "pleat".

    Raises
    ------
    InputError
        An argument of the wrong type or out of range; a folded symmetric twist.

    Notes
    -----
    T. A. Evans, R. J. Lang, S. P. Magleby, L. L. Howell, Rigidly foldable origami gadgets and
    tessellations, R. Soc. Open Sci. 2, 2015; J. L. Silverberg et al., Origami structures with a
    critical transition to bistability arising from hidden degrees of freedom, Nature Mater. 14,
    2015 (the symmetric one).
    """
    with within("square_twist: "):
        a, b = sizes(a, b)
        gamma = acute("panel_angle", panel_angle)
        symmetric = flag("symmetric", symmetric)
        dihedral = fold_dihedral(dihedral)
        if symmetric and dihedral < 180.0:
            raise InputError(
                f" = {dihedral:g}: a symmetric square twist does not fold without bending its "
                "panels; give 180 and let a solver fold it, or leave symmetric out",
                "dihedral",
            )
    flat, faces = _flat(a, b, gamma)
    center = [edge_of(i, (i + 1) % 4) for i in range(4)]
    first = [(i, 4 + i) for i in range(4)]
    second = [((i + 1) % 4, 8 + i) for i in range(4)]
    families = {"center": center, "pleat": [*first, *second]}
    if symmetric:
        letters = dict.fromkeys([*center, *second], "M") | dict.fromkeys(first, "V")
        closed = {pair: math.pi if letter == "V" else -math.pi for pair, letter in letters.items()}
        name = "symmetric square twist"
        return Pattern(flat, faces, letters, name, fold_angles=closed, families=families)
    angles = _angles(math.radians(180.0 - dihedral), gamma, center, first, second)
    some = angles if dihedral < 180.0 else _angles(1.0, gamma, center, first, second)
    letters = {pair: "V" if angle > 0.0 else "M" for pair, angle in some.items()}
    sheet = Pattern(flat, faces)
    vertices, _ = composed(sheet, np.array([angles[a, b] for a, b in sheet.creases.tolist()]))
    return Pattern(vertices, faces, letters, "square twist", families=families)


def _flat(a: float, b: float, gamma: float) -> tuple[np.ndarray, list[tuple[int, ...]]]:
    """Vertices (16, 2), m, and panels: the square, the pleats, the outer corners between them."""
    square = a * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    way = np.arange(4) * math.pi / 2 - gamma
    pleat = b * np.column_stack([np.cos(way), np.sin(way)])
    last = np.roll(pleat, 1, axis=0)
    ends = [square + pleat, np.roll(square, -1, axis=0) + pleat, square + pleat + last]
    faces: list[tuple[int, ...]] = [(0, 1, 2, 3)]
    faces += [((i + 1) % 4, i, 4 + i, 8 + i) for i in range(4)]
    faces += [(i, 8 + (i - 1) % 4, 12 + i, 4 + i) for i in range(4)]
    return np.concatenate([square, *ends]), faces


def _angles(
    p: float, gamma: float, center: list[Edge], first: list[Edge], second: list[Edge]
) -> dict[Edge, float]:
    """Fold angles (rad) if sides 0 and 2 fold by p.

    At a corner, opposite creases fold by the same angle: the pair that folds further with equal
    signs, the other pair with opposite signs.
    """
    q = 2.0 * math.atan(math.tan(math.pi / 4 - gamma / 2) * math.tan(p / 2))
    sides = [p, -q, -p, q]
    angles = dict(zip(center, sides, strict=True))
    angles |= {first[i]: (sides[i - 1] if i % 2 else -sides[i - 1]) for i in range(4)}
    nexts = [sides[(i + 1) % 4] for i in range(4)]
    return angles | {second[i]: (nexts[i] if i % 2 else -nexts[i]) for i in range(4)}
