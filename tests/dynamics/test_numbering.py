"""The order of the nodes in memory changes nothing but rounding."""

from __future__ import annotations

import numpy as np
import pytest
from measured import agree
from moving_sheets import HEAVY, LINEAR, cell

import foldyn as fd
from foldyn.dynamics import METHODS
from foldyn.mechanics.model import renumber
from foldyn.structures import bars_hinges


def everything(mass: str) -> fd.Case:
    """Folds and bends of one law, moving supports, actuated folds, every kind of damping."""
    s = cell((3, 2), 100, HEAVY, mass=mass, **LINEAR)
    supports = [
        fd.Fix([0, 1, 2], "x"), fd.Fix([0, 2], "z"), fd.Fix([1], "y"),
        fd.Impose([30, 31], "x", [0.01, 0.02], fd.Ramp(0.05, smooth=True)),
        fd.BaseMotion("z", fd.Harmonic(20.0), 1e-3),
    ]  # fmt: skip
    loads = [
        fd.Force([33], (0.0, 0.0, 0.1), fd.Harmonic(30.0)),
        fd.Gravity((0.0, 0.0, -9.81)),
        fd.Actuate([3, 5, 8], 150.0, fd.Ramp(0.05)),
    ]
    return fd.Case(s, supports, loads, fd.Rayleigh(alpha=1.0, beta=1e-5))


@pytest.mark.filterwarnings("ignore:steps of")  # the stiff bars alone need small ones
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "mass", [pytest.param("mixed_voronoi", marks=pytest.mark.matrix), "consistent"]
)
def test_a_motion_in_another_order(mass, method, monkeypatch):
    case = everything(mass)
    u = 1e-3 * np.random.default_rng(1).standard_normal(case.structure.nodes.shape)
    u[case.fixed] = 0.0
    options = {"method": method, "interval": 0.01, "initial": fd.State(displacement=u)}
    one = fd.simulate(case, 0.05, **options)

    def shuffled(model):
        return np.random.default_rng(2).permutation(len(model.rest))

    monkeypatch.setattr(bars_hinges, "SMALL", 0)
    monkeypatch.setattr(bars_hinges, "node_order", shuffled)
    two = fd.simulate(case, 0.05, **options)
    assert two.displacement.dtype == np.float64
    agree(two, one, 1e-9)
    assert float(np.abs(one.displacement).max()) > 5e-3


def test_hinges_keep_their_numbers():
    model = everything("panel").structure.model
    order = np.random.default_rng(3).permutation(len(model.rest))
    other, rows = renumber(model, order)
    np.testing.assert_array_equal(order[other.hinges], model.hinges[rows])
    np.testing.assert_array_equal(other.hinge_rest, model.hinge_rest[rows])


def test_the_order_of_a_large_sheet_brings_neighbors_together():
    plain = cell((12, 12), 100).body
    found, by = plain.renumbered()
    np.testing.assert_array_equal(by.order[by.rank], np.arange(plain.rows))

    def reach(of):
        return int(np.abs(np.diff(of.sheet.model.bars.astype(np.int64), axis=1)).max())

    assert reach(found) < 0.3 * reach(plain)
