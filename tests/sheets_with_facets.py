"""Sheets that are cut by facets: strips of steel, 200 x 50 x 1 mm, a part of a pipe, a Miura."""

import numpy as np
from scipy.spatial import Delaunay

import foldyn as fd

LENGTH, WIDTH, THICKNESS = 0.2, 0.05, 1e-3
STEEL = fd.Sheet(youngs_modulus=2e11, poissons_ratio=0.3, thickness=THICKNESS, density=7850)
# free beam of Euler and Bernoulli: f1 = 4.73004^2/(2 pi L^2) sqrt(E t^2/12 rho), Hz
# (Blevins, Formulas for Natural Frequency and Mode Shape, 1979, table 8-1)
FREE_BEAM = 4.73004**2 / (2 * np.pi * LENGTH**2) * np.sqrt(2e11 * THICKNESS**2 / (12 * 7850))


def uncut():
    return cut_across([])


def cut_across(places):
    """The strip cut at parts of its length."""
    x = LENGTH * np.array([0.0, *places, 1.0])
    points = [(a, y) for y in (0.0, WIDTH) for a in x]
    n = len(x)
    return fd.Pattern(points, [(k, k + 1, n + k + 1, n + k) for k in range(n - 1)])


def with_lines(ends):
    """The strip cut along one line from side to side, its ends as parts of length and width."""
    (xa, ya), (xb, yb) = ends
    size = np.array([LENGTH, WIDTH])
    corners = [(0, 0), (1, 0), (1, 1), (0, 1)]
    if (xa, ya) == (0, 0) and (xb, yb) == (1, 1):
        return fd.Pattern(np.array(corners) * size, [(0, 1, 2), (0, 2, 3)])
    points = np.array([*corners, (xa, ya), (xb, yb)]) * size
    faces = [(0, 1, 5, 4), (4, 5, 2, 3)] if xa == 0 else [(0, 4, 5, 3), (4, 1, 2, 5)]
    return fd.Pattern(points, faces)


def triangulated(inner, seed):
    """The strip cut into triangles about random points inside."""
    rng = np.random.default_rng(seed)
    corners = [(0, 0), (LENGTH, 0), (LENGTH, WIDTH), (0, WIDTH)]
    inside = rng.uniform((0.05 * LENGTH, 0.1 * WIDTH), (0.95 * LENGTH, 0.9 * WIDTH), (inner, 2))
    points = np.concatenate([corners, inside])
    return fd.Pattern(points, Delaunay(points).simplices)


def half_pipe(facets, radius=0.1, angle=90.0):
    """A part of a pipe along y, of flat facets, 0.1 m long; all its creases are assigned "F"."""
    turn = np.radians(angle) * np.linspace(-0.5, 0.5, facets + 1)
    arc = np.column_stack([radius * np.sin(turn), 0 * turn, radius * np.cos(turn)])
    n = facets + 1
    faces = [(k, k + 1, n + k + 1, n + k) for k in range(facets)]
    letters = {(k, n + k): "F" for k in range(1, facets)}
    return fd.Pattern(np.concatenate([arc, arc + np.array([0, 0.1, 0])]), faces, letters)


def crossed_miura(dihedral=90):
    """A Miura sheet, and the same with each panel cut by a diagonal, the one or the other."""
    whole = fd.patterns.miura(cells=(2, 1), a=0.05, b=0.04, panel_angle=60, dihedral=dihedral)
    letters = dict(zip(map(tuple, whole.creases.tolist()), whole.assignments, strict=True))
    cut, facets = [], {}
    for k, (a, b, c, d) in enumerate(whole.faces):
        cut += [(a, b, c), (a, c, d)] if k % 2 else [(a, b, d), (b, c, d)]
        facets[(a, c) if k % 2 else (b, d)] = "F"
    angles = dict.fromkeys(letters, 0.5)
    families = {"straight": [pair for pair, letter in letters.items() if letter == "M"]}
    made = fd.Pattern(
        whole.vertices, cut, letters | facets, "cut", fold_angles=angles, families=families,
        custom={"a": 1},
    )  # fmt: skip
    return whole, made


def elastic(structure, count=12):
    """Frequencies (Hz) of a free structure, without its rigid motions."""
    found = fd.modes(fd.Case(structure), count=count).frequency.values
    return found[found > 1.0]
