"""Effective properties of case files: results, pages, sweeps, and what they refuse."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.cli.main import main
from foldyn.errors import InputError
from foldyn.sweeps.measure import asked
from foldyn.sweeps.measures import MEASURES

SHEET = """
[pattern]
kind = "miura"
a = 0.03
b = 0.03
dihedral = 100

[sheet]
youngs_modulus = 1e9
poissons_ratio = 0.3
thickness = 1e-3

[model]
crease_stiffness = 0.1

[analysis]
kind = "effective"
"""
TOWER = SHEET.replace('kind = "miura"\na = 0.03\nb = 0.03\ndihedral = 100', 'kind = "kresling"')


def written(folder, text):
    path = folder / "cell.toml"
    path.write_text(text, "utf-8")
    return path


def test_a_case_file_gives_the_plate_of_its_cell(tmp_path):
    case_file = fd.read_case(written(tmp_path, SHEET))
    found = case_file.run()
    again = fd.effective(fd.UnitCell(case_file.case()))
    np.testing.assert_array_equal(found.membrane, again.membrane)
    fd.save(found, tmp_path / "plate.nc")
    stored = fd.load(tmp_path / "plate.nc")
    np.testing.assert_array_equal(stored.bending.sel(load="xx", strain="yy"), found.bending[0, 1])
    chain = fd.read_case(written(tmp_path, SHEET + "periods = [0]\n")).run()
    assert chain.stiffness.shape == (4, 4)


@pytest.mark.matrix
def test_the_stretched_sheet_is_the_relaxed_one(tmp_path):
    with pytest.warns(fd.errors.FoldynWarning, match="mean forces"):
        found = fd.read_case(written(tmp_path, SHEET + "stretch = 1.001\n")).run()
    cell = fd.UnitCell(fd.read_case(written(tmp_path, SHEET)).case())
    with pytest.warns(fd.errors.FoldynWarning, match="mean forces"):
        own = fd.effective(cell, fd.linear.relaxed(cell, 1.001 * cell.vectors))
    np.testing.assert_allclose(found.membrane, own.membrane, rtol=1e-6)


@pytest.mark.parametrize("text", [SHEET, pytest.param(TOWER, marks=pytest.mark.matrix)])
def test_pages_list_the_matrices(tmp_path, monkeypatch, text, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["effective", str(written(tmp_path, text)), "--figures", "png"]) == 0
    page = (tmp_path / "cell-effective" / "report.html").read_text("utf-8")
    plate = text is SHEET
    assert ("membrane (N/m)" in page) == ("Poisson" in page and plate)
    assert ("stretch twist" in page) == (not plate)
    assert (tmp_path / "cell-effective" / "effective.png").exists() == plate
    assert ("poissons ratio" if plate else "axial stiffness") in capsys.readouterr().out


def test_the_command_leaves_out_what_holds_a_cell(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    text = SHEET.replace('"effective"', '"modes"') + '[[supports]]\nnodes = [0]\naxes = "xyz"\n'
    assert main(["effective", str(written(tmp_path, text)), "--no-figures"]) == 0
    assert "leaves out [[supports]]" in capsys.readouterr().err


def test_sweeps_measure_properties(tmp_path):
    measures = ["poissons_ratio[x]", "bending_modulus[y]", "membrane[xx]", "bending[xx,yy]"]
    path = written(tmp_path, SHEET)
    swept = fd.sweep(path, {"pattern.dihedral": [100.0]}, measures=measures)
    found = fd.read_case(path).run()
    assert float(swept.poissons_ratio_x[0]) == float(found.poissons_ratio[0])
    assert float(swept.bending_modulus_y[0]) == float(found.bending_modulus[1])
    assert float(swept.membrane_xx[0]) == float(found.membrane[0, 0])
    assert float(swept.bending_xx_yy[0]) == float(found.bending[0, 1])
    path = written(tmp_path, TOWER)
    one = {"sheet.thickness": [1e-3]}
    swept = fd.sweep(path, one, measures=["coupling[stretch,twist]"])
    found = fd.read_case(path).run()
    assert float(swept.coupling_stretch_twist[0]) == float(found.stretch_twist)
    for measure, reason in (
        ("poissons_ratio[x]", "it has coupling, mean_load"),
        ("coupling[xx]", "choose one of stretch, twist"),
    ):  # fmt: skip
        with pytest.raises(InputError, match=reason):
            asked(measure, MEASURES).of(found, fd.case_of(found), {})


def test_polar_diagrams_show_both_moduli(tmp_path):
    found = fd.read_case(written(tmp_path, SHEET)).run()
    stretching, bending = fd.plots.plot_effective(found).axes
    assert stretching.lines[0].get_ydata()[0] == float(found.modulus[0])
    assert bending.lines[0].get_ydata()[90] == pytest.approx(float(found.bending_modulus[1]))
    with pytest.raises(InputError, match=r"give what foldyn\.effective returns"):
        fd.plots.plot_effective(found[["membrane"]])


def test_supports_in_the_file_are_refused(tmp_path):
    text = SHEET + '[[supports]]\nnodes = [0]\naxes = "z"\n'
    with pytest.raises(InputError, match="has supports or clamped edges"):
        fd.read_case(written(tmp_path, text)).run()


VARY = 'vary = { "pattern.dihedral" = [80, 100] }\n'


def test_several_states_are_those_of_their_cells(tmp_path):
    found = fd.read_case(written(tmp_path, SHEET + VARY)).run()
    assert found.sizes["state"] == 2
    assert found["state"].attrs == {
        "key": "pattern.dihedral", "long_name": "dihedral", "units": "degrees",
    }  # fmt: skip
    alone = fd.read_case(written(tmp_path, SHEET)).run()
    for name in ("membrane", "poissons_ratio", "shear_modulus", "modulus_along"):
        np.testing.assert_array_equal(found[name][1], alone[name])
        assert found[name].dims == ("state", *alone[name].dims)
    fd.save(found, tmp_path / "states.nc")
    stored = fd.load(tmp_path / "states.nc")
    np.testing.assert_array_equal(stored.bending, found.bending)
    with pytest.raises(InputError, match="needs a single state"):
        asked("modulus[x]", MEASURES).of(found, fd.case_of(found), {})


@pytest.mark.matrix
def test_a_page_of_several_states(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["effective", str(written(tmp_path, SHEET + VARY)), "--figures", "png"]) == 0
    assert "2 states" in capsys.readouterr().out
    page = (tmp_path / "cell-effective" / "report.html").read_text("utf-8")
    assert "Properties in each state" in page
    assert (tmp_path / "cell-effective" / "effective.png").exists()


@pytest.mark.matrix
def test_the_mean_force_grows_with_the_stiffness_of_its_states(tmp_path):
    few = SHEET.replace("[model]\n", '[model]\nkind = "bars_and_hinges"\nfold_law = "linear"\n')
    few += 'stretch = [1.0, 1.0]\nvary = { "analysis.stretch[0]" = "0.9999:1.0001:3" }\n'
    with pytest.warns(fd.errors.FoldynWarning, match="mean forces"):
        found = fd.read_case(written(tmp_path, few)).run()
    slope = np.diff(found.mean_force.sel(load=["xx", "yy"]).values[::2], axis=0)[0] / 2e-4
    stiffness = found.membrane.sel(load=["xx", "yy"], strain="xx").values[1]
    np.testing.assert_allclose(slope, stiffness, rtol=1e-3)


@pytest.mark.matrix
def test_states_that_are_unstable_are_hollow(tmp_path):
    text = SHEET.replace("dihedral = 100", "dihedral = 180") + "stretch = [1.0, 1.0]\n"
    text += 'vary = { "analysis.stretch[0]" = [0.999, 1.0] }\n'
    with pytest.warns(fd.errors.FoldynWarning, match="mean forces|unstable"):
        found = fd.read_case(written(tmp_path, text)).run()
    assert found.stable.values.tolist() == [False, True]
    _, hollow = fd.plots.plot_effective(found).axes[0].lines[:2]
    assert hollow.get_xdata().tolist() == [0.999]
    assert hollow.get_markerfacecolor() == "white"


@pytest.mark.matrix
@pytest.mark.usefixtures("compared")
def test_models_are_compared_unless_the_file_says_no(tmp_path):
    found = fd.read_case(written(tmp_path, SHEET)).run()
    assert 0.0 < np.abs(found.model_error).max() < 0.05
    page = fd.read_case(
        written(tmp_path, SHEET + 'vary = { "pattern.dihedral" = [80, 100] }\n')
    ).run()
    assert page.model_error.sizes == {"state": 2, "row": 6, "column": 6}
    none = fd.read_case(written(tmp_path, SHEET + "check_model = false\n")).run()
    assert "model_error" not in none
    with pytest.raises(InputError, match="check_model = 1: must be True or False"):
        fd.read_case(written(tmp_path, SHEET + "check_model = 1\n")).run()
