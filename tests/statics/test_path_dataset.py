"""The dataset of a path: what it holds, how it is stored, and what it says when a path ends."""

from __future__ import annotations

import numpy as np
import pytest
from sheets import compression, specimen, total_force
from trusses import APEX, VonMises, apex

import foldyn as fd
from foldyn.errors import ComputationError, FoldynWarning, MotionInterrupted
from foldyn.results import path_dataset
from foldyn.statics import Settings, switch_branch, trace


@pytest.fixture(scope="module")
def path():
    return trace(compression(weight=True), "displacement", steps=4, constant="gravity")


def test_what_it_holds(path):
    assert path.displacement.dims == ("step", "node", "axis")
    assert path.displacement.attrs["units"] == "m"
    assert path.load_factor.dims == ("step",) and path.reaction.dims == ("step", "support")
    axes = ["xyz".index(axis) for axis in path.support_axis.values]
    np.testing.assert_array_equal(3 * path.support_node + axes, compression().supported_dofs)
    for name in ("strain_bars", "strain_folds", "strain_bends", "work"):
        assert path[name].dims == ("step",) and path[name].attrs["units"] == "J"
    assert path.negative_eigenvalues.dtype.kind == "i"
    assert path.iterations.values.sum() <= path.attrs["newton_iterations"]
    expected = {
        "foldyn_result": "path", "status": "complete", "method": "displacement", "rerunnable": 1,
        "solver": "superlu", "tolerance": 1e-9, "steps": 4, "step_cuts": 0,
    }  # fmt: skip
    assert {key: path.attrs[key] for key in expected} == expected
    assert np.atleast_1d(path.attrs["constant"]).tolist() == [0]
    assert path.attrs["wall_seconds"] > 0.0
    state = fd.initial_state(path, at=2)
    np.testing.assert_array_equal(state.displacement, path.displacement.values[2])
    assert state.velocity is None


def test_energies_and_reactions_are_those_of_the_states(path):
    s = compression().structure
    for k, u in enumerate(path.displacement.values):
        for name, value in s.energies(u).items():
            assert float(path[name][k]) == pytest.approx(value, rel=1e-12, abs=1e-18)
    top = s.mass.sum(axis=1)[:7].sum() * 9.81  # its own share goes into the reaction directly
    force = s.internal_force(path.displacement.values[-1])[:7, 0].sum()
    assert total_force(path)[-1] == pytest.approx(force - top, rel=1e-9)
    assert total_force(path)[0] < 0.0


@pytest.fixture
def stored(tmp_path):
    """A result that has been saved and loaded."""

    def stored(result):
        fd.save(result, tmp_path / "result.nc")
        return fd.load(tmp_path / "result.nc")

    return stored


@pytest.mark.matrix
def test_saved_and_loaded(path, stored):
    again = stored(path)
    assert again.equals(path) and again.point.values.tolist() == ["regular"] * 5
    repeated = trace(fd.case_of(again), "displacement", steps=4, constant="gravity")
    np.testing.assert_array_equal(repeated.displacement, path.displacement)


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore:the path loses stability")
def test_partial_paths_and_branches_are_stored_too(stored):
    """A path of a structure made by hand cannot be run again."""
    with pytest.raises(ComputationError) as caught:
        trace(VonMises().case(), load_factors=[1.0, 10.0])
    again = stored(caught.value.partial)
    assert again.sizes["step"] == 1 and again.attrs["status"] == "stopped"
    assert again.attrs["stopped_because"] in str(caught.value)
    assert again.attrs["remedy"] in str(caught.value)
    assert again.attrs["rerunnable"] == 0
    assert again.attrs["not_rerunnable_because"] == "its structure has no pattern"
    case = VonMises(h=2.0).case(free="xz")
    path = trace(case, "arc_length", first_step=100.0, steps=12)
    branch = switch_branch(stored(path), case=case, steps=5)
    assert stored(branch).point.values[0] == "bifurcation"


def test_interrupted():
    seen = []

    def interrupt(point):
        seen.append(point.factor)
        if len(seen) == 3:
            raise KeyboardInterrupt

    with pytest.raises(MotionInterrupted, match="after 3 points") as caught:
        trace(compression(), "displacement", steps=10, progress=interrupt)
    partial = caught.value.partial
    assert seen == partial.load_factor.values.tolist()  # every point
    assert partial.attrs["status"] == "stopped"


def test_until_ends_the_path():
    path = trace(compression(), "displacement", steps=10, until=lambda u, factor: u[0, 0] > 0.02)
    assert path.sizes["step"] == 5
    assert float(path.displacement[-1, 0, 0]) == pytest.approx(0.4 * 0.056)
    assert path.attrs["status"] == "complete"


WAYS = [
    ("newton", {"load_factors": [0.0, 1.0, 2.0]}),
    ("displacement", {"steps": 3}),
    ("mgdcm", {"steps": 4}),
    ("arc_length", {"steps": 4}),
]


@pytest.mark.parametrize(("method", "given"), WAYS)
def test_a_path_says_when_until_is_not_reached(method, given):
    truss = VonMises()
    case = truss.case(free="xz", load=-0.2 * truss.limit)
    if method == "displacement":
        held = fd.Impose([APEX], "z", -0.02 * truss.h)
        case = fd.Case(truss.structure(), [*case.supports, held])
    until = {"node": APEX, "axis": "z", "displacement": -0.9 * truss.h}
    with pytest.warns(FoldynWarning, match=r"has not reached `until`: take more steps"):
        path = trace(case, method, until=until, **given)
    assert path.attrs["status"] == "until not reached"
    assert abs(float(apex(path)[-1])) < 0.9 * truss.h


@pytest.mark.parametrize("method", ["newton", "mgdcm", "arc_length"])
def test_a_path_stops_where_it_leaves_any_sensible_range(method):
    """A truss that is pulled and pulled: no bar becomes twice as long."""
    truss = VonMises(h=0.3)
    way = {"load_factors": np.linspace(0.0, 10.0, 41)} if method == "newton" else {"steps": 200}
    with pytest.raises(
        ComputationError, match=r"any sensible range.*times as far.*units"
    ) as caught:
        trace(truss.case(load=3.0 * truss.EA), method, **way)
    partial = caught.value.partial
    rise = truss.h + apex(partial)
    longest = np.hypot(truss.b, rise) / truss.L
    assert partial.attrs["status"] == "stopped"
    assert 1.2 < longest[-1] <= 2.0
    np.testing.assert_allclose(
        partial.load_factor, -truss.load(-apex(partial)) / (3.0 * truss.EA), rtol=1e-8
    )


def test_statistics_cannot_hide_what_every_result_has():
    empty = [
        dict.fromkeys(("strain_bars", "strain_folds", "strain_bends", "work"), ()),
        dict.fromkeys(("negative_eigenvalues", "point", "iterations", "residual"), ()),
    ]
    with pytest.raises(ValueError, match="attribute of every result"):
        path_dataset(
            compression(), [], np.zeros((0, 111, 3)), np.zeros((0, 18)), *empty, {"rerunnable": 1}
        )


@pytest.mark.matrix
def test_cost_of_the_specimen():
    """MERLIN2 takes 1151 iterations for its 87 increments."""
    path = trace(compression(), "displacement", steps=87)
    assert path.attrs["newton_iterations"] < 400
    assert path.attrs["step_cuts"] == 0
    assert path.attrs["factorizations"] <= path.attrs["newton_iterations"] + 1
    assert len(specimen().nodes) == 111


def test_settings_reach_the_solver():
    loose = Settings(tolerance=1e-3, stability=False)
    path = trace(compression(), "displacement", steps=4, settings=loose)
    assert path.attrs["tolerance"] == 1e-3
    assert set(path.negative_eigenvalues.values) == {-1}
