"""Absorbing ends of chains: their impedance, and the energy that comes back from them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from kresling_chains import TRUSS, UNIT, cell

import foldyn as fd
from foldyn.errors import ComputationError, InputError
from foldyn.linear import LongWaves, absorbing_end, long_waves

CELLS = 24
END = range(6 * CELLS, 6 * CELLS + 6)


def test_impedance_is_the_root_of_stiffness_and_mass():
    waves = long_waves(cell())
    z, k, m = waves.impedance, np.asarray(waves.stiffness), np.asarray(waves.mass)
    np.testing.assert_allclose(z @ np.linalg.solve(m, z), k, rtol=1e-9)
    assert np.linalg.eigvalsh(z)[0] > 0.0
    one = LongWaves((1, 0, 0), [[50.0]], [[2.0]])
    assert one.impedance == pytest.approx(10.0)
    assert one.speeds == pytest.approx(5.0)


def test_long_waves_have_the_slopes_of_the_bands_and_the_static_stiffness():
    stiff = replace(TRUSS, plate_stiffness=1e8)
    waves, static = long_waves(stiff.cell), stiff.two_dofs
    np.testing.assert_allclose(waves.stiffness, static.stiffness, rtol=1e-4)
    np.testing.assert_allclose(waves.mass, static.mass, rtol=1e-9, atol=1e-15)
    slopes = fd.bands(cell(), [[0.01]], count=4).frequency.values[0] * 2.0 * np.pi / 0.01
    for speed in long_waves(cell()).speeds:
        assert np.abs(slopes / speed - 1.0).min() < 1e-4


def test_dashpots_add_up_to_the_impedance():
    case, waves = UNIT.chain(3), long_waves(cell())
    found = absorbing_end(case, range(18, 24), waves=waves)
    total = np.zeros((2, 2))
    for dashpot in found:
        x, y, _ = case.structure.nodes[dashpot.nodes[0]]
        way = np.asarray(dashpot.direction) @ np.array([[0.0, -y], [0.0, x], [1.0, 0.0]])
        total += dashpot.coefficient * np.outer(way, way)
    np.testing.assert_allclose(total, waves.impedance, rtol=1e-9)


@pytest.fixture(scope="module")
def reflected():
    """Energy at the end over the most, of a long pulse that has come back, by kind of end."""
    waves = long_waves(cell())
    slow = float(waves.speeds[0])
    period = 2.0 * np.pi / (0.3 * slow)  # s: a phase of 0.3 rad per cell
    times = np.linspace(0.0, period, 101)
    push = fd.Table(times, 0.5 * (1.0 - np.cos(2.0 * np.pi * times / period)))
    chain = UNIT.chain(CELLS)
    ends = {"absorbing": absorbing_end(chain, END, waves=waves), "free": []}
    found = {}
    for name, end in ends.items():
        case = fd.Case(
            chain.structure, [*chain.supports, *end], [fd.Force(range(6), (0, 0, 1e-5), push)],
            masses=chain.masses,
        )  # fmt: skip
        run = fd.simulate(case, period + 1.9 * CELLS / slow, method="rk4", dt=2e-4, interval=0.01)
        energy = sum(run[each] for each in run if each == "kinetic" or each.startswith("strain_"))
        found[name] = float(energy[-1] / energy.max())
        assert run.attrs["energy_error"] < 1e-3
    return found


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore:panels that stretch hold")
def test_an_absorbing_end_sends_hardly_anything_back(reflected):
    """At 0.3 rad per cell; the error of the impedance grows with the square of the phase."""
    assert reflected["free"] > 0.99
    assert reflected["absorbing"] < 2e-3


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: LongWaves((0, 0, 1), [[-1.0]], [[1.0]]), "stiffness"),
        (lambda: LongWaves((0, 0, 1), np.ones((3, 3)), np.eye(3)), "stiffness"),
        (lambda: LongWaves((0, 0, 1), [[1.0, 2.0], [0.0, 1.0]], np.eye(2)), "symmetric"),
        (lambda: LongWaves((0, 0, 1), [[1.0]], np.eye(2)), "mass"),
        (lambda: LongWaves((0, 0, 1), [[1.0]], [[0.0]]), "mass"),
        (lambda: LongWaves((0, 0, 0), [[1.0]], [[1.0]]), "axis"),
        (lambda: long_waves(cell(), along=1), "along = 1: the cell has 1 period, 0"),
        (lambda: long_waves("cell"), "cell"),
        (lambda: absorbing_end(UNIT.chain(1), [0, 99], waves=long_waves(cell())), "nodes"),
        (lambda: absorbing_end(UNIT.chain(1), [0], waves="waves"), "waves"),
    ],
)
def test_what_is_no_long_wave_is_refused(call, words):
    with pytest.raises(InputError, match=words):
        call()


def test_nodes_on_the_axis_are_refused():
    waves = LongWaves((0, 0, 1), np.eye(2), np.eye(2), point=UNIT.structure(1).nodes[0])
    with pytest.raises(InputError, match="node 0 lies on the axis"):
        absorbing_end(UNIT.chain(1), [0, 1], waves=waves)


@pytest.mark.parametrize(
    "support", [fd.Fix(range(6), "z"), fd.Fix([0]), fd.Spring(5.0, nodes=[0], direction="z")]
)
def test_a_chain_that_is_held_has_no_long_waves(support):
    case = UNIT.case(UNIT.structure(1), [0])
    held = fd.Case(case.structure, [support], masses=case.masses)
    with pytest.raises(ComputationError, match="hold none of its nodes along the chain or about"):
        long_waves(fd.UnitCell(held))
