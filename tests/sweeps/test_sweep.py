"""Sweeps: what they compute, keep, refuse and record."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from swept_cases import FRF, MODES, PATH, compiled_here, fails_sometimes

import foldyn as fd
from case_texts import HELD_MIURA_TEXT, changed
from foldyn.analyses.keys import replaced
from foldyn.analyses.reading import case_of_document, read_document
from foldyn.dynamics.gpu import choice
from foldyn.errors import ComputationError, InputError
from foldyn.sweeps import Measure, evaluations, job
from foldyn.sweeps.evaluations import Evaluation

ONE = {"sheet.thickness": [0.01]}
VARY = {"pattern.dihedral": "60:120:3", "sheet.length_scale_ratio": [1, 5]}


@pytest.fixture
def case(tmp_path) -> Path:
    path = tmp_path / "case.toml"
    path.write_text(MODES)
    return path


def of(case: Path, measures=("frequencies",), vary=None, **how):
    return fd.sweep(case, vary or VARY, measures=list(measures), **{"processes": 1, **how})


def frequency(result, case):
    return result["frequency"].values[0]


@pytest.mark.matrix
def test_every_point_is_the_case_file_with_its_values(case):
    found = of(case, ["frequencies", "frequency[2]"])
    assert found["frequencies"].dims == ("dihedral", "length_scale_ratio", "mode")
    assert found["frequencies"].shape == (3, 2, 4)
    document = read_document(case)
    for dihedral in (60, 90, 120):
        for ratio in (1, 5):
            changes = {"pattern.dihedral": dihedral, "sheet.length_scale_ratio": ratio}
            alone = case_of_document(case, replaced(document, changes)).run()
            here = found.sel(dihedral=dihedral, length_scale_ratio=ratio)
            np.testing.assert_array_equal(here["frequencies"], alone["frequency"])
            assert float(here["frequency_2"]) == float(alone["frequency"][1])
    assert (found["failure"] == "").all()
    assert found["dihedral"].attrs["key"] == "pattern.dihedral"


@pytest.mark.matrix
def test_the_result_is_saved_and_carries_its_case_and_its_sweep(case, tmp_path):
    found = of(case)
    fd.save(found, tmp_path / "sweep.nc")
    again = fd.load(tmp_path / "sweep.nc")
    assert again.identical(found)
    assert len(fd.case_of(again).structure.nodes) == len(fd.read_case(case).case().structure.nodes)
    (tmp_path / "again.toml").write_text(str(again["case_file"].values))
    repeated = fd.sweep(tmp_path / "again.toml", processes=1)
    np.testing.assert_array_equal(repeated["frequencies"], found["frequencies"])


@pytest.mark.matrix
def test_processes_give_the_same_and_do_not_compile(case):
    alone = of(case)
    found = of(case, ["frequencies", compiled_here], processes=2)
    np.testing.assert_array_equal(found["frequencies"], alone["frequencies"])
    process, compiled = found["compiled_here"].values.reshape(-1, 2).T
    others = process != os.getpid()  # the first point is computed here
    assert others.sum() == 5
    assert (compiled[others] == 0).all()


@pytest.mark.matrix
def test_the_table_in_the_file(case):
    table = '[sweep]\nmeasures = ["frequencies"]\n[sweep.vary]\n"sheet.thickness" = "0.01:0.02:3"\n'
    case.write_text(MODES + table)
    found = fd.sweep(case, processes=1)
    assert found["frequencies"].dims == ("thickness", "mode")
    assert found["thickness"].attrs["units"] == "m"
    other = fd.sweep(case, measures=["frequency[1]"], processes=1)
    np.testing.assert_array_equal(other["frequency_1"], found["frequencies"][:, 0])
    drawn = case.read_text().replace('"0.01:0.02:3"', '"0.01:0.02"').replace(
        "[sweep]\n", '[sweep]\nsamples = 4\nmethod = "sobol"\n'
    )  # fmt: skip
    case.write_text(drawn)
    found = fd.sweep(case, samples=2, seed=1, processes=1)
    assert found["frequencies"].dims == ("point", "mode")
    assert (found.attrs["samples"], found.attrs["seed"], found.attrs["method"]) == (2, 1, "sobol")
    assert fd.read_case(case).run()["frequency"].size == 4  # any other command leaves it alone


@pytest.mark.matrix
def test_mass_rules_of_the_file_are_an_axis(case):
    case.write_text(changed(MODES, 'model.mass = ["panel", "centroid"]'))
    found = of(case, vary=ONE)
    assert found["mass"].values.tolist() == ["panel", "centroid"]
    results = [fd.read_case(case).run(rule)["frequency"].values for rule in ("panel", "centroid")]
    np.testing.assert_array_equal(found["frequencies"][0], results)
    with pytest.raises(InputError, match=r"model\.mass lists 2 rules"):
        of(case, vary={"sheet.thickness": "0.01:0.02"}, samples=4)
    chosen = of(case, vary={"sheet.thickness": "0.01:0.02", "model.mass": ["panel"]}, samples=4)
    assert chosen["mass"].values.tolist() == ["panel"] * 4


def test_ties_follow(case):
    law = 'model.fold_law = { kind = "enhanced", theta1 = 45, theta2 = 315 }'
    case.write_text(changed(MODES, law))
    ties = {"model.fold_law.theta2": "360 - model.fold_law.theta1"}
    tied = of(case, vary={"model.fold_law.theta1": [30, 100]}, ties=ties)
    free = of(case, vary={"model.fold_law.theta1": [30, 100]})
    np.testing.assert_array_equal(tied["frequencies"][0], free["frequencies"][0])
    assert (tied["frequencies"][1] != free["frequencies"][1]).any()  # mountains lock, too


@pytest.mark.matrix
def test_names_stay_apart(case):
    case.write_text(FRF)
    vary = {"drive[0].force[2]": [1, 2], "damping.alpha": [0.2], "damping.beta": [0.0]}
    found = of(case, ["peak_frequency[8]", "peak_height[8,z]"], vary)
    assert set(found.dims) >= {"force_2", "alpha", "beta"}
    assert set(found["peak_frequency_8"].dims) == {"force_2", "alpha", "beta"}
    ratio = found["peak_height_8_z"].values.ravel()
    assert ratio[0] == pytest.approx(ratio[1], rel=1e-12)  # of a receptance


def test_points_that_fail_are_recorded_and_the_others_computed(case):
    found = of(case, vary={"pattern.dihedral": [90, 500, 120]})
    failed = found["failure"].values
    assert failed[0] == failed[2] == ""
    assert "dihedral = 500" in failed[1]
    assert str(case) not in failed[1]
    assert found.attrs["failed"] == 1
    assert np.isnan(found["frequencies"][1]).all() and np.isfinite(found["frequencies"][::2]).all()


@pytest.mark.matrix
def test_a_measure_that_fails_leaves_the_others(case, tmp_path):
    measures = ["peak_damping[8]", "peak_height[8]", fails_sometimes]
    case.write_text(FRF)
    whole = of(case, ["peak_frequency[8]", "peak_height[8]"], ONE).isel(thickness=0)
    last = float(whole["peak_frequency_8"]) + 0.012  # no half-power point above the peak
    case.write_text(FRF.replace("first = 0.1, last = 3,", f"first = {last - 0.5}, last = {last},"))
    for _ in range(2):  # computed, and kept
        found = of(case, measures, {"sheet.thickness": [0.01, 0.02]}, folder=tmp_path / "points")
        assert np.isnan(found["peak_damping_8"][0])
        height = float(found["peak_height_8"][0])
        assert height == pytest.approx(float(whole["peak_height_8"]), rel=0.02)
        np.testing.assert_array_equal(found["fails_sometimes"], [1.0, np.nan])
        why = found["failure"].values
        assert why[0].startswith("peak_damping[8]: ") and "fails_sometimes" not in why[0]
        assert "fails_sometimes: ZeroDivisionError: too thick" in why[1]


def test_a_measure_cannot_change_the_result_for_others(case):
    """`a -= a[0]` in a function of one's own changed what other measures saw."""
    case.write_text(FRF)

    def relative(result, case):
        response = result["receptance"].values
        response -= response[0]
        return abs(response).max()

    def taking(result, case):
        del result["receptance"]
        return 1.0

    own = {"relative": relative, "taking": taking}
    own["height"] = lambda result, case: float(abs(result.receptance).max())
    found = fd.sweep(case, ONE, measures=own, processes=1)
    assert "relative: ValueError" in str(found["failure"].values[0])
    assert found["taking"] == 1.0 and np.isfinite(found["height"]).all()


def test_a_measure_gives_real_numbers(case):
    """The real part of a response was taken, and nothing for a number, silently."""
    case.write_text(FRF)
    own = {
        "complex": lambda result, case: result["receptance"].values[:, 8, 2],
        "nothing": lambda result, case: None,
        "several": lambda result, case: {1},
    }
    failure = str(fd.sweep(case, ONE, measures=own, processes=1)["failure"].values[0])
    assert "complex: gave complex numbers; take their abs, real or imag" in failure
    assert "nothing: gave nothing; let it return a number or an array" in failure
    assert "no number or array" in failure


def test_a_lack_of_memory_is_not_kept_as_a_failure(case, tmp_path):
    def greedy(result, case):
        raise MemoryError

    found = of(case, [greedy], ONE, folder=tmp_path / "points")
    assert "MemoryError" in str(found["failure"].values[0])
    assert not list((tmp_path / "points").iterdir())


def test_every_changed_byte_of_what_is_kept_shows(tmp_path):
    """As in a header, which numpy reads and whose checksum it does not look at."""
    file, random = tmp_path / "a.npz", np.random.default_rng(1)
    evaluations.KEPT.keep(file, "a", Evaluation({"b": random.random(9999)}, seconds=1.0))
    sound = file.read_bytes()
    assert evaluations.KEPT.find(file, "a") is not None
    shape = sound.index(b"(9999,)") + 1  # of the array: a shorter one would be read
    for place in [shape, *random.integers(0, len(sound), 200).tolist()]:
        changed = bytearray(sound)
        changed[place] = changed[place] - 5 if place == shape else changed[place] ^ 16
        file.write_bytes(changed)
        assert evaluations.KEPT.find(file, "a") is None, place


def test_ones_own_measures(case):
    def shape(result, case):
        return result["shape"].values[0]

    mine = Measure("lowest", ("modes",), frequency, "Hz", "lowest frequency")
    found = fd.sweep(case, ONE, measures=[mine, shape], processes=1)
    assert found["lowest"].attrs["units"] == "Hz"
    assert found["shape"].dims == ("thickness", "shape_0", "shape_1")
    with pytest.raises(InputError, match=r"shape cannot be sent to other proc.* top of a mod"):
        fd.sweep(case, {"sheet.thickness": [0.01, 0.02]}, measures=[shape], processes=2)


def kept(folder: Path) -> dict[str, tuple[int, int]]:
    return {one.name: (one.stat().st_ino, one.stat().st_mtime_ns) for one in folder.iterdir()}


@pytest.mark.matrix
def test_what_is_kept_is_not_computed_again(case, tmp_path):
    folder = tmp_path / "points"
    first = of(case, folder=folder)
    before, told = kept(folder), []
    assert len(before) == 6
    again = of(case, folder=folder, progress=told.append)
    assert kept(folder) == before
    np.testing.assert_array_equal(again["frequencies"], first["frequencies"])
    np.testing.assert_array_equal(again["seconds"], first["seconds"])
    assert (told[-1].done, told[-1].found, told[-1].total) == (6, 6, 6)
    wider = {**VARY, "pattern.dihedral": "60:150:4"}  # six of its eight points are there
    of(case, vary=wider, folder=folder, progress=told.append)
    assert told[-1].found == 6 and told[-1].done == 8
    victim = sorted(folder.iterdir())[0]
    victim.write_bytes(victim.read_bytes()[:-20] + bytes(20))  # damaged: computed again
    mended = of(case, folder=folder, progress=told.append)
    np.testing.assert_array_equal(mended["frequencies"], first["frequencies"])


@pytest.mark.matrix
@pytest.mark.parametrize(
    "changed", [MODES.replace("0.25", "0.3"), MODES.replace("count = 4", "count = 3")]
)
def test_another_case_is_computed_anew(case, tmp_path, changed):
    of(case, folder=tmp_path / "points")
    case.write_text(changed)
    told = []
    of(case, folder=tmp_path / "points", progress=told.append)
    assert told[-1].found == 0
    case.write_text('title = "the same"\n' + changed)
    of(case, folder=tmp_path / "points", progress=told.append)
    assert told[-1].found == 6


@pytest.mark.matrix
def test_a_file_that_the_case_names_counts_with_its_content(case, tmp_path):
    fd.write_pattern(fd.patterns.miura(dihedral=60), tmp_path / "a.fold")
    start = MODES.index("[sheet]")
    case.write_text('[pattern]\nfile = "a.fold"\n' + MODES[start:])
    thickness, told = {"sheet.thickness": [0.01, 0.02]}, []
    first = of(case, vary=thickness, folder=tmp_path / "points")
    fd.write_pattern(fd.patterns.miura(dihedral=100), tmp_path / "a.fold")
    job._digest.cache_clear()  # of one sweep to the next, as a new process has it
    other = of(case, vary=thickness, folder=tmp_path / "points", progress=told.append)
    assert told[-1].found == 0
    assert (first["frequencies"] != other["frequencies"]).any()


def test_shapes_of_different_lengths_stand_in_one_table(case):
    found = of(case, ["frequencies"], {"analysis.count": [2, 3]})
    assert found["frequencies"].shape == (2, 3)
    np.testing.assert_array_equal(found["frequencies"][0, :2], found["frequencies"][1, :2])
    assert np.isnan(found["frequencies"][0, 2])


THICK = {"sheet.thickness": "1:2"}
REFUSED = [
    ({"shet.thickness": [1]}, {}, "did you mean 'sheet'?"),
    ({"sheet.thicknes": [1]}, {}, "did you mean 'thickness'?"),
    ({"pattern.dihedrl": [90]}, {}, "did you mean 'dihedral'?"),
    ({"sheet.thickness": [0.01, -1]}, {}, "sheet.thickness = -1"),
    ({"sheet.thickness": "0.01:-1"}, {"samples": 4}, "sheet.thickness = -1"),
    ({"analysis.count": "1:5"}, {"samples": 4}, "must be a whole number"),
    ({"loads[0].force[2]": [1]}, {}, "loads"),
    ({"title": ["a", "b"]}, {}, "title changes no result"),
    (VARY, {"measures": ["frequncies"]}, "did you mean 'frequencies'?"),
    (VARY, {"measures": ["peak_frequency[8]"]}, 'is for analysis.kind = "frf" or "dynamics"'),
    (VARY, {"measures": ["frequency"]}, "write frequency[mode]"),
    (VARY, {"measures": ["frequency[0]"]}, "give a number from 1 on"),
    (VARY, {"measures": ["frequencies", "frequencies"]}, "asked for twice"),
    (VARY, {"measures": []}, "measures: none"),
    (VARY, {"measures": [lambda result, case: 1.0]}, "without a name"),
    (VARY, {"method": "sobol"}, "method: is for samples"),
    (THICK, {"samples": 4, "method": "sobl"}, "'sobol'"),
    (VARY, {"ties": {"sheet.density": "2 * sheet.thickness"}}, "no parameter"),
    (VARY, {"ties": {"pattern.dihedral": "3"}}, "named twice"),
    (VARY, {"processes": 0}, "processes = 0"),
    ({}, {}, "names nothing"),
]


@pytest.mark.parametrize(("vary", "how", "message"), REFUSED)
def test_bad_input_is_refused_before_anything_runs(case, tmp_path, vary, how, message):
    with pytest.raises(InputError) as caught:
        fd.sweep(case, vary, **{"measures": ["frequencies"], "folder": tmp_path / "points", **how})
    assert message in str(caught.value)
    assert not (tmp_path / "points").exists()


def test_nothing_to_vary_is_said(case):
    with pytest.raises(InputError, match=r"vary: missing; .* table \[sweep\]"):
        fd.sweep(case)


def test_a_mechanism_is_told_at_its_points(case):
    case.write_text(PATH.replace("[[supports]]\nnodes = [4, 5]\n", ""))
    found = of(case, ["largest_load"], ONE)
    assert "can move freely" in str(found["failure"].values[0])


TOWER = """[pattern]
kind = "kresling"
sides = 5
radius = 1.0
height = 0.6
twist = 20
[sheet]
youngs_modulus = 1e6
poissons_ratio = 0.3
thickness = 0.01
[model]
fold_law = "linear"
[[supports]]
nodes = "zmin"
[[loads]]
nodes = "zmax"
force = [0, 0, -1]
[analysis]
kind = "statics"
method = "arc_length"
first_step = 5
steps = 80
"""


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore")
def test_what_a_path_had_before_it_stopped_is_measured(tmp_path):
    """The load at which a tower snaps is found, though its creases close later on."""
    path = tmp_path / "tower.toml"
    path.write_text(TOWER)
    names = ["limit_load", "largest_load", "stiffness", "displacement[5,z]"]
    vary = {"sheet.thickness": [0.01]}
    found = fd.sweep(path, vary, measures=names, processes=1).isel(thickness=0)
    with pytest.raises(ComputationError, match="closed") as caught:
        fd.read_case(path).run()
    partial = caught.value.partial
    assert float(found["limit_load"]) == float(partial.load_factor[partial.point == "limit"][0])
    assert float(found["largest_load"]) == float(partial.load_factor.max())
    assert float(found["stiffness"]) > 0.0
    assert np.isnan(found["displacement_5_z"])
    told = str(found["failure"].values)
    assert "what there is of the path is measured" in told
    assert "displacement[5,z]: needs a whole path" in told


PUSHED = f"""{HELD_MIURA_TEXT}[[loads]]
nodes = [8]
force = [0, 0, 1e-4]
[analysis]
kind = "dynamics"
duration = 0.2
[output]
interval = 0.02
"""


@pytest.mark.matrix
def test_motions_of_superelements_stay_on_the_cpu(case, monkeypatch):
    monkeypatch.setattr(choice, "FEWEST", 2)
    case.write_text(PUSHED + '[model]\nkind = "superelements"\n')
    found = of(case, ["largest_displacement"], {"sheet.density": [1.0, 4.0]})
    assert found.attrs["device"] == "cpu"
    assert found.attrs["device_reason"] == "modal has no GPU kernel"
    alone = fd.read_case(case).run()["displacement"]
    assert float(found["largest_displacement"][0]) == np.linalg.norm(alone, axis=-1).max()
