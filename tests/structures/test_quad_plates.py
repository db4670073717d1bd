"""Quadrilaterals as thin plates, and five nodes that move as they do."""

from __future__ import annotations

import numpy as np
import pytest
from mass_samples import PANELS

from foldyn.structures.condensed_panel import Outline, panel_stiffness
from foldyn.structures.quad_plates import flexibilities, quad_bends, twists

QUADS = [name for name, x in PANELS.items() if len(x) == 4]
EDGES = {"four": "1111", "three": "1110", "obtuse": "1100", "acute": "1001", "opposite": "1010"}


def rhombus(angle):
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    return np.array([[0, 0], [1, 0], [1 + c, s], [c, s]]) / np.sqrt(s)


def of_one(x, edges, nu=0.25):
    straight = np.array([[edge == "1" for edge in edges]])
    return flexibilities(np.asarray(x, float)[None], straight, np.array([nu]))[0]


@pytest.mark.parametrize("angle", [90, 75, 60, 45])
@pytest.mark.parametrize("nu", [0.0, 0.25, 0.45])
def test_twist_with_four_straight_edges(angle, nu):
    """32 (1 - nu) G/A of every parallelogram, of area 1 here.

    Heights on straight edges are linear, so that the slopes at the corners are known, and with them
    the integral of det(grad grad w), which is the area that the slopes enclose: -16/A. The least
    energy has no mean curvature, (1 - nu) G 16/A.
    """
    assert 1.0 / of_one(rhombus(angle), "1111", nu)[0, 0] == pytest.approx(
        32.0 * (1.0 - nu), rel=0.05 if angle == 45 else 0.01
    )


@pytest.mark.parametrize("angle", [75, 60])
@pytest.mark.parametrize("edges", sorted(EDGES))
def test_flexibility_of_a_rhombus(angle, edges):
    """By another discretization, that of n5b8e: triangles of constant curvature."""
    x = rhombus(angle)
    creased = [k for k in range(4) if EDGES[edges][k] == "1"]
    other = by_triangles(x, creased)
    keep = [0, *(1 + k for k in creased)]
    own = of_one(x, EDGES[edges])[np.ix_(keep, keep)]
    np.testing.assert_allclose(np.abs(own), np.abs(other), rtol=0.02, atol=0.003)


def test_plates_of_one_shape_share_what_they_have():
    x = np.stack([rhombus(60), rhombus(60) + 1e-13, rhombus(61)])
    found = flexibilities(x, np.ones((3, 4), bool), np.full(3, 0.3))
    assert (found[0] == found[1]).all() and (found[0] != found[2]).any()


@pytest.mark.parametrize("name", QUADS)
def test_five_nodes_twist_and_turn_as_the_plate(name):
    """Forces on the corners twist them alike, as do a moment on one edge and those on two."""
    x = np.array(PANELS[name], float)
    corners, creased = np.c_[x, np.zeros(4)][None], np.array([[True, True, False, True]])
    center = crossing(x)
    spokes, compliance = quad_bends(
        corners, np.append(center, 0.0)[None], creased, creased, np.array([0.3]), np.array([-1])
    )
    plate = of_one(x, "1101", 0.3)
    turns, slopes = facets(x - center)
    whole = np.linalg.inv(turns.T @ (spokes[0][:, None] * turns))
    assert whole[0, 0] == pytest.approx(plate[0, 0], rel=1e-6)
    own = slopes @ whole @ slopes.T + np.diag(compliance[0])
    assert own[0, 0] == pytest.approx(max(plate[1, 1], own[0, 0] - compliance[0, 0]), rel=1e-6)
    opposite = np.array([0.0, 1.0, 0.0, -1.0])  # moments of edges 1 and 3
    turned = (opposite @ own @ opposite) - compliance[0] @ opposite**2
    true = max(opposite @ plate[1:, 1:] @ opposite, turned)
    assert opposite @ own @ opposite == pytest.approx(true, rel=0.02)
    assert compliance[0, 2] == 0.0
    np.testing.assert_allclose(spokes[0, :2], spokes[0, 2:])


def test_a_panel_with_a_straight_corner_is_taken_for_a_parallelogram():
    """A triangle with a fourth corner on an edge, and one whose corner points inward."""
    for x in ([[0, 0], [1, 0], [2, 0], [0.5, 1]], [[0, 0], [1, 0.2], [2, 0], [1, 1]]):
        x = np.array(x, float)
        corners, edges = np.c_[x, np.zeros(4)][None], np.ones((1, 4), bool)
        for hinged in (-1, 0, 1):
            spokes, compliance = quad_bends(
                corners, corners.mean(axis=1), edges, edges, np.array([0.3]), np.array([hinged])
            )
            assert np.isfinite(spokes).all()
            assert (spokes >= 0.0).all()
            assert spokes.max() > 0.1
            assert (compliance >= 0.0).all()


def crossing(x):
    """Where the diagonals of x (4, 2) cross."""
    p, q = x[2] - x[0], x[3] - x[1]
    return x[0] + np.linalg.solve(np.c_[p, -q], x[1] - x[0])[0] * p


def by_triangles(x, creased):
    """Flexibility of the twist and of the edges that are creases and straight."""
    x = x - x.mean(axis=0)
    flags = tuple(k in creased for k in range(4))
    none = (False,) * 4
    panel = Outline(tuple(map(tuple, x.tolist())), (0.0, 0.0), flags, flags, none, none)
    stiffness = panel_stiffness(panel, 0.25)
    turns, slopes = facets(x)
    count = len(creased)
    angles = np.zeros((4 + count, 2 + count))  # for w, w0 and slopes beside the edges
    angles[:4, :2] = turns
    angles[4:, :2] = slopes[creased]
    angles[4:, 2:] = -np.eye(count)
    whole = np.linalg.inv(angles.T @ stiffness @ angles)
    keep = [0, *range(2, 2 + count)]
    return whole[np.ix_(keep, keep)]


def facets(x):
    """Turns (4, 2) of the spokes from 0 and outward slopes (4, 2) of the facets at the edges.

    In the twist of the corners x (4, 2) and when the center rises.
    """
    ahead = np.roll(x, -1, axis=0)
    heights = np.stack([twists(x[None])[0], -np.ones(4)], axis=1)  # over the center's
    rise = np.stack([heights, np.roll(heights, -1, axis=0)], axis=1)
    gradient = np.linalg.solve(np.stack([x, ahead], axis=1), rise).transpose(0, 2, 1)
    along = ahead - x
    outward = np.stack([along[:, 1], -along[:, 0]], axis=1)
    outward /= np.linalg.norm(along, axis=1)[:, None]
    left = np.stack([-x[:, 1], x[:, 0]], axis=1) / np.linalg.norm(x, axis=1)[:, None]
    turns = np.einsum("kic,kc->ki", np.roll(gradient, 1, axis=0) - gradient, left)
    return turns, np.einsum("kic,kc->ki", gradient, outward)
