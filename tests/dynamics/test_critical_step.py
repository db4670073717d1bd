"""Critical step: closed forms, dense eigensolver, and what happens on both sides of it."""

from __future__ import annotations

import numpy as np
import pytest
from moving_sheets import SHEET, cell, equal_steps
from oscillators import about_the_limit, released, spring
from scipy import linalg

import foldyn as fd
from foldyn.dynamics import METHODS, largest_frequency
from foldyn.dynamics.stability import MARGIN, frequency_bound, stability_limit
from named_models import named

OMEGA = 4.0
DAMPINGS = pytest.mark.parametrize(
    "damping", [{}, {"alpha": 2.0}, {"beta": 0.1}, {"alpha": 1.0, "beta": 1}]
)
# overdamped by stiffness: the fast root is close to -beta w^2
FAST = 0.5 * (1e-2 * 1e4**2 + np.sqrt((1e-2 * 1e4**2) ** 2 - 4 * 1e4**2))


@pytest.mark.parametrize(
    ("method", "omega", "damping", "limit", "near"),
    [
        ("rk4", 10.0, {}, 2 * np.sqrt(2) / 10, 1e-6),
        # 2.7853 / |s| on the negative real axis: s = -alpha for the rigid motion
        ("rk4", 1e-3, {"alpha": 50.0}, 2.785293563 / 50.0, 1e-6),
        ("rk4", 1e4, {"beta": 1e-2}, 2.785293563 / FAST, 1e-4),
        ("rk4", 0.0, {}, np.inf, 0.0),
        ("central_difference", 10.0, {}, 0.2, 1e-6),
        # damping proportional to mass, which the method treats explicitly
        ("central_difference", 10.0, {"alpha": 1.0}, 0.15, 0.33),
    ],
)
def test_stability_limits(method, omega, damping, limit, near):
    found = stability_limit(METHODS[method].growth, omega, fd.Rayleigh(**damping))
    assert found == pytest.approx(limit, rel=near)


@pytest.mark.filterwarnings("ignore:the energy balance")
@pytest.mark.parametrize("method", ["rk4", "central_difference"])
@DAMPINGS
def test_motion_just_below_and_above_the_limit(damping, method):
    case = spring(OMEGA, **damping)
    assert largest_frequency(case) == pytest.approx(OMEGA)
    below, above = about_the_limit(case, method, 1.02)
    # close below its limit the energy that central differences keep is not the oscillator's own
    assert below <= (0.6 if method == "central_difference" else 0.1)
    assert above > 10.0 * below


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore:the energy balance")
@pytest.mark.parametrize("method", ["rk4", "dormand_prince"])
@DAMPINGS
def test_growth_is_that_of_a_computed_step(damping, method):
    """Spectral radius of one step as a matrix on (u, v)."""
    case = spring(OMEGA, **damping)
    for fraction in (0.1, 0.3, 0.5):
        dt = fraction * fd.critical_step(case, method)
        given = {"dt": dt, "force": True} | equal_steps(method)
        columns = []
        for state in (released(0.01), released(0.0, 0.01)):
            motion = fd.simulate(case, dt, method=method, initial=state, **given)
            assert motion.attrs["steps"] == 1
            columns.append([float(motion[q][-1, 1, 0]) for q in ("displacement", "velocity")])
        found = np.abs(np.linalg.eigvals(np.array(columns).T / 0.01)).max()
        resisted = damping.get("alpha", 0.0) + damping.get("beta", 0.0) * OMEGA**2
        wanted = METHODS[method].growth(np.array([OMEGA]), np.array([resisted]), dt)[0]
        assert found == pytest.approx(wanted, rel=1e-9)


@pytest.mark.parametrize("c", [0.0, 1e-9, 1e-3, 0.1, 0.3, 0.5, 1.0, 30.0])
def test_growth_of_central_differences_is_that_of_their_matrix(c):
    """On (u, v, a), in units of the step: u' = u + v + a/2, a' = -w^2 u' - c (v + a), and v'."""
    w = np.concatenate([[0.0], np.geomspace(1e-6, 2.0, 60), [2.0001, 3.0, 20.0]])
    a_row = [-(w**2), -(w**2) - c, -0.5 * w**2 - c]
    one = np.ones_like(w)
    v_row = [0.5 * a_row[0], one + 0.5 * a_row[1], 0.5 * one + 0.5 * a_row[2]]
    step = np.array([[one, one, 0.5 * one], v_row, a_row])
    wanted = np.abs(np.linalg.eigvals(np.moveaxis(step, 2, 0))).max(axis=1)
    found = METHODS["central_difference"].growth(w, np.full_like(w, c), 1.0)
    np.testing.assert_allclose(found, wanted, rtol=1e-7)  # double roots have half the digits


@pytest.mark.parametrize("mass", ["circumcenter", "mixed_voronoi"])
@pytest.mark.parametrize("dihedral", [20.0, 100.0, 179.0])
def test_the_bound_of_frequencies_is_one(dihedral, mass):
    case = fd.Case(cell((3, 2), dihedral, preset="plate", mass=mass), [fd.Fix([0])])
    u = 1e-2 * np.random.default_rng(0).standard_normal(case.structure.nodes.shape)
    for moved in (None, u):
        bound, largest = frequency_bound(case, moved), largest_frequency(case, moved)
        assert largest <= bound < 2.0 * largest


@pytest.mark.parametrize("mass", ["circumcenter", "consistent"])
@pytest.mark.parametrize("cells", [(1, 1), (3, 2)])
def test_largest_frequency_equals_a_dense_eigensolver(mass, cells):
    pattern = fd.patterns.miura(cells, b=1.2, panel_angle=70, dihedral=100)
    laws = {"bend_law": "linear", "fold_law": "linear", "preset": "herkal"}
    s = fd.discretize(pattern, SHEET, mass=mass, **named(laws))
    case = fd.Case(s, [fd.Fix([0], "xyz")])
    free = np.ix_(case.free_dofs, case.free_dofs)
    k = s.tangent(np.zeros_like(s.nodes)).toarray()[free]
    m = np.kron(s.mass.toarray(), np.eye(3))[free]
    exact = np.sqrt(linalg.eigh(k, m, eigvals_only=True)[-1])
    assert exact * (1.0 - 1e-9) <= largest_frequency(case) < exact * (1.0 + 1e-3)


def test_the_specimen_as_the_design_measured_it():
    """Paper specimen, circumcenter mass: 1.55e-5 s undamped, 2e-7 s with beta = 4.1e-4.

    Height 8 s = 100.48 mm of the specimen, b = 25 mm: t = s / sqrt(b^2 - s^2) = cos f tan g.
    """
    rise = 100.48e-3 / 8
    tilt = np.degrees(np.arccos(rise / np.sqrt(0.025**2 - rise**2) / np.tan(np.radians(60))))
    pattern = fd.patterns.miura((4, 3), 0.025, b=0.025, panel_angle=60, dihedral=180 - 2 * tilt)
    sheet = fd.Sheet(1219e6, 0.2, 0.24e-3, 667.0, length_scale_ratio=2.7)
    law = fd.EnhancedLinear(75, 285)
    s = fd.discretize(pattern, sheet, mass="circumcenter", fold_law=law, preset="herkal")
    supports = [fd.Fix(range(56, 63), "x"), fd.Fix([59], "y"), fd.Fix([57, 59, 61], "z")]
    undamped, stiff = (
        fd.critical_step(fd.Case(s, supports, damping=damping)) / MARGIN
        for damping in ((), fd.Rayleigh(14.4, 4.1e-4))
    )
    assert undamped == pytest.approx(1.55e-5, rel=0.02)
    assert stiff == pytest.approx(2e-7, rel=0.1)


def test_largest_frequency_of_panels_whose_edges_give_way():
    """Their turns have no mass and are in balance, as in the motion whose step it limits."""
    s = cell(sheet=fd.Sheet(1e6, 0.25, 0.01, density=100.0), preset="n5b8e")
    case = fd.Case(s, [fd.Fix("xmin")])
    step = fd.critical_step(case, method="central_difference")
    assert step == pytest.approx(MARGIN * 2.0 / largest_frequency(case), rel=1e-6)
