"""`foldyn sweep`: what it writes, says and refuses."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

import foldyn as fd
from case_texts import MODES_TEXT

THICK = "--vary sheet.thickness=0.01,0.02"


@pytest.fixture
def sweep(workplace):
    def call(arguments: str, text: str = MODES_TEXT):
        workplace.write(text)
        return workplace.call("sweep", "case.toml", *arguments.split())

    return call


@pytest.mark.matrix
def test_results_page_and_points_stand_in_one_folder(sweep, workplace):
    vary = f"{THICK} --vary pattern.dihedral=60:120:3 --measure frequencies"
    done = sweep(f"{vary} --processes 1 --figures png")
    assert done.status == 0, done.err
    names = [name.removeprefix("case-sweep/") for name in done.new]
    drawn = [f"{name}-frequencies.png" for name in ("effects", "lines", "map")]
    assert [n for n in names if "points" not in n] == [
        "case-sweep", *sorted([*drawn, "report.html", "sweep.nc"])
    ]  # fmt: skip
    assert sum(name.endswith(".npz") for name in names) == 6
    found = fd.load(workplace.folder / "case-sweep" / "sweep.nc")
    known = fd.sweep(
        workplace.folder / "case.toml",
        {"sheet.thickness": [0.01, 0.02], "pattern.dihedral": [60, 90, 120]},
        measures=["frequencies"], processes=1,
    )  # fmt: skip
    np.testing.assert_array_equal(found["frequencies"], known["frequencies"])
    page = (workplace.folder / "case-sweep" / "report.html").read_text("utf-8")
    assert "pattern.dihedral" in page and "foldyn sweep case.toml" in page
    assert "modes at 2 x 3 = 6 points" in done.out


@pytest.mark.matrix
def test_a_design_for_indices_has_them_on_its_page(sweep, workplace):
    vary = "--vary sheet.thickness=0.01:0.02 --vary sheet.density=1:2 --samples 8"
    done = sweep(f"{vary} --method saltelli --measure frequency[1] --processes 1")
    assert done.status == 0, done.err
    page = (workplace.folder / "case-sweep" / "report.html").read_text("utf-8")
    assert "with interactions" in page
    found = fd.load(workplace.folder / "case-sweep" / "sweep.nc")
    assert found.sizes["point"] == 32


def test_failed_points_are_told(sweep, workplace):
    done = sweep("--vary pattern.dihedral=90,500 --measure frequencies --processes 1")
    assert done.status == 0
    said = "values are missing at 1 of 2 points:\n  1 of them: pattern.dihedral = 500"
    assert said in done.out
    page = (workplace.folder / "case-sweep" / "report.html").read_text("utf-8")
    assert "Values are missing at 1 of 2 points" in page


def test_a_sweep_of_which_all_points_fail_fails(sweep):
    done = sweep("--vary pattern.dihedral=400,500 --measure frequencies --processes 1")
    assert done.status == 1
    assert "all 2 points failed, the first with: pattern.dihedral = 400" in done.err
    assert "sweep.nc" in done.err


@pytest.mark.matrix
def test_the_table_and_the_command_line(sweep, workplace):
    table = '[sweep]\nmeasures = ["frequencies"]\n[sweep.vary]\n"sheet.thickness" = [0.01]\n'
    assert sweep("--processes 1 --no-figures", text=MODES_TEXT + table).status == 0
    found = fd.load(workplace.folder / "case-sweep" / "sweep.nc")
    assert found["thickness"].values.tolist() == [0.01]
    done = workplace.call("run", "case.toml", "--no-figures")  # as if it were not there
    assert done.status == 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("", "vary: missing"),
        ("--vary sheet.thickness", "write KEY=..."),
        (f"{THICK} {THICK} --measure frequencies", "sheet.thickness is named twice"),
        (THICK, "measures: none"),
        (f"{THICK} --measure frequency", "write frequency[mode]"),
        (f"{THICK} --measure mine.py:tip", "cannot be imported"),
        ("--vary sheet.thicknes=1 --measure frequencies", "did you mean 'thickness'?"),
        (f"{THICK} --measure frequencies --processes 0", "processes = 0"),
        (f"{THICK} --measure frequencies --tie a", '--tie "a": write KEY=...'),
        (f"{THICK} --measure limit_load", 'is for analysis.kind = "statics"'),
    ],
)
def test_bad_input_leaves_nothing(sweep, arguments, message):
    done = sweep(arguments)
    assert (done.status, done.new) == (2, [])
    assert message in done.err


def test_own_code_is_never_named_by_a_case_file(sweep, workplace):
    table = '[sweep]\nmeasures = ["mine.py:tip"]\n[sweep.vary]\n"sheet.thickness" = [0.01]\n'
    workplace.write("raise SystemExit(9)\n", "mine.py")
    done = sweep("", text=MODES_TEXT + table)
    assert done.status == 2
    assert "measures[0]" in done.err


def test_the_command_starts_without_the_solvers():
    code = "import sys, foldyn.cli.main as m; m.parser(); print([n in sys.modules for n in LIST])"
    code = code.replace("LIST", "('numba', 'xarray', 'distributed')")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[False, False, False]"
