"""Plates condensed facet by facet: what their whole mesh gives."""

from __future__ import annotations

import numpy as np
import pytest

from foldyn.structures.panel_plate import Outline, PanelPlate
from foldyn.structures.plate_boundary import condensed, facet_stiffness

TRIANGLE = ((0.0, 0.0), (1.1, 0.1), (0.4, 0.9))
QUAD = ((0.0, 0.0), (1.2, 0.0), (1.0, 0.8), (0.1, 0.6))
PENTAGON = ((0.0, 0.0), (0.9, -0.2), (1.2, 0.5), (0.5, 1.0), (-0.2, 0.6))


@pytest.mark.parametrize("corners", [TRIANGLE, QUAD, PENTAGON])
@pytest.mark.parametrize("n", [2, 8])
def test_a_condensed_plate_is_that_of_its_whole_mesh(corners, n):
    m = len(corners)
    center = None if m == 3 else (0.55, 0.38)
    odd, first = tuple(k % 2 == 1 for k in range(m)), (True, *(False,) * (m - 1))
    for creased, straight, bowed, clamped in (
        ((True,) * m, (True,) * m, (False,) * m, (False,) * m),
        (first, first, odd, first),
        (odd, (False,) * m, first, (False,) * m),
    ):
        panel = Outline(corners, center, creased, straight, bowed, clamped)
        plate = PanelPlate(panel, 0.25, n)
        whole = plate.solved([*plate.heights, *plate.slopes, *plate.bows])[1]
        found = condensed(panel, 0.25, [n])[0]
        np.testing.assert_allclose(found, whole, atol=1e-9 * np.abs(whole).max())


def test_a_facet_of_constant_curvature_has_the_energy_of_a_plate():
    # w = (x^2 + 3 x y - y^2)/2: kappa = 1, -1 and a twist of 3/2; 2 U = A (kx^2 + ky^2
    # + 2 nu kx ky + 2 (1 - nu) kxy^2) for a stiffness of 1 (Timoshenko, Plates and Shells)
    corners, nu, n = np.array(TRIANGLE), 0.3, 8
    edges = np.roll(corners, -1, axis=0) - corners
    steps = np.arange(n)[:, None] / n
    points = np.concatenate([a + steps * e for a, e in zip(corners, edges, strict=True)])
    middles = points + np.repeat(edges, n, axis=0) / (2 * n)
    outward = np.column_stack([edges[:, 1], -edges[:, 0]])
    outward = np.repeat(outward / np.linalg.norm(outward, axis=1)[:, None], n, axis=0)
    (x, y), (p, q) = points.T, middles.T
    slopes = outward[:, 0] * (p + 1.5 * q) + outward[:, 1] * (1.5 * p - q)
    shape = np.concatenate([0.5 * (x**2 + 3 * x * y - y**2), slopes])
    stiffness = facet_stiffness(corners[None], nu, 3)[-1][0]
    area = 0.5 * np.linalg.det(edges[:2])
    energy = area * (1 + 1 - 2 * nu + 2 * (1 - nu) * 1.5**2)
    assert shape @ stiffness @ shape == pytest.approx(energy, rel=1e-10)
