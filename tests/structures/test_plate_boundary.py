"""Plates condensed for several panels at once: what the whole mesh of each gives."""

from __future__ import annotations

import numpy as np
import pytest
from whole_plates import PanelPlate

from foldyn.structures.condensed_panel import condensed
from foldyn.structures.panel_plate import Outline

TRIANGLE = ((0.0, 0.0), (1.1, 0.1), (0.4, 0.9))
QUAD = ((0.0, 0.0), (1.2, 0.0), (1.0, 0.8), (0.1, 0.6))
PENTAGON = ((0.0, 0.0), (0.9, -0.2), (1.2, 0.5), (0.5, 1.0), (-0.2, 0.6))


@pytest.mark.parametrize("corners", [TRIANGLE, QUAD, PENTAGON])
@pytest.mark.parametrize("n", [2, 8])
def test_condensed_plates_are_those_of_their_whole_meshes(corners, n):
    panels, m = [], len(corners)
    center = None if m == 3 else (0.55, 0.38)
    odd, first = tuple(k % 2 == 1 for k in range(m)), (True, *(False,) * (m - 1))
    for creased, straight, bowed, clamped in (
        ((True,) * m, (True,) * m, (False,) * m, (False,) * m),
        (first, first, odd, first),
        (odd, (False,) * m, first, (False,) * m),
    ):
        panels.append(Outline(corners, center, creased, straight, bowed, clamped))
    for panel, found in zip(panels, condensed(panels, 0.25, n), strict=True):
        plate = PanelPlate(panel, 0.25, n)
        whole = plate.solved([*plate.heights, *plate.slopes, *plate.bows])[1]
        np.testing.assert_allclose(found, whole, atol=1e-9 * np.abs(whole).max())


def test_a_triangle_of_constant_curvature_has_the_energy_of_a_plate():
    # w = (x^2 + 3 x y - y^2)/2: kappa = 1, -1 and a twist of 3/2; 2 U = A (kx^2 + ky^2
    # + 2 nu kx ky + 2 (1 - nu) kxy^2) for a stiffness of 1 (Timoshenko, Plates and Shells).
    # Corners and mean slopes give the mean curvature, which costs least where it is constant.
    corners, nu = np.array(TRIANGLE), 0.3
    edges = np.roll(corners, -1, axis=0) - corners
    outward = np.column_stack([edges[:, 1], -edges[:, 0]])
    outward /= np.linalg.norm(outward, axis=1)[:, None]
    (x, y), (p, q) = corners.T, (corners + 0.5 * edges).T
    slopes = outward[:, 0] * (p + 1.5 * q) + outward[:, 1] * (1.5 * p - q)
    shape = np.concatenate([0.5 * (x**2 + 3 * x * y - y**2), slopes])
    free = (False,) * 3
    panel = Outline(TRIANGLE, None, (True,) * 3, free, free, free)
    area = 0.5 * np.linalg.det(edges[:2])
    energy = area * (1 + 1 - 2 * nu + 2 * (1 - nu) * 1.5**2)
    (stiffness,) = condensed([panel], nu, 8)
    assert shape @ stiffness @ shape == pytest.approx(energy, rel=1e-10)
