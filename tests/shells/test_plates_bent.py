"""Square plates under load: published deflections, with the observed order of convergence."""

from __future__ import annotations

import numpy as np
import pytest
from plate_theory import DEFLECTION, navier_deflection
from shell_lab import (
    EAST,
    NORTH,
    SOUTH,
    SQUARE,
    WEST,
    at_rest,
    dofs,
    factor,
    grid,
    plane,
    sheet_of,
    tangent,
)

import foldyn as fd
from foldyn.checks import observed_order
from foldyn.shells import shell

SHEET = fd.Sheet(1e6, 0.3, 0.01)
RIM = (SOUTH, EAST, NORTH, WEST)
PUBLISHED_DIGITS = 1e-5  # a unit of the last digit of the tables
DIVISIONS = np.array([8, 16, 32])


def rim_of(s):
    return np.flatnonzero(np.abs(s.nodes[:, :2] - 0.5).max(axis=1) > 0.5 - 1e-9)


def pressure_shares(s):
    """Area that belongs to each node."""
    x = s.nodes[s.triangles]
    area = 0.5 * np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1)
    return np.bincount(s.triangles.ravel(), np.repeat(area / 3.0, 3), len(s.nodes))


def deflection(s, load):
    """Of the middle, linear, times D / (q a^4) or D / (P a^2)."""
    middle = int(np.argmin(np.linalg.norm(s.nodes[:, :2] - 0.5, axis=1)))
    assert s.nodes[middle, :2] == pytest.approx([0.5, 0.5], abs=1e-12)
    force, u = at_rest(s), at_rest(s)
    pushed = {"uniform": pressure_shares(s), "center": np.eye(len(s.nodes))[middle]}[load]
    force[2 : s.nodes.size : 3] = pushed
    free = np.setdiff1d(np.arange(u.size), dofs(rim_of(s)))
    matrix = tangent(s, at_rest(s)).tocsr()
    u[free] = factor(matrix[free][:, free])(force[free])
    return u[3 * middle + 2] * s.sheet.bending_modulus


@pytest.fixture(scope="module")
def plates():
    return {
        edge: [shell(SQUARE, SHEET, divisions=int(n), clamped=held) for n in DIVISIONS]
        for edge, held in (("clamped", RIM), ("supported", ()))
    }


@pytest.mark.parametrize("edge", ["clamped", "supported"])
def test_plate_under_uniform_load(plates, edge):
    found = np.array([deflection(s, "uniform") for s in plates[edge]])
    limit = found[-1] + (found[-1] - found[-2]) / 3.0  # of second order, without the next one
    assert limit == pytest.approx(DEFLECTION[edge, "uniform"], abs=PUBLISHED_DIGITS)
    exact = navier_deflection("uniform") if edge == "supported" else 0.00126532
    # Taylor and Govindjee, Commun. Numer. Meth. Eng. 20, 2004, for the clamped one
    assert limit == pytest.approx(exact, rel=5e-4)
    assert (found > exact).all()  # it is softer than the plate
    assert found[-1] == pytest.approx(exact, rel=0.022)
    assert observed_order(1.0 / DIVISIONS, found - exact) == pytest.approx(2.0, abs=0.06)


@pytest.mark.parametrize("edge", ["clamped", "supported"])
def test_plate_under_a_force_in_its_middle(plates, edge):
    """Errors go with h^2 log h: the curvature is infinite under the force."""
    found = np.array([deflection(s, "center") for s in plates[edge]])
    exact = navier_deflection("center") if edge == "supported" else 0.005612
    assert exact == pytest.approx(DEFLECTION[edge, "center"], abs=1.2 * PUBLISHED_DIGITS)
    errors = found / exact - 1.0
    assert 0.0 < errors[-1] < 0.04
    assert observed_order(1.0 / DIVISIONS, errors) > 1.65
    with_logarithm = errors * DIVISIONS**2 / np.log(2.0 * DIVISIONS)
    assert np.ptp(with_logarithm) < 0.02 * with_logarithm.mean()


def test_an_irregular_mesh_converges_too():
    errors = []
    for n in DIVISIONS:
        mesh, _ = grid(int(n), int(n), plane, jitter=0.25)
        mesh.nodes[np.argmin(np.linalg.norm(mesh.nodes - [0.5, 0.5, 0], axis=1)), :2] = 0.5
        s = sheet_of(mesh, SHEET, RIM)
        errors.append(deflection(s, "uniform") / 0.00126532 - 1.0)
    assert observed_order(1.0 / DIVISIONS, errors) == pytest.approx(2.0, abs=0.2)
    assert abs(errors[-1]) < 0.03
