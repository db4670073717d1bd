"""Case files of kind "buckling": the page, the line, the figure, and the measure of sweeps."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.cli.main import main
from foldyn.errors import InputError
from foldyn.plots import draw_buckling

CASE = """
[pattern]
kind = "miura"
cells = [2, 1]
dihedral = 180
[sheet]
youngs_modulus = 1e6
poissons_ratio = 0.25
thickness = 0.01
density = 1.0
[model]
preset = "plate"
[[supports]]
nodes = "xmin"
[[supports]]
nodes = "xmax"
axes = "z"
[[loads]]
gravity = [-0.01, 0, 0]
[[loads]]
nodes = "xmax"
force = [-0.01, 0, 0]
[analysis]
kind = "buckling"
count = 2
constant = "gravity"
"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(CASE, "utf-8")
    return path


def test_a_case_file_is_the_function(file):
    read = fd.read_case(file)
    found, case = read.run(), read.case()
    expected = fd.buckling(case.altered(loads=case.loads[1:]), 2, preload=case.loads[0])
    np.testing.assert_array_equal(found.load_factor, expected.load_factor)
    alone = read.run(constant=())
    assert alone.load_factor[0] != found.load_factor[0]
    assert "constant" not in alone.attrs
    with pytest.raises(InputError, match="no load 7"):
        read.run(constant=[7])


def test_a_page(file, tmp_path, capsys):
    assert main(["run", str(file), "--out", str(tmp_path / "out"), "--figures", "png"]) == 0
    found = fd.read_case(file).run()
    first = f"{float(found.load_factor[0]):.4g}"
    assert f"load factors: {first}" in capsys.readouterr().out
    page = next((tmp_path / "out").rglob("report.html")).read_text("utf-8")
    assert first in page and "Buckling shapes" in page


def test_superelements(file, tmp_path):
    text = CASE.replace('preset = "plate"', 'kind = "superelements"\ndivisions = 4')
    file.write_text(text.replace('\nconstant = "gravity"', ""), "utf-8")
    read = fd.read_case(file)
    found = read.run()
    np.testing.assert_array_equal(found.load_factor, fd.buckling(read.case(), 2).load_factor)
    page = read.analysis.page(read, {read.masses[0]: found}, tmp_path, figures="png")
    assert "Buckling shapes" in page.read_text("utf-8")


def test_a_drawing(file):
    found = fd.read_case(file).run()
    figure = draw_buckling(found, which=[2, 1], title="Shapes")
    texts = [each.get_text() for axes in figure.axes for each in axes.texts]
    texts += [axes.get_title() + axes.get_xlabel() for axes in figure.axes]
    texts += [each.get_text() for each in figure.texts]
    assert any(f"mode 2: load factor {float(found.load_factor[1]):.4g}" in one for one in texts)
    for given, message in (
        ([9], "which: 9; there are modes"),
        ([], "which: empty; give the number"),
    ):
        with pytest.raises(InputError, match=message):
            draw_buckling(found, which=given)
    with pytest.raises(InputError, match=r"amplitude = 0\.0"):
        draw_buckling(found, amplitude=0.0)
    with pytest.raises(InputError, match="has no load_factor"):
        draw_buckling(found.drop_vars("load_factor"))
    with pytest.raises(InputError, match="no shape to draw"):
        draw_buckling(found.isel(mode=slice(0)))


def test_a_sweep_measures_the_lowest_factor(file):
    found = fd.sweep(
        file, {"sheet.thickness": [0.01, 0.02]}, measures=["buckling_load"], processes=1
    )
    one = fd.read_case(file).with_values({"sheet.thickness": 0.02}).run()
    assert float(found["buckling_load"][1]) == float(one.load_factor[0])
    assert found["buckling_load"][1] > found["buckling_load"][0]


def test_times_are_refused(file):
    text = CASE.replace(
        "force = [-0.01, 0, 0]", 'force = [-0.01, 0, 0]\nhistory = { kind = "ramp", duration = 1 }'
    )
    file.write_text(text, "utf-8")
    with pytest.raises(InputError, match="load factors have no time"):
        fd.read_case(file)


def test_a_load_that_buckles_the_sheet_by_itself(file):
    file.write_text(CASE.replace("-0.01, 0, 0]\n[[loads]]", "-9.81, 0, 0]\n[[loads]]"), "utf-8")
    with pytest.raises(InputError, match=r"analysis\.constant: the tangent has .* buckled already"):
        fd.read_case(file).run()
