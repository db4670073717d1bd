"""Paths through limit points against closed forms (tests/statics/trusses.py has the sources)."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq
from trusses import APEX, SpringLoaded, VonMises, apex, marked, snapped

import foldyn as fd
from foldyn.errors import ComputationError
from foldyn.statics import Settings, trace

FREE = ("mgdcm", "arc_length")
TRUSS = VonMises()


@pytest.fixture(scope="module", params=FREE)
def whole(request):
    return snapped(TRUSS.case(), request.param, first_step=0.5, steps=60)


def test_whole_path(whole):
    """In equilibrium, with its limit points."""
    v, load = -apex(whole), whole.load_factor.values
    assert v[-1] > 2 * TRUSS.h and load.min() < -0.9 * TRUSS.limit
    assert np.abs(load - TRUSS.load(v)).max() < 1e-8 * TRUSS.limit
    assert whole.attrs["status"] == "complete"
    limits = marked(whole, "limit")
    assert set(whole.point.values) == {"regular", "limit"}
    np.testing.assert_allclose(limits.load_factor, [TRUSS.limit, -TRUSS.limit], rtol=1e-12)
    np.testing.assert_allclose(-apex(limits), TRUSS.limit_at, rtol=1e-8)


def test_stability_along_the_path():
    settings = Settings(largest_turn=1.0)
    path = snapped(TRUSS.case(), first_step=0.5, steps=60, settings=settings)
    path = path.isel(step=path.point.values == "regular")
    unstable = (-apex(path) > TRUSS.limit_at[0]) & (-apex(path) < TRUSS.limit_at[1])
    assert unstable.any()
    np.testing.assert_array_equal(path.negative_eigenvalues, unstable.astype(int))


def test_displacement_control():
    """A spring stiff enough not to snap back: k > -min P'."""
    truss = SpringLoaded(k=150.0)
    path = trace(truss.case(-0.3), "displacement", steps=40)
    v = -apex(path)
    top = (path.support_node == 3) & (path.support_axis == "z")
    load = truss.load(v)
    np.testing.assert_allclose(-path.reaction[:, top].values.ravel(), load, atol=1e-8)
    np.testing.assert_allclose(0.3 * path.load_factor, truss.moved(v), atol=1e-10)
    assert v[-1] > 2 * truss.h and load.min() < 0 < load.max()
    assert not path.negative_eigenvalues.values.any()


@pytest.mark.matrix
@pytest.mark.parametrize("method", FREE)
def test_snap_back(method):
    """Through a soft spring the far end's displacement has limit points itself: 1 + P'(v)/k = 0."""
    truss, settings = SpringLoaded(k=50.0), Settings(largest_turn=2.0)
    path = snapped(truss.case(-1.0), method, 2.05, first_step=0.02, steps=200, settings=settings)
    np.testing.assert_allclose(path.load_factor, truss.moved(-apex(path)), atol=1e-9)
    low, top = truss.h * np.array([1e-3, 1.0])
    first = brentq(lambda x: 1 + truss.slope(x) / truss.k, low, top, xtol=1e-15)
    turns, limits = np.array([first, 2 * truss.h - first]), marked(path, "limit")
    np.testing.assert_allclose(-apex(limits), turns, rtol=1e-8)
    np.testing.assert_allclose(limits.load_factor, truss.moved(turns), rtol=1e-11)
    assert np.ptp(limits.load_factor.values) > 0.2 * truss.h  # it goes back a long way


@pytest.mark.matrix
def test_load_stepping_ends_at_the_limit_point():
    """It returns exactly the given factors, and has not snapped through."""
    with pytest.raises(ComputationError, match="arc_length") as caught:
        trace(TRUSS.case(), load_factors=np.linspace(0.5, 5.0, 10))
    path = caught.value.partial
    assert path.attrs["status"] == "stopped"
    assert "3.79" in path.attrs["stopped_because"] and "arc_length" in path.attrs["remedy"]
    np.testing.assert_allclose(path.load_factor, np.arange(0.5, 4.0, 0.5))
    assert (-apex(path) < TRUSS.limit_at[0]).all()
    path = trace(TRUSS.case(), load_factors=(factors := [0.0, 1.0, 0.5, 3.0]))
    assert path.load_factor.values.tolist() == factors
    np.testing.assert_allclose(TRUSS.load(-apex(path)), factors, atol=1e-9)


@pytest.mark.parametrize("method", FREE)
def test_path_ends_exactly_at_the_last_factor(method):
    path = trace(TRUSS.case(), method, load_factors=(0.0, 3.0))
    assert path.load_factor.values[-1] == 3.0 > path.load_factor.values[:-1].max()
    back = trace(TRUSS.case(), method, load_factors=(0.0, -20.0))
    assert back.load_factor.values[-1] == -20.0
    np.testing.assert_allclose(TRUSS.load(-apex(back)), back.load_factor, atol=1e-7)
    with pytest.raises(ComputationError, match="3 was not reached in 2 steps; give more") as caught:
        trace(TRUSS.case(), method, load_factors=(0.0, 3.0), steps=2)
    assert caught.value.partial.sizes["step"] == 3


def test_starts_near_a_given_state():
    """Beyond the snap-through the truss hangs: v = 2 h at no load."""
    u = np.zeros((3, 3))
    u[APEX, 2] = -1.9 * TRUSS.h
    path = trace(TRUSS.case(), load_factors=[0.0, 1.0], initial=fd.State(u))
    assert apex(path)[0] == pytest.approx(-2 * TRUSS.h, rel=1e-9)
    assert apex(path)[1] < -2 * TRUSS.h
    assert path.attrs["started_from"] == "state"
