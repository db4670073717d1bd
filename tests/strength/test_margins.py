"""Margins of safety: arithmetic, where they are least, figures, measures, bad input."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.cli.main import main
from foldyn.errors import InputError

PATTERN = fd.patterns.miura(cells=(1, 1), a=0.1, b=0.1, panel_angle=60, dihedral=110)
SHEET = fd.Sheet(3e9, 0.3, 1e-3, 1000.0, strength=1e6)
PATH = fd.trace(
    fd.Case(fd.superelements(PATTERN, SHEET), [fd.Fix("xmin")], [fd.Force([8], (0.0, 0.0, -1e-3))]),
    steps=2,
)
STRESSES = fd.stresses(PATH)


def test_margins_follow_from_the_largest_stress():
    found = fd.margins(STRESSES, crease_strength=0.01, factor_of_safety=1.5)
    stress = STRESSES.von_mises.values
    panel = STRESSES.point_panel.values
    for p in range(len(PATTERN.faces)):
        most = stress[:, panel == p].max()
        assert found.panel_margin.values[p] == pytest.approx(1e6 / (1.5 * most) - 1.0)
        point = int(found.panel_point.values[p])
        assert panel[point] == p
        assert stress[-1, point].max() == pytest.approx(most)
        assert found.panel_state.values[p] == 1.0
    moment = np.abs(STRESSES.crease_moment.values).max(axis=0)
    np.testing.assert_allclose(found.crease_margin, 0.01 / (1.5 * moment) - 1.0)
    least = min(found.panel_margin.values.min(), found.crease_margin.values.min())
    assert found.attrs["least_margin"] == pytest.approx(least)
    assert "load factor 1" in found.attrs["least_where"]


@pytest.mark.matrix
def test_strengths_of_some_panels_and_creases():
    weak = fd.Sheet(3e9, 0.3, 1e-3, 1000.0, panels=[fd.PanelSheet([1], strength=1e4)], strength=1e6)
    structure = fd.superelements(PATTERN, weak)
    case = fd.Case(structure, [fd.Fix("xmin")], [fd.Force([8], (0.0, 0.0, -1e-3))])
    path = fd.trace(case, steps=1)
    assert fd.results.case_of(path).structure.sheet.panels[0].strength == 1e4
    found = fd.margins(path, crease_strength={"valley": 1.0})
    other = fd.margins(path, strength=1e6)
    np.testing.assert_allclose(found.panel_margin[[0, 2, 3]], other.panel_margin[[0, 2, 3]])
    assert found.panel_margin[1] + 1.0 == pytest.approx(0.01 * (other.panel_margin[1] + 1.0))
    valley = np.array(list(PATTERN.assignments)) == "V"
    assert np.isfinite(found.crease_margin.values[valley]).all()
    assert np.isnan(found.crease_margin.values[~valley]).all()
    assert "crease_margin" not in other


@pytest.mark.matrix
def test_random_responses_count_three_times_their_root_mean_square():
    case = fd.results.case_of(PATH)
    case = case.altered(loads=[], damping=fd.Rayleigh(alpha=20.0))
    noise = fd.SpectralDensity([5, 60], [0.01, 0.01], "g2/Hz")
    with pytest.warns(fd.errors.ModelRangeWarning):
        random = fd.random_response(case, base={"z": noise}, stresses=True)
    found = fd.margins(random)
    most = float(random.von_mises_rms.max())
    assert found.attrs["least_margin"] == pytest.approx(1e6 / (3.0 * most) - 1.0)
    assert fd.plots.draw_stresses(random)


def test_figures_color_panels_and_creases():
    margins = fd.margins(STRESSES, crease_strength=0.01)
    assert fd.plots.draw_stresses(STRESSES, title="stresses")
    assert fd.plots.draw_stresses(STRESSES, "crease_moment", state=1)
    assert fd.plots.draw_stresses(margins)
    assert fd.plots.draw_stresses(margins, "crease_margin")
    with pytest.raises(InputError, match="there are states 0 to 2"):
        fd.plots.draw_stresses(STRESSES, state=3)
    with pytest.raises(InputError, match=r"has no stresses; give a result of fd\.stresses"):
        fd.plots.draw_stresses(PATH)


def test_results_are_kept(tmp_path):
    fd.save(STRESSES, tmp_path / "stresses.nc")
    again = fd.load(tmp_path / "stresses.nc")
    np.testing.assert_array_equal(again.von_mises, STRESSES.von_mises)
    np.testing.assert_array_equal(again.point_position, STRESSES.point_position)
    assert fd.margins(again).identical(fd.margins(STRESSES))


@pytest.mark.matrix
def test_what_is_refused():
    modes = fd.modes(fd.results.case_of(PATH).altered(loads=[]), 2)
    with pytest.raises(InputError, match="stresses of modes are per unit"):
        fd.margins(modes)
    with pytest.raises(InputError, match=r"strength = -1\.0: must be greater than 0 Pa"):
        fd.margins(STRESSES, strength=-1.0)
    with pytest.raises(InputError, match="one for each of the 4 creases"):
        fd.margins(STRESSES, crease_strength=[1.0, 2.0])
    with pytest.raises(InputError, match=r"crease_strength\.vally"):
        fd.margins(STRESSES, crease_strength={"vally": 1.0})
    weightless = fd.Case(
        fd.discretize(PATTERN, fd.Sheet(3e9, 0.3, 1e-3, 1000.0)), [fd.Fix("xmin")],
        [fd.Force([8], (0.0, 0.0, -1e-3))],
    )  # fmt: skip
    with pytest.raises(InputError, match=r"the sheet has none; give Sheet\(strength"):
        fd.margins(fd.trace(weightless, steps=1))
    random = fd.random_response(
        fd.results.case_of(PATH).altered(loads=[], damping=fd.Rayleigh(alpha=20.0)),
        forces=[(fd.Force([8], (0.0, 0.0, 1.0)), fd.SpectralDensity([5, 60], [1, 1], "N2/Hz"))],
    )
    with pytest.raises(InputError, match="compute it with stresses = True"):
        fd.margins(random)


@pytest.mark.matrix
def test_hinged_panels_have_margins_of_creases_only():
    case = fd.Case(
        fd.discretize(PATTERN, SHEET, preset="merlin2"), [fd.Fix("xmin")],
        [fd.Force([8], (0.0, 0.0, -1e-5))],
    )  # fmt: skip
    path = fd.trace(case, steps=1)
    with pytest.raises(InputError, match="panels of this model have no stresses"):
        fd.margins(path)
    with pytest.raises(InputError, match="crease_strength: names no crease"):
        fd.margins(path, crease_strength={})
    found = fd.margins(path, crease_strength=0.01)
    assert "panel_margin" not in found
    assert found.attrs["least_where"].startswith("crease")


CASE = """
[pattern]
kind = "simple_fold"
a = 0.1
b = 0.1
dihedral = 100

[sheet]
youngs_modulus = 3e9
poissons_ratio = 0.3
thickness = 1e-3
density = 1000.0
strength = 1e6

[model]
kind = "superelements"
divisions = 8

[[supports]]
nodes = [4, 5]
axes = "xyz"

[[supports]]
nodes = [0, 1]
axes = "z"

[[loads]]
nodes = [0, 1]
force = [1e-4, 0.0, 0.0]

[analysis]
kind = "statics"
steps = 1

[output]
stresses = true

[sweep]
measures = ["von_mises", "crease_moment", "margin"]
[sweep.vary]
"sheet.thickness" = "1e-3:2e-3:2"
"""


@pytest.mark.matrix
def test_case_files_show_stresses_and_sweeps_measure_them(tmp_path):
    path = tmp_path / "fold.toml"
    path.write_text(CASE)
    assert main(["run", str(path), "--out", str(tmp_path / "out"), "--quiet"]) == 0
    page = (tmp_path / "out" / "report.html").read_text()
    assert "Does it hold?" in page
    assert "least margin of a panel" in page
    quiet = ["--out", str(tmp_path / "sweep"), "--quiet", "--processes", "1"]
    assert main(["sweep", str(path), *quiet]) == 0
    swept = fd.load(tmp_path / "sweep" / "sweep.nc")
    stress, margin = swept["von_mises"].values, swept["margin"].values
    assert stress[0] > stress[1] > 0.0
    np.testing.assert_allclose(margin, 1e6 / stress - 1.0)
    np.testing.assert_allclose(swept["crease_moment"][0], swept["crease_moment"][1], rtol=0.05)
