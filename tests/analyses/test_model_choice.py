"""Which model case files take that leave it open."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

import foldyn as fd
from case_texts import HELD_MIURA_TEXT, MODES_TEXT, PLATE, begins, changed, rows
from foldyn.analyses.model_choice import bound
from foldyn.analyses.reading import read_as
from foldyn.cli.main import main
from foldyn.gradients.run_sensitivity import case_file_at
from foldyn.sweeps.plan import plan_of

OPEN = MODES_TEXT.replace(PLATE, "")
FRF = 'drive = [{ nodes = [8], force = [0, 0, 1] }]; analysis = { kind = "frf"'
BANDS = 'supports =; analysis = { kind = "bands"'
STRIP = [[0.3 * k + 0.01 * k**2, y] for k in range(22) for y in (0, 1)]
PANELS = [[2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1] for k in range(21)]
MANY = f"pattern = {{ vertices = {STRIP}, faces = {PANELS} }}"
OTHERS = rf"""
 | superelements, the default of linear analyses
model.crease_stiffness = 0.1 | superelements, the
model.fold_law = "linear"; model.rigid = [0] | superelements, the
damping.alpha = 1.0 | superelements, the
{FRF}, frequencies = [1, 2] }} | superelements, the
{FRF}, frequencies = [1, 2], method = "modal" }} | superelements, the
{BANDS} }} | superelements, the
sweep.vary = {{ "model.crease_stiffness" = [1, 2] }} | superelements, the
model.preset = "n5b8e" | nobody asks
model.mass = "consistent" | nobody asks
model.kind = "bars_and_hinges" | nobody asks
model.kind = "superelements"; model.level = 1 | nobody asks
analysis = {{ kind = "statics", steps = 2 }} | nobody asks
analysis = {{ kind = "fidelity" }} | nobody asks
analysis.state = "equilibrium" | bars and hinges, as superelements do not take analysis.state
analysis.secant = 2 | bars and hinges, as superelements do not take analysis.secant
{FRF}, frequencies = [1], method = "harmonic" }} | bars and hinges, ... take analysis.method
{BANDS}, stretch = 1.1 }} | bars and hinges, ... take analysis.stretch
model.fold_law = "superlinear" | bars and hinges, ... refuse the case (fold_law = 'superlinear':
air.density = 1.2 | superelements, the default
output.nodes = [11] | bars and hinges, ... case (output.nodes: 11 is no vertex
drive = [{{ nodes = 9, force = [0, 0, 1] }}]; analysis = {{ kind = "frf", frequencies = [1] }} |
    bars and hinges, ... case (drive[0].nodes: 9 is no vertex
contact.planes = [{{ point = [0, 0, -9], normal = [0, 0, 1] }}] | bars and ... (contact: Contact is
pattern.cells = [10, 11] | bars and hinges, ... take long: 440 panels, more than 400
{MANY} | bars and hinges, ... take long: 21 different panels, more than 20
{FRF}, frequencies = {{ first = 1, last = 9, count = 1201 }} }} | bars ... 4 panels at 1201 freq
{BANDS}, points = 101 }} | bars and hinges, ... 4 panels at 101 wave vectors, more than 3.96
{BANDS}, zone = 20 }} | bars and hinges, ... 4 panels at 260 wave vectors
{BANDS}, points = 30, vary = {{ "pattern.dihedral" = [90, 80, 70, 60] }} }} | bars ... at 120 wave
design = {{ minimize = "mass", bounds = {{ "sheet.thickness" = [1, 2] }} }} | bars and ... anew
sweep.vary = {{ "model.preset" = ["plate"] }} | bars and hinges, ... model.preset, which [sweep]
"""


@pytest.mark.parametrize(("edits", "told"), rows(OTHERS))
def test_the_model_and_why(read, edits, told):
    found = read(changed(OPEN, edits))
    assert begins(found.choice.told or "nobody asks", told)
    taken = told.startswith("superelements") or 'kind = "superelements"' in edits
    assert found.model == ("superelements" if taken else "bars_and_hinges")
    assert found.case().structure.kind == found.model


def test_the_command_says_and_stores_which_model_it_took(tmp_path, capsys):
    text = changed(OPEN, 'pattern.kind = "simple_fold"; analysis.count = 3')
    (tmp_path / "sheet.toml").write_text(text)
    out = tmp_path / "modes"
    assert main(["modes", str(tmp_path / "sheet.toml"), "--out", str(out)]) == 0
    said = "superelements, the default of linear analyses"
    assert f"  model: {said}" in capsys.readouterr().out.splitlines()
    assert said in (out / "report.html").read_text("utf-8")
    stored = fd.load(out / "result.nc")
    assert stored.attrs["model_choice"] == said
    sheet = fd.Sheet(1e6, 0.25, 0.01, density=1.0)
    panels = fd.superelements(fd.patterns.simple_fold(), sheet)
    expected = fd.modes(fd.Case(panels, [fd.Fix("xmin")]), 3)
    for name in ("frequency", "frequency_error"):
        np.testing.assert_allclose(stored[name], expected[name], rtol=1e-9)


def test_files_of_motions_as_modes_leave_the_model_open_as_well(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(changed(HELD_MIURA_TEXT, 'analysis = { kind = "dynamics", duration = 1.0 }'))
    assert (fd.read_case(path).model, fd.read_case(path).choice.told) == ("bars_and_hinges", "")
    assert read_as(path, "modes", {}).model == "superelements"
    assert read_as(path, "modes", {"secant": 2.0}).choice.told.endswith("take analysis.secant")
    for model in ("bars_and_hinges", "shell"):
        named = read_as(path, "modes", {}, model)
        assert (named.model, named.choice.told) == (model, "")


def test_all_points_of_a_sweep_have_one_model(tmp_path):
    path = tmp_path / "case.toml"

    def models(text, key, values):
        path.write_text(text)
        job = plan_of(path, {key: values}, ["frequency[1]"], None, None, None, None).job
        return [job.case_file((value,)).model for value in values]

    small = changed(OPEN, "pattern.cells = [1, 10]")
    whole = changed(OPEN, "pattern.cells = [11, 10]")
    assert models(OPEN, "sheet.thickness", [0.01, 0.02]) == ["superelements"] * 2
    assert models(small, "pattern.cells[0]", [1, 11]) == ["superelements"] * 2
    assert models(whole, "pattern.cells[0]", [11, 1]) == ["bars_and_hinges"] * 2
    assert models(OPEN, "model.preset", ["plate", "n5b8e"]) == ["bars_and_hinges"] * 2
    kinds = ["bars_and_hinges", "superelements"]
    assert models(OPEN, "model.kind", kinds) == kinds


def test_other_values_keep_the_model_unless_they_name_one(read):
    found = read(OPEN)
    assert found.with_values({"pattern.cells": [10, 11]}).model == "superelements"
    assert found.with_values({"model.preset": "plate"}).model == "bars_and_hinges"
    assert bound("model.preset") and bound("model.bend_law.onset") and bound("model.kind")
    assert not bound("model.fold_law.theta1") and not bound("sheet.thickness")


def test_gradients_are_those_of_bars_and_hinges(tmp_path):
    found = case_file_at(tmp_path, tomllib.loads(OPEN), {"pattern.dihedral": 100})
    assert (
        found.choice.told
        == "bars and hinges, as superelements would be condensed anew for each design"
    )
