"""The flasher, a sheet that wraps around a hub."""

from __future__ import annotations

import math

import numpy as np

from foldyn.errors import within
from foldyn.patterns.generators.arguments import check_size
from foldyn.patterns.generators.assembly import assembled
from foldyn.patterns.pattern import Pattern
from foldyn.patterns.topology import Edge
from foldyn.values import flag, length, whole

LETTERS = {"hub": "V", "ray": "V", "ridge": "M", "inner_bend": "V", "outer_bend": "M"}


def flasher(sides: int = 6, a: float = 1.0, *, rings: int = 3, folded: bool = False) -> Pattern:
    """Flasher: a flat sheet that wraps around a polygonal hub; zero thickness.

    A ray extends each side of the hub, and a ridge halves the wedge of 360/sides degrees between
    two rays. When folded, the halves of each wedge lie on each other and wind around a prism over
    the hub. They bend at the edges of the prism, along lines that cross the rays at right angles
    every a. The rays then lie in the base of the prism, and the ridges rise at 180/sides degrees.

    Both states are exact; between them the panels must bend (rigid flashers need cuts). The flat
    state has the angles to fold to (`Pattern.fold_angles`).

    Parameters
    ----------
    sides : int
        Sides of the hub, at least 3.
    a : float
        Length of a side (m).
    rings : int
        Bends across each half wedge, at least 1.
    folded : bool
        Whether to return the folded state, wrapped around the hub.

    Returns
    -------
    Pattern
        Corners of the hub first; front of the hub to +z. Families: "hub", "ray", "inner_bend"
        (valleys), "ridge" and "outer_bend" (mountains).

    Raises
    ------
    InputError
        An argument of the wrong type or out of range.

    Notes
    -----
    S. D. Guest, S. Pellegrino, Inextensional wrapping of flat membranes, 1st Int. Seminar on
    Structural Morphology, 1992; R. J. Lang, S. Magleby, L. Howell, Single degree-of-freedom
    rigidly foldable cut origami flashers, J. Mech. Robot. 8, 2016.
    """
    with within("flasher: "):
        sides, rings = whole("sides", sides, least=3), whole("rings", rings, least=1)
        check_size(f"sides = {sides}, rings = {rings}", 2 * sides * rings)
        a, folded = length("a", a), flag("folded", folded)
    half = math.pi / sides
    hub = a / (2.0 * math.sin(half)) * np.exp(2j * half * np.arange(sides))
    found: dict[tuple[int, int, bool], int] = {}
    vertices: list[tuple[float, float, float]] = []

    def point(wedge: int, k: int, ridge: bool) -> int:
        """Number of the vertex at distance k a from a wedge's corner, on its inner ray or ridge."""
        if not ridge and k == 1:
            wedge, k = wedge + 1, 0
        wedge %= sides
        if (wedge, k, ridge) not in found:
            found[wedge, k, ridge] = len(vertices)
            if folded:
                place = hub[(wedge + k) % sides]
                height = k * a * math.tan(half) if ridge else 0.0
            else:
                way = (hub[(wedge + 1) % sides] - hub[wedge]) * k
                place = hub[wedge] + way * (np.exp(-1j * half) / math.cos(half) if ridge else 1.0)
                height = 0.0
            vertices.append((place.real, place.imag, height))
        return found[wedge, k, ridge]

    faces: list[tuple[int, ...]] = [tuple(point(i, 0, False) for i in range(sides))]
    families: dict[str, list[Edge]] = {name: [] for name in LETTERS}
    for i in range(sides):
        for k in range(rings):
            for base, length_of_side, name in ((i, rings, "inner_bend"), (i - 1, rings - 1, "")):
                if k >= length_of_side:
                    continue
                begin, end = (k, k + 1) if name else (k + 1, k + 2)
                low = [point(base, begin, False), point(base, end, False)]
                high = [point(i, k, True) if k else low[0], point(i, k + 1, True)]
                ring = [low[0], low[1], high[1]] if k == 0 else [*low, high[1], high[0]]
                faces.append(tuple(ring[::-1] if name else ring))
                families[name or "outer_bend"].append((low[1], high[1]))
                families["ridge"].append((high[0], high[1]))
                families["hub" if begin == 0 else "ray"].append((low[0], low[1]))
    angles = {
        "hub": math.pi / 2, "ray": math.pi, "ridge": -math.pi,
        "inner_bend": 2.0 * half, "outer_bend": -2.0 * half,
    }  # fmt: skip
    return assembled("flasher", vertices, faces, families, LETTERS, None if folded else angles)
