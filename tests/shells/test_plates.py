"""Square plates: published deflections and frequencies, with the observed order of convergence."""

from __future__ import annotations

import numpy as np
import pytest
from plate_theory import DEFLECTION, navier_deflection, ritz_frequencies
from shell_lab import (
    EAST,
    NORTH,
    SOUTH,
    SQUARE,
    WEST,
    angular_frequencies,
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
from foldyn.mechanics.triangle import isotropic
from foldyn.shells import shell
from pairwise import beyond
from verification.benchmarks.plates import LEISSA

SHEET = fd.Sheet(1e6, 0.3, 0.01, density=2.0)
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


def frequencies(edges, divisions, mass, count=6):
    """omega a^2 sqrt(rho t / D), of all rigid and elastic modes."""
    clamped = [WEST] if edges == "cantilevered" else []
    s = shell(SQUARE, SHEET, divisions=int(divisions), clamped=clamped, mass=mass)
    held = dofs(np.flatnonzero(s.nodes[:, 0] < 1e-12)) if clamped else []
    unit = np.sqrt(SHEET.bending_modulus / (SHEET.density * SHEET.thickness))
    rigid = 0 if clamped else 6
    return angular_frequencies(s, held, rigid + count, shift=unit) / unit


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("edges", "mass"),
    [
        ("free", "lumped"), ("cantilevered", "consistent"),
        *beyond([("free", "consistent"), ("cantilevered", "lumped")]),
    ],
)  # fmt: skip
def test_first_six_frequencies(edges, mass):
    exact = ritz_frequencies(isotropic(SHEET.poissons_ratio), clamped=edges == "cantilevered")[:6]
    found = np.array([frequencies(edges, n, mass)[-6:] for n in DIVISIONS])
    limit = found[-1] + (found[-1] - found[-2]) / 3.0
    assert limit == pytest.approx(LEISSA[edges], rel=1.1e-2)  # his are upper bounds
    assert limit == pytest.approx(exact, rel=1.5e-3)
    assert (found < exact).all()  # softer than the plate, and lumping adds to it
    assert found[-1] == pytest.approx(exact, rel=1.4e-2 if mass == "lumped" else 5e-3)
    for mode in range(6):
        order = observed_order(1.0 / DIVISIONS, found[:, mode] / exact[mode] - 1.0)
        assert 1.75 < order < 2.05


def test_frequencies_go_with_thickness_and_density():
    """omega ~ t sqrt(E / rho): membrane stiffness has no part in bending modes."""
    thin = fd.Sheet(3e6, 0.3, 0.001, density=5.0)
    found = []
    for sheet in (SHEET, thin):
        s = shell(SQUARE, sheet, divisions=6, clamped=[WEST])
        held = dofs(np.flatnonzero(s.nodes[:, 0] < 1e-12))
        unit = np.sqrt(sheet.bending_modulus / (sheet.density * sheet.thickness))
        found.append(angular_frequencies(s, held, 4, unit) / unit)
    assert found[1] == pytest.approx(found[0], rel=1e-8)
