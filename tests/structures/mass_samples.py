"""Single panels of many shapes and their masses, for the tests of mass rules."""

from __future__ import annotations

import numpy as np

import foldyn as fd
from foldyn.structures import MASS_RULES
from named_models import named

RHO, T = 700.0, 0.02
SHEET = fd.Sheet(1e6, 0.3, T, density=RHO)
RULES = sorted(MASS_RULES)
QUADS_ONLY = {"equi_inertial", "equi_inertial_acute"}
COS, SIN = 0.5, np.sqrt(0.75)  # 60 degrees
SQUARE = [[0, 0], [1, 0], [1, 1], [0, 1]]
RECTANGLE = [[0, 0], [2, 0], [2, 1], [0, 1]]
RHOMBUS = [[0, 0], [1, 0], [1 + COS, SIN], [COS, SIN]]
PARALLELOGRAM = [[0, 0], [1.5, 0], [1.9, 0.8], [0.4, 0.8]]
TRAPEZOID = [[0, 0], [2, 0], [1.3, 1], [0.2, 1]]
KITE = [[0, 0], [1, -0.5], [3, 0], [1, 0.5]]
QUAD = [[0, 0], [1.1, 0], [1, 1.2], [-0.1, 0.9]]
OBLIQUE = [[0, 0], [1, 0], [1 + 4 * SIN, 2], [4 * SIN, 2]]  # a = 1, b = 4, 30 degrees
HEXAGON = np.c_[np.cos(np.arange(6) * np.pi / 3), np.sin(np.arange(6) * np.pi / 3)]
PENTAGON = [[0, 0], [2, 0], [2.5, 1], [1, 2], [-0.4, 1.1]]
PANELS = {
    "square": SQUARE, "rectangle": RECTANGLE, "rhombus": RHOMBUS, "parallelogram": PARALLELOGRAM,
    "trapezoid": TRAPEZOID, "kite": KITE, "quad": QUAD, "oblique": OBLIQUE, "hexagon": HEXAGON,
    "pentagon": PENTAGON, "triangle": [[0, 0], [1.3, 0], [0.4, 1]],
}  # fmt: skip


def one(vertices, mass, **options):
    vertices = np.asarray(vertices, float)
    pattern = fd.Pattern(vertices, [list(range(len(vertices)))])
    return fd.discretize(pattern, SHEET, mass=mass, **named(options))


def shares(vertices, mass, **options):
    """Diagonal of the mass matrix over the panel's mass."""
    s = one(vertices, mass, **options)
    total = RHO * T * s.pattern.face_areas.sum()
    assert np.count_nonzero(s.mass.toarray() - np.diag(s.mass.diagonal())) == 0
    return s.mass.diagonal() / total


def rotational_inertia(structure, start, end):
    """Moment of inertia (kg m2) about the line through two nodes."""
    axis = structure.nodes[end] - structure.nodes[start]
    axis = axis / np.linalg.norm(axis)
    away = np.cross(structure.center_of_mass - structure.nodes[start], axis)
    return axis @ structure.inertia @ axis + structure.total_mass * (away @ away)


def exact_second_moments(s):
    """Integral of x x^T dm, 3 x 3, by the mid-edge rule: exact for quadratics on triangles."""
    x = s.nodes[s.triangles]
    middles = (x + np.roll(x, 1, axis=1)) / 2
    area = np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1) / 2
    return np.einsum("t,tka,tkb->ab", RHO * T * area / 3, middles, middles)


def second_moments(s):
    return s.nodes.T @ (s.mass @ s.nodes)
