"""`foldyn run` on good case files: what it writes, says and returns."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import foldyn as fd
from case_texts import changed
from foldyn.cli.main import main
from foldyn.dynamics import prepare
from foldyn.studies import find_case, shipped_cases

PAPER_RULES = ["equi_inertial", "panel", "centroid", "circumcenter", "consistent"]


def test_a_case_file_becomes_a_result_that_runs_again_from_itself(workplace, miura) -> None:
    workplace.write(miura)
    done = workplace.good("run", "case.toml", "--no-figures")
    assert done.new == ["case-results", "case-results/result.nc"]
    assert "a Miura unit cell: 13 nodes" in done.out
    assert f"wrote {Path('case-results/result.nc')}" in done.out
    result = fd.load("case-results/result.nc")
    np.testing.assert_allclose(result.time, np.arange(11) * 0.01, rtol=1e-12)
    assert float(np.abs(result.displacement.sel(node=7, axis="x")).max()) > 1e-3
    assert result.attrs["energy_error"] < 1e-5
    assert "stopped_because" not in result.attrs
    a = result.attrs
    again = fd.simulate(
        fd.case_of(result), a["duration"], method="rk4", dt=a["dt"], every_steps=a["every_steps"]
    )
    for name in ("time", "displacement", "velocity", "reaction", "work"):
        np.testing.assert_array_equal(again[name], result[name])


@pytest.mark.matrix
def test_a_list_of_mass_rules_gives_a_file_each(workplace, edited) -> None:
    rules = ["panel", "circumcenter", "consistent"]
    done = workplace.run(edited(f"model.mass = {rules}"))
    assert done.status == 0
    assert done.new == ["case-results", *sorted(f"case-results/result-{r}.nc" for r in rules)]
    motions = {rule: fd.load(f"case-results/result-{rule}.nc") for rule in rules}
    for rule, motion in motions.items():
        assert fd.case_of(motion).structure.options.mass == rule
        assert f"  {rule}: " in done.out
    one, other = motions["panel"].displacement, motions["consistent"].displacement
    assert float(np.abs(one - other).max()) > 1e-4


def test_out_names_the_folder(workplace, miura) -> None:
    assert workplace.run(miura, "--out", "a/b").new == ["a", "a/b", "a/b/result.nc"]


@pytest.mark.matrix
def test_a_second_run_replaces_the_first(workplace, miura, edited) -> None:
    workplace.run(miura)
    (workplace.folder / "case-results" / "notes.txt").write_text("mine")
    workplace.write(edited("analysis.duration = 0.2"))
    assert main(["run", "case.toml", "--no-figures"]) == 0
    assert fd.load("case-results/result.nc").sizes["time"] == 21
    assert (workplace.folder / "case-results" / "notes.txt").read_text() == "mine"


def test_quiet_says_nothing(workplace, miura) -> None:
    done = workplace.run(miura, "--quiet")
    assert (done.status, done.out, done.err) == (0, "", "")
    assert "case-results/result.nc" in done.new


@pytest.mark.matrix
def test_names_beyond_ascii(workplace, miura) -> None:
    workplace.write(miura, "Fälle/Miura – 折り紙.toml")
    out = str(Path("Ergebnisse µ") / "ü")
    done = workplace.call("run", "Fälle/Miura – 折り紙.toml", "--no-figures", "--out", out)
    assert done.status == 0
    assert fd.load(Path(out) / "result.nc").sizes["time"] == 11
    folder = "Miura – 折り紙-results"
    done = workplace.call("run", "Fälle/Miura – 折り紙.toml", "--no-figures")
    assert done.new == [folder, f"{folder}/result.nc"]


@pytest.mark.matrix
def test_free_flight_is_legal(workplace, miura) -> None:
    workplace.write(changed(miura, "supports ="))
    workplace.good("run", "case.toml", "--no-figures")
    result = fd.load("case-results/result.nc")
    assert result.sizes["support"] == 0
    # the impulse of the half sine, 2/pi force times duration, carries the mass (4 panels) away
    mass = 1.0 * 0.01 * 4 * np.sin(np.radians(60))
    u = result.displacement.to_numpy()[-1]
    drift = (fd.case_of(result).structure.mass @ u).sum(axis=0) / mass
    speed = 0.01 * 0.05 * 2 / np.pi / mass
    # centroid of the half sine at 0.025 s; damping (alpha = 0.0628/s) takes under 1 %
    np.testing.assert_allclose(drift, [speed * (0.1 - 0.025), 0, 0], atol=0.01 * speed * 0.1)


def test_a_load_on_supports_in_part_warns_and_runs(workplace, edited) -> None:
    done = workplace.run(edited("loads[0].nodes = [0, 7]"))
    assert done.status == 0
    (line,) = done.err.splitlines()
    assert line.startswith("foldyn: warning: case.toml: loads[0]: the force [0.01, 0.0, 0.0] acts")


@pytest.mark.matrix
def test_the_shipped_cases_are_what_they_say(workplace) -> None:
    studied = [f"herkal/case{k}" for k in (1, 2, 3, 4)]
    motions = {"gallery/deployment", "gallery/tumbling", "herkal/specimen-release", *studied}
    kinds = {name: fd.read_case(path).analysis.kind for name, path in shipped_cases().items()}
    assert {name for name, kind in kinds.items() if kind == "dynamics"} == motions
    assert set(kinds.values()) == {"dynamics", "statics", "modes", "frf"}
    ratios, forces = [], []
    for name in studied:
        path = shipped_cases()[name]
        found = fd.read_case(path)
        assert set(PAPER_RULES) <= set(found.masses)
        sheet = found.sheet
        assert (sheet.youngs_modulus, sheet.poissons_ratio, sheet.thickness) == (1e6, 0.25, 0.01)
        ratios.append(sheet.length_scale_ratio)
        forces.append([(load.nodes, load.vector) for load in found.case().loads])
        for rule in found.masses:
            prepare(found.case(rule), **found.analysis.arguments)
    # design, section 7 (the paper's table of cases) and section 5 (directions: our assumptions)
    assert ratios == [1.0, 1.0, 1.0, 5.0]
    assert forces[1] == forces[3] == [((7,), (0.01, 0.0, 0.0))]
    assert forces[2] == [((5,), (0.0, 0.01, 0.0))]
    assert forces[0] == [((0, 1), (-1e-3, 0.0, 0.0))]


@pytest.mark.matrix
@pytest.mark.parametrize(
    "name", ["herkal/case1", pytest.param("herkal/case3.toml", marks=pytest.mark.matrix)]
)
def test_a_shipped_case_runs_by_its_name(workplace, name) -> None:
    text = find_case(name).read_text(encoding="utf-8")
    assert text.count("duration = 10.0") == 1
    workplace.write(text.replace("duration = 10.0", "duration = 0.1"), "short.toml")
    assert workplace.call("run", "short.toml", "--no-figures").status == 0
    # by name: it is found and read, then the folder stops it before it is computed at full length
    (workplace.folder / "taken").write_text("")
    named = workplace.call("run", name, "--out", "taken")
    assert (named.status, named.err) == (2, "foldyn: --out taken: is a file; name a folder\n")


def test_modes_that_cannot_be_compared_are_no_failure(workplace) -> None:
    """Some models of the paper's fold have modes that superelements lack."""
    run = workplace.call("modes", "herkal/case1", "--no-figures")
    assert run.status == 0, run.err


@pytest.mark.matrix
def test_a_motion_goes_on_from_a_stored_one(workplace, miura) -> None:
    free = changed(miura, "supports =; loads =; analysis.dt = 2.5e-4")
    workplace.write(changed(free, "initial.spin = [3, -2, 5]"), "first.toml")
    workplace.good("run", "first.toml", "--no-figures")
    stored = 'initial = { file = "first-results/result.nc", at = 4 }'
    workplace.write(changed(free, stored))
    workplace.good("run", "case.toml", "--no-figures")
    one, other = fd.load("first-results/result.nc"), fd.load("case-results/result.nc")
    for name in ("displacement", "velocity"):
        np.testing.assert_array_equal(other[name][0], one[name][4])
        largest = float(np.abs(one[name]).max())
        np.testing.assert_allclose(other[name][6], one[name][10], rtol=0, atol=1e-12 * largest)
    workplace.write(changed(free, f"{stored}; initial.at = 11"))
    line = workplace.refused("run", "case.toml")
    assert line.startswith("case.toml: initial.at = 11: the result has samples 0 to 10")
