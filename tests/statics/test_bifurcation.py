"""Bifurcations: located, labelled and followed (closed forms: tests/statics/trusses.py)."""

from __future__ import annotations

from contextlib import nullcontext

import numpy as np
import pytest
from scipy.optimize import brentq
from trusses import VonMises, apex, marked, snapped

import foldyn as fd
from foldyn.algebra.superlu import SuperLU
from foldyn.errors import FoldynWarning, InputError
from foldyn.plots.path import describe_point
from foldyn.statics import Settings, stability, switch_branch, trace
from foldyn.sweeps import MEASURES
from foldyn.sweeps.measure import asked

pytestmark = pytest.mark.filterwarnings("ignore:the path loses stability")

STEEP = VonMises(h=2.0)  # above sqrt(3) b: it gives way sideways first
Z0 = np.sqrt(STEEP.h**2 - 2 * STEEP.b**2)  # height of the apex at the bifurcation
CRITICAL = 2 * STEEP.EA * STEEP.b**2 * Z0 / STEEP.L**3
FACTORS = [CRITICAL, STEEP.limit, -STEEP.limit, -CRITICAL]


def down(method="arc_length", **given):
    return snapped(STEEP.case(free="xz"), method, first_step=100.0, steps=60, **given)


@pytest.fixture(scope="module")
def path():
    return down()


@pytest.mark.parametrize("method", ["mgdcm", "arc_length"])
def test_located_and_labelled(method):
    found = marked(down(method))
    assert found.point.values.tolist() == ["bifurcation", "limit", "limit", "bifurcation"]
    np.testing.assert_allclose(found.load_factor, FACTORS, rtol=1e-11)
    heights = [STEEP.h - Z0, *STEEP.limit_at, STEEP.h + Z0]
    np.testing.assert_allclose(-apex(found), heights, rtol=1e-8)


def test_stability_counts(path):
    """One for giving way sideways, between the bifurcations; one more between the limit points."""
    v, regular = -apex(path), path.point.values == "regular"
    sideways = (v > STEEP.h - Z0) & (v < STEEP.h + Z0)
    expected = sideways + ((v > STEEP.limit_at[0]) & (v < STEEP.limit_at[1])).astype(int)
    assert set(expected[regular]) == {0, 1, 2}
    np.testing.assert_array_equal(path.negative_eigenvalues.values[regular], expected[regular])
    assert np.abs(apex(path, "x")).max() < 1e-10  # the path stays symmetric


def lose_equilibria(monkeypatch, is_lost):
    """Let no equilibrium be found on the way of a step where `is_lost` (height of the apex)."""
    plain = stability.Section.at

    def at(self, share, low, high):
        mark = plain(self, share, low, high)
        height = STEEP.h + float(mark.station.point.u[8]) if mark else np.inf
        return None if is_lost(height) else mark

    monkeypatch.setattr(stability.Section, "at", at)


def test_a_bifurcation_among_lost_equilibria_has_an_interval(monkeypatch):
    """None found within 1 mm of it: it is marked all the same, and the load factors enclose it."""
    lose_equilibria(monkeypatch, lambda z: abs(z - Z0) < 1e-3)
    path = marked(down())
    assert path.point.values.tolist() == ["bifurcation", "limit", "limit", "bifurcation"]
    low, high = path.interval.values.T
    assert (low <= CRITICAL)[0] and (high >= CRITICAL)[0]
    per_height = STEEP.load(STEEP.h - Z0 - 1e-3) - STEEP.load(STEEP.h - Z0 + 1e-3)
    assert abs(per_height) * 0.9 < high[0] - low[0] < 20 * abs(per_height)
    np.testing.assert_array_equal(low[1:], high[1:])  # those that are located
    case, value = STEEP.case(free="xz"), {}
    for name in ("bifurcation_load", "bifurcation_interval", "limit_load", "limit_interval"):
        told = pytest.warns(FoldynWarning, match="lies between the load factors")
        with told if name == "bifurcation_load" else nullcontext():
            value[name] = asked(name, MEASURES).of(path, case, {})
    np.testing.assert_array_equal(value["bifurcation_interval"], [low[0], high[0]])
    assert value["bifurcation_load"] == pytest.approx(0.5 * (low[0] + high[0]))
    np.testing.assert_allclose(value["limit_interval"], STEEP.limit, rtol=1e-9)
    assert "between" in path.attrs["stability_changes"]
    assert "bifurcation between" in describe_point(path, 0)
    (axes,) = fd.plots.plot_load_displacement(path, 2, direction="z").axes
    (ends,) = (line for line in axes.lines if line.get_label() == "_interval")
    np.testing.assert_allclose(ends.get_ydata(), [low[0], high[0]])


@pytest.mark.parametrize("all_lost", [False, True])
def test_a_limit_point_among_lost_equilibria_has_an_interval(monkeypatch, all_lost):
    """It lies above the load factors on both sides, below where their tangents meet."""
    near = STEEP.h - STEEP.limit_at[0]
    lose_equilibria(monkeypatch, lambda z: all_lost or abs(z - near) < 0.05)
    path = marked(down())
    first = path.point.values.tolist().index("limit")
    low, high = path.interval.values[first]
    assert low < STEEP.limit < high
    assert high - low < 0.3 * STEEP.limit
    located = marked(down())
    assert path.point.values.tolist() == located.point.values.tolist()


def test_measures_refuse_paths_that_have_not_looked():
    case = STEEP.case(free="xz")
    path = trace(case, load_factors=[0.5 * CRITICAL, 1.02 * CRITICAL])
    assert path.negative_eigenvalues.values.tolist() == [0, 1]
    with pytest.raises(InputError, match=r"stability changes between.*arc_length"):
        asked("bifurcation_load", MEASURES).of(path, case, {})


def test_by_bisection_alone(monkeypatch):
    """Solvers that do not tell their pivots (PARDISO) locate by the count."""
    found, plain, pivots = [], stability._bracketed, SuperLU.pivots
    monkeypatch.setattr(stability, "_bracketed", lambda *a: found.append(1) or plain(*a))
    monkeypatch.setattr(SuperLU, "negative", lambda self: int((pivots(self) < 0).sum()))
    monkeypatch.setattr(SuperLU, "pivots", lambda self: None)
    np.testing.assert_allclose(marked(down()).load_factor, FACTORS, rtol=1e-9)
    assert len(found) == 4


def test_branch_is_the_circle(path):
    """In both directions, which are mirror images."""
    case, ends = STEEP.case(free="xz"), []
    for direction in (1, -1):
        branch = switch_branch(path, case=case, direction=direction, steps=40)
        x, z = apex(branch, "x"), STEEP.h + apex(branch)
        assert branch.point.values[0] == "bifurcation"
        assert np.sign(x[1]) == direction == branch.attrs["branch_direction"]
        assert np.ptp(z) > 1.9 * Z0  # from one crossing to the other
        np.testing.assert_allclose(x**2 + z**2, Z0**2, rtol=1e-8)
        load = 2 * STEEP.EA * STEEP.b**2 * z / STEEP.L**3
        np.testing.assert_allclose(branch.load_factor, load, atol=1e-8 * CRITICAL)
        ends.append((direction * x[:10], z[:10]))
    np.testing.assert_allclose(*ends, atol=1e-9)


def test_settings_turn_it_off():
    off = down(settings=Settings(locate=False))
    assert set(off.point.values) == {"regular"}
    assert off.negative_eigenvalues.values.max() == 2
    blind = down(settings=Settings(stability=False))
    assert set(blind.negative_eigenvalues.values) == {-1}
    with pytest.raises(InputError, match="has no bifurcation"):
        switch_branch(off, case=STEEP.case(free="xz"))


def test_double_bifurcation():
    """A pyramid of three struts gives way in all directions at once: two eigenvalues cross.

    Sideways the struts resist with 3 EA/L (S' b^2/(2 L^2) + S), the mean of cos^2 over three
    directions being 1/2; S and S' are the stress and its slope at the stretch of all three.
    """
    h, b, EA = 2.0, 1.0, 1e4
    angle, length = np.radians([0.0, 120.0, 240.0]), np.hypot(h, b)
    feet = np.column_stack([b * np.cos(angle), b * np.sin(angle), np.zeros(3)])
    nodes, bars = np.vstack([feet, [0, 0, h]]), np.array([[0, 3], [1, 3], [2, 3]])
    s = fd.Structure(nodes, bars, np.full(3, 1e-4), fd.Sheet(EA / 1e-4, 0.3, 0.01))
    law = s.bar_law

    def sideways(stretch):
        return law.slope(stretch) * b**2 / (2 * length**2) + law.stress(stretch)

    stretch = brentq(sideways, 0.7, 1.0, xtol=1e-15)
    load = -3 * EA / length * float(law.stress(stretch)) * np.sqrt((stretch * length) ** 2 - b**2)
    case = fd.Case(s, [fd.Fix([0, 1, 2], "xyz")], [fd.Force([3], (0, 0, -1.0))])
    path = trace(
        case, "arc_length", first_step=50.0, steps=20, until=lambda u, f: u[3, 2] < -0.3 * h
    )
    (factor,) = marked(path, "bifurcation").load_factor
    assert float(factor) == pytest.approx(load, rel=1e-8)
    assert {0, 2} <= set(path.negative_eigenvalues.values.tolist())
    for mode in (0, 1):
        branch = switch_branch(path, case=case, mode=mode, steps=3)
        aside = branch.displacement.values[-1, 3, :2]
        assert np.linalg.norm(aside) > 0.01
        # by symmetry a branch leaves towards a foot or away from one
        sixths = np.degrees(np.arctan2(aside[1], aside[0])) / 60.0
        assert sixths == pytest.approx(round(sixths), abs=1e-5)
        assert branch.residual.values.max() < 1e-9


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"at": 0}, "the bifurcations of the path are steps"),
        ({"direction": 2}, "give 1 or -1"),
        ({"method": "newton"}, "'arc_length' or 'mgdcm'"),
        ({"mode": 5}, "has only 2 modes"),
        ({"case": None}, "cannot be run again"),  # built by hand, so that no path rebuilds it
    ],
)
def test_refuses_what_is_no_bifurcation(path, options, message):
    with pytest.raises(InputError, match=message):
        switch_branch(path, **{"case": STEEP.case(free="xz"), **options})


@pytest.mark.matrix
def test_a_tube_buckles_at_one_load_whatever_the_steps():
    """Its equilibria are hard to find beside the bifurcation: the tangent is nearly singular."""
    pattern = fd.patterns.kresling(sides=8, radius=0.04, height=0.022, twist=-22.5, storeys=4)
    sheet = fd.Sheet(3e9, 0.3, 2.03e-4, 1300.0, length_scale_ratio=3)
    supports = [fd.Fix("zmin"), fd.Fix("zmax", "xy"), fd.Impose("zmax", "z", -0.006)]
    case = fd.Case(fd.discretize(pattern, sheet, preset="n5b8e"), supports)
    ways = [[0.0, 0.45, 0.497], [0.0, 0.48, 0.51]]
    first = [marked(trace(case, "displacement", load_factors=way)) for way in ways]
    assert all(found.point.values[0] == "bifurcation" for found in first)
    loads = [float(found.load_factor[0]) for found in first]
    np.testing.assert_allclose(loads, 0.4946, rtol=3e-4)  # by the lowest eigenvalue of modes
    assert np.ptp(loads) < 1e-5
