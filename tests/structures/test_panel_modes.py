"""What a panel's plate does between its corners, its center and its creased edges."""

from __future__ import annotations

import numpy as np
import pytest
from mass_samples import PANELS
from numpy.polynomial import Legendre

from foldyn.structures.condensed_panel import _spoke_turns, heights_and_slopes
from foldyn.structures.panel_modes import TURNS, _basis, _held_modes, panel_modes
from foldyn.structures.panel_plate import PanelPlate, outline

NU = 0.3
CREASED = [(), (0,), (0, 2), (0, 1, 2, 3)]


def panel(x, creased=(), straight=None):
    x = np.c_[np.asarray(x, float), np.zeros(len(x))]
    edges = [k in creased for k in range(len(x))]
    held = edges if straight is None else [k in straight for k in range(len(x))]
    return outline(x, None if len(x) == 3 else x.mean(axis=0), edges, held)


@pytest.mark.parametrize("creased", CREASED)
def test_shapes_hold_what_is_held(creased):
    """Corners, center, slopes of creased edges to the third power, and all of the straight ones."""
    plate = PanelPlate(panel(PANELS["parallelogram"], creased), NU, 6)
    _, shapes = _held_modes(plate, 4)
    uneven = plate.uneven(TURNS)
    for held in (*plate.heights, *plate.slopes, *uneven, *plate.lines):
        value = sum(factor * shapes[k] for k, factor in held.items())
        np.testing.assert_allclose(value, 0.0, atol=1e-10 * np.abs(shapes).max())
    basis = _basis(plate)
    held = len(plate.heights) + len(plate.slopes) + len(uneven) + len(plate.lines)
    assert basis.shape[1] == basis.shape[0] - held


@pytest.mark.parametrize("creased", CREASED)
def test_static_shapes_and_modes_share_no_stiffness(creased):
    plate = PanelPlate(panel(PANELS["trapezoid"], creased), NU, 6)
    value, shapes = _held_modes(plate, 4)
    static, stiffness = plate.solved([*plate.heights, *plate.slopes, *plate.uneven(TURNS)])
    coupling = shapes.T @ (plate.stiffness @ static)
    np.testing.assert_allclose(coupling, 0.0, atol=1e-8 * np.abs(stiffness).max())
    np.testing.assert_allclose(shapes.T @ (plate.stiffness @ shapes), np.diag(value), rtol=1e-6,
                               atol=1e-6 * value.max())  # fmt: skip
    np.testing.assert_allclose(shapes.T @ (plate.mass @ shapes), np.eye(4), atol=1e-9)


@pytest.mark.parametrize("name", sorted(PANELS))
def test_masses(name):
    """Symmetric, positive definite; exact for what is linear over the panel and turns no edge."""
    x = np.asarray(PANELS[name], float)
    shape = panel(x, (0, 2))
    found = panel_modes(shape, NU, 3)
    mass, inner = found.mass, len(found.stiffness) - len(found.turns)
    assert inner in (3, 4)
    assert len(found.turns) == 2 * TURNS
    np.testing.assert_array_equal(mass, mass.T)
    assert np.linalg.eigvalsh(mass).min() > 1e-7
    np.testing.assert_allclose(mass[-inner:, -inner:], np.eye(inner), atol=1e-9)
    points = np.array([*shape.corners, shape.center] if shape.center else shape.corners)
    linear = np.zeros((len(mass), 3))
    linear[: len(points)] = np.c_[np.ones(len(points)), points]
    corners = np.array(shape.corners)
    ahead = np.roll(corners, -1, axis=0)
    area = (
        np.linalg.det(np.stack([corners, ahead], axis=1)) / 2.0
    )  # of the triangles from the origin
    mean = ((corners + ahead) / 3.0 * area[:, None]).sum(axis=0) / area.sum()
    own = linear.T @ mass @ linear
    assert own[0, 0] == pytest.approx(1.0, rel=1e-9)
    np.testing.assert_allclose(own[0, 1:], mean, atol=1e-9)


def test_static_shapes_are_those_of_the_stiffness():
    """The turn beta of an edge is the facet's slope less the plate's: both outward."""
    shape = panel(PANELS["square"], (0,))
    held = heights_and_slopes(shape)
    assert held.shape == (6, 6)
    tilted = np.r_[np.array([*shape.corners, shape.center]) @ [0.3, -0.2], 0.0]
    (k,) = (held @ tilted)[5:]
    edge = np.subtract(shape.corners[1], shape.corners[0])
    outward = np.array([edge[1], -edge[0]]) / np.linalg.norm(edge)
    assert k == pytest.approx(outward @ [0.3, -0.2])


def test_equal_modes_are_taken_together():
    """A free square has two alike among its first: a mode and the same turned by 90 degrees."""
    first = np.diag(panel_modes(panel(PANELS["square"]), NU, 1).stiffness)
    assert len(first) == 2
    assert first[0] == pytest.approx(first[1], rel=1e-4)
    assert len(panel_modes(panel(PANELS["rectangle"]), NU, 1).stiffness) == 1


def test_parts_of_slopes_are_those_of_legendre():
    """A cubic slope along an edge has the parts that it is made of, up to the mesh."""
    plate = PanelPlate(panel(PANELS["square"], (0,)), NU, 16)
    (mean,), uneven = plate.slopes, plate.uneven(TURNS)
    ends = np.linspace(-1.0, 1.0, 17)
    for parts in np.eye(TURNS + 1):
        cubic = Legendre(parts)
        across = 8.0 * np.diff(cubic.integ()(ends))  # mean of each side
        slopes = dict(zip(mean, across * np.sign(list(mean.values())), strict=True))
        found = [sum(f * slopes[k] for k, f in row.items()) for row in (mean, *uneven)]
        np.testing.assert_allclose(found, parts, atol=0.1)


def test_a_twist_turns_edges_unevenly():
    """w = x y needs no moments at the edges of a square: they turn by half a side at their ends."""
    shape = panel(PANELS["square"], (0, 2))
    points = np.array([*shape.corners, shape.center])
    arms = points - shape.center
    spokes = _spoke_turns(points, 4) @ arms.prod(axis=1)
    found = panel_modes(shape, NU, 1)
    expected = np.zeros((2, TURNS))
    expected[:, 0] = 0.5 * np.linalg.norm(points[1] - points[0])
    np.testing.assert_allclose(found.turns @ [*spokes, 0, 0], expected.ravel(), atol=1e-4)
    assert np.linalg.eigvalsh(found.stiffness).min() > 0.1


def test_frequencies_of_meshes_that_rank_modes_otherwise():
    """The first mode of a square with four creases is another one in the coarse mesh."""
    shape = panel(PANELS["square"], (0, 1, 2, 3))
    found = np.diag(panel_modes(shape, NU, 3).stiffness)[4 * TURNS :]
    (low, _), (high, _) = (_held_modes(PanelPlate(shape, NU, n), 3) for n in (8, 16))
    assert low[1] == pytest.approx(low[2], rel=1e-4)  # the pair comes last there,
    assert high[0] == pytest.approx(high[1], rel=1e-4)  # and first here
    exact = [high[0] + (high[0] - low[1]) / 3.0, high[2] + (high[2] - low[0]) / 3.0]
    np.testing.assert_allclose(found[[0, 2]], exact, rtol=1e-6)
