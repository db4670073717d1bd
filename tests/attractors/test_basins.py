"""Basins of attraction of a cell with two states."""

from __future__ import annotations

import runpy
import warnings
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from two_bars import TURN, at, duffing, place

import foldyn as fd
from foldyn.attractors.grid import told_apart
from foldyn.errors import FoldynWarning, InputError

ALPHA = 0.25
DOCS = Path(__file__).resolve().parents[2] / "docs"


@pytest.fixture(scope="module")
def cell():
    return duffing(-1.0, ALPHA)


def basins(case: fd.Case, side: np.ndarray, **more):
    return fd.basins(
        case,
        lambda x, v: at(case, x, v),
        grid={"x": side, "v": side},
        duration=60.0,
        dt=0.05,
        **more,
    )


@pytest.fixture(scope="module")
def found(cell):
    return basins(cell, np.linspace(-1.4, 1.4, 14))


@pytest.mark.matrix
def test_basins_of_a_symmetric_cell_are_symmetric(cell, found):
    label = found.basin.values
    assert set(np.unique(label)) == {0, 1}
    np.testing.assert_array_equal(label[::-1, ::-1], 1 - label)
    np.testing.assert_array_equal(found.share, 0.5)
    x = place(cell, found.displacement.values)
    np.testing.assert_allclose(sorted(x[:, -1]), [-1.0, 1.0], atol=1e-3)
    assert (found.periods == 1).all()


@pytest.mark.matrix
def test_the_boundary_is_the_stable_manifold_of_the_saddle(cell):
    """From the saddle backward in time, along the direction that comes to it."""
    root = -0.5 * ALPHA - np.sqrt(0.25 * ALPHA**2 + 1.0)
    line = solve_ivp(
        lambda t, y: [-y[1], ALPHA * y[1] - y[0] + y[0] ** 3],
        (0.0, 10.0), [1e-4, 1e-4 * root], rtol=1e-10, atol=1e-12, dense_output=True,
    )  # fmt: skip
    t = np.linspace(4.0, 9.6, 12)
    points, ahead = line.sol(t).T, line.sol(t + 1e-4).T
    across = np.stack([-(ahead - points)[:, 1], (ahead - points)[:, 0]], axis=1)
    across *= 0.02 / np.linalg.norm(across, axis=1)[:, None]
    assert np.abs(points).max() > 1.0  # far from the saddle
    sides = [points + across, points - across, -points - across, -points + across]
    starts = np.concatenate(sides)
    ends = fd.basins(
        cell,
        lambda k: at(cell, *starts[int(k)]),
        grid={"k": np.arange(len(starts))},
        duration=100.0,
        dt=0.02,
    ).basin.values.reshape(4, -1)
    assert (ends[:, 0] >= 0).all()
    np.testing.assert_array_equal(ends, np.repeat(ends[:, :1], len(t), axis=1))
    assert ends[0, 0] != ends[1, 0]  # another state on either side
    assert ends[2, 0] == ends[1, 0] and ends[3, 0] == ends[0, 0]  # mirrored


@pytest.mark.matrix
def test_a_finer_grid_moves_the_boundary_by_less_than_a_cell(cell, found):
    fine = basins(cell, np.linspace(-1.4, 1.4, 27)).basin.values
    coarse = found.basin.values
    np.testing.assert_array_equal(fine[::2, ::2], coarse)
    between = fine[1::2, 1::2]  # the middle of each cell
    corners = [coarse[:-1, :-1], coarse[1:, :-1], coarse[:-1, 1:], coarse[1:, 1:]]
    agree = np.all([one == corners[0] for one in corners], axis=0)
    assert agree.mean() > 0.6
    np.testing.assert_array_equal(between[agree], corners[0][agree])


@pytest.mark.matrix
def test_motions_of_a_drive_are_told_apart_by_their_orbits():
    """A small force: a vibration in each well, mirrored half a period later."""
    case = duffing(-1.0, ALPHA, 0.05, omega=1.1)
    found = fd.basins(
        case, lambda x: at(case, x), grid={"x": [-1.2, -0.9, 0.9, 1.2]}, duration=50 * TURN / 1.1
    )
    assert found.basin.values.tolist() == [0, 0, 1, 1]
    assert found.periods.values.tolist() == [1, 1]
    assert found.attrs["period"] == pytest.approx(TURN / 1.1)
    first, second = place(case, found.displacement.values)[:, -1]
    assert first < -0.9 and second > 0.9 and abs(first + second) > 1e-3


def test_chaos_is_no_attractor_that_repeats():
    case = duffing(0.0, 0.05, 7.5, phase=90.0)
    with pytest.warns(FoldynWarning, match="2 of 2 motions do not repeat"):
        found = fd.basins(
            case, lambda x: at(case, x), grid={"x": [2.0, 2.5]}, duration=50 * TURN, dt=TURN / 400
        )
    assert found.basin.values.tolist() == [-1, -1] and found.sizes["attractor"] == 0


@pytest.mark.matrix
def test_starts_that_all_end_in_one_orbit_have_its_number():
    """Once a period they are in one place, which has no range by which to compare."""
    case = duffing(1.0, 1.0, 0.1, cubic=False)  # at resonance: x = -0.1 cos t
    for places in ([0.0], [0.0, 0.3]):
        found = fd.basins(
            case, lambda x: at(case, x), grid={"x": places}, duration=8.0 * TURN, dt=TURN / 256
        )
        assert found.basin.values.tolist() == [0] * len(places)
        np.testing.assert_allclose(place(case, found.displacement.values), -0.1, rtol=1e-3)


def test_an_orbit_is_the_same_whichever_of_its_periods_is_seen_first():
    ends = np.zeros((3, 6, 2, 1, 3))
    ends[:, :, 0, 0, 0] = np.tile([0.0, 1.0, 3.0], 2), np.tile([3.0, 0.0, 1.0], 2), [0, 3, 1] * 2
    label, first, periods = told_apart(ends, np.ones(2), 0.01, 3.0)
    assert label.tolist() == [0, 0, 1] and first == [0, 2] and periods == [3, 3]


@pytest.mark.matrix
def test_a_kresling_tower_falls_to_either_side_of_its_barrier():
    """Let go at rest on the path, half a millimeter before and after the saddle."""
    script = runpy.run_path(str(DOCS / "long_motions_figures.py"))
    case = script["tower"]()
    path = script["pressed"](case)
    (saddle,) = (state for state in fd.landscape(path).states if not state.stable)
    found = fd.basins(
        case, script["starts"](path), grid={"stroke": saddle.stroke + np.array([-5e-4, 5e-4])},
        duration=1.5,
        dt=2.5e-4,
    )  # fmt: skip
    assert found.basin.values.tolist() == [0, 1]
    down = -found.displacement.sel(axis="z").isel(record=-1, node=slice(6, 12)).mean("node")
    np.testing.assert_allclose(down, [0.0, 0.03105], atol=2e-4)


@pytest.mark.matrix
def test_a_grid_that_was_cut_off_goes_on(tmp_path, monkeypatch):
    s = fd.discretize(
        fd.patterns.simple_fold(1.0, 1.0, dihedral=60),
        fd.Sheet(1e6, 0.25, 0.1, density=1.0),
        preset="plate",
    )
    case = fd.Case(s, [fd.Fix([4, 5]), fd.Fix([0, 1], "yz")], damping=fd.Rayleigh(alpha=40.0))
    monkeypatch.setattr("foldyn.attractors.grid.AT_ONCE", 2)

    def pulled(length):
        u = np.zeros((len(s.nodes), 3))
        u[[0, 1], 0] = length
        return fd.State(u)

    def run(lengths, **more):
        return fd.basins(case, pulled, grid={"length": lengths}, duration=0.5, dt=5e-5, **more)

    lengths, told = [-0.01, 0.0, 0.005, 0.01], []

    def cut(now):
        told.append(now.steps)
        if now.steps == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(lengths, folder=tmp_path, progress=cut)
    (kept,) = tmp_path.glob("*.npz")
    before = kept.stat().st_mtime_ns
    again = run(lengths, folder=tmp_path)
    assert kept.stat().st_mtime_ns == before and len(list(tmp_path.glob("*.npz"))) == 2
    np.testing.assert_array_equal(again.displacement, run(lengths).displacement)
    kept.write_bytes(kept.read_bytes()[:-50])  # damaged: it is computed again
    assert run(lengths, folder=tmp_path).equals(again)
    run(lengths, folder=tmp_path, record=5)
    assert len(list(tmp_path.glob("*.npz"))) == 4
    arch = duffing(-1.0, ALPHA)
    with pytest.raises(InputError, match="folder: this case cannot be stored"):
        fd.basins(
            arch, lambda x: at(arch, x), grid={"x": [1.0]}, duration=1.0, dt=0.05, folder=tmp_path
        )


def test_a_start_that_fails_is_named(cell):
    for message, given in {
        "initial: raised ZeroDivisionError at {'x': 0.0}": (lambda x: 1 / x, {"x": [0.0]}),
        "initial: got int, give a State": (lambda x: 1, {"x": [0.0]}),
        "initial = 3: must be a function": (3, {"x": [0.0]}),
        "grid.x: must be a list": (lambda x: at(cell, x), {"x": 1.0}),
        "grid = \\[\\]: give values by name": (lambda x: at(cell, x), []),
        "grid: 'record' is a name in the result": (
            lambda record: at(cell, record),
            {"record": [1.0]},
        ),
        "grid: a grid of 1e.10 starts needs about": (
            lambda x, v: at(cell, x, v),
            {"x": np.zeros(10**5), "v": np.zeros(10**5)},
        ),
    }.items():
        with pytest.raises(InputError, match=message), warnings.catch_warnings():
            fd.basins(cell, given[0], grid=given[1], duration=10.0)


def test_orbits_met_at_another_phase_are_the_same():
    """Of two periods, one half a cycle later; beside them one that does not repeat."""
    ends = np.zeros((3, 4, 2, 1, 3))
    ends[0, :, 0, 0, 0] = 1.0, 2.0, 1.0, 2.0
    ends[1, :, 0, 0, 0] = 2.0, 1.0, 2.0, 1.0
    ends[2, :, 0, 0, 0] = 1.0, 2.0, 1.0, 2.1
    label, kept, periods = told_apart(ends, np.array([1.0, 0.0]), 1e-3, 1.0)
    assert label.tolist() == [0, 0, -1] and kept == [0] and periods == [2]
