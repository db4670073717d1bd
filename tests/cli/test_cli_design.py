"""`foldyn design`: what it writes, says and refuses."""

from __future__ import annotations

import tomllib

import pytest
import xarray as xr

import foldyn as fd
from case_texts import MODES_TEXT
from foldyn.cli.main import main

ASKED = """[design]
minimize = "mass"
subject_to = ["frequency[1] >= 1.0"]
[design.bounds]
"sheet.thickness" = [0.005, 0.02]
"""
CREASES = """[design]
maximize = "frequency[1]"
max_evaluations = 4
[design.bounds]
"model.crease_stiffness" = [0.5, 2.0]
[design.guess]
"model.crease_stiffness" = [1.0, 1.0, 1.0, 1.0]
"""


@pytest.mark.matrix
def test_results_page_and_evaluations_stand_in_one_folder(workplace, monkeypatch):
    workplace.write(MODES_TEXT + ASKED)
    done = workplace.call("design", "case.toml", "--figures", "png")
    assert done.status == 0, done.err
    names = [name.removeprefix("case-design/") for name in done.new]
    assert [name for name in names if "evaluations" not in name] == [
        "case-design", "after.png", "before.png", "convergence.png", "design.nc", "designed.toml",
        "history.csv", "report.html",
    ]  # fmt: skip
    folder = workplace.folder / "case-design"
    history = xr.load_dataset(folder / "design.nc")
    count = history.sizes["evaluation"]
    assert sum(name.endswith(".npz") for name in names) == count
    assert bool(history["feasible"][int(history["best"])])
    designed = fd.read_case(folder / "designed.toml")
    assert float(designed.run()["frequency"][0]) == pytest.approx(1.0, rel=2e-4)
    page = (folder / "report.html").read_text("utf-8")
    for text in ("frequency[1] &gt;= 1.0", "sheet.thickness", "What matters", "foldyn design"):
        assert text in page
    assert "case: minimize mass by 1 number (slsqp)" in done.out
    assert "frequency[1] >= 1.0: holds" in done.out
    kept = {path: path.stat().st_mtime_ns for path in (folder / "evaluations").iterdir()}
    monkeypatch.chdir(workplace.folder)
    assert main(["design", "case.toml", "--no-figures", "--quiet"]) == 0
    assert {path: path.stat().st_mtime_ns for path in (folder / "evaluations").iterdir()} == kept
    later = xr.load_dataset(folder / "design.nc")
    assert later.drop_vars("seconds").equals(history.drop_vars("seconds"))


@pytest.mark.matrix
def test_creases_are_colored_by_what_they_matter(workplace):
    workplace.write(MODES_TEXT + CREASES)
    done = workplace.call("design", "case.toml", "--figures", "svg")
    assert done.status == 0, done.err
    assert any("sensitivity-model.crease_stiffness.svg" in name for name in done.new)
    page = (workplace.folder / "case-design" / "report.html").read_text("utf-8")
    assert "by model.crease_stiffness of each crease" in page


@pytest.mark.matrix
def test_no_feasible_design_is_said(workplace):
    asked = ASKED.replace(">= 1.0", ">= 300.0")
    workplace.write(MODES_TEXT + asked.replace("[design]", "[design]\nmax_evaluations = 6", 1))
    done = workplace.call("design", "case.toml")
    assert done.status == 0
    assert "designs is feasible; the nearest one violates frequency[1] >= 300.0 by" in done.err
    assert "not feasible" in done.out
    page = (workplace.folder / "case-design" / "report.html").read_text("utf-8")
    assert "no design that was tried keeps them" in page


def test_the_table_is_aside_for_other_commands(workplace):
    workplace.write(MODES_TEXT + ASKED)
    assert workplace.call("run", "case.toml", "--no-figures").status == 0
    asked = fd.read_case(workplace.folder / "case.toml").design
    assert asked.bounds == {"sheet.thickness": [0.005, 0.02]}
    assert tomllib.loads(MODES_TEXT + ASKED)["design"]["minimize"] == asked.minimize


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "case.toml: design: missing; say what may change"),
        ('[design]\nminimize = "mass"\n', "design.bounds"),
        (ASKED.replace("minimize", "minimise"), "design.minimise: unknown key"),
        (ASKED.replace("[0.005, 0.02]", "[0.02, 0.005]"), "bounds.sheet.thickness: from 0.02"),
        (ASKED.replace('"mass"', '"max(mass"'), 'design.minimize = "max(mass": cannot be read'),
        (ASKED.replace(">= 1.0", "> 1.0"), "design.subject_to[0] = "),
        (ASKED.replace("sheet.thickness", "sheet.thicknes"), ".toml: sheet.thicknes: unknown key"),
        (ASKED.replace("frequency[1]", "reaction[x]"), "design.subject_to[0]: reaction[x] needs"),
        (ASKED + '[design.guess]\n"sheet.thickness" = 7\n', "must be within its bounds"),
    ],
)  # fmt: skip
def test_bad_tables_are_refused_before_anything_is_written(workplace, text, why):
    workplace.write(MODES_TEXT + text)
    done = workplace.call("design", "case.toml")
    assert (done.status, done.new) == (2, [])
    assert why in done.err
