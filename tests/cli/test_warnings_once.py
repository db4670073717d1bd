"""Warnings: once in a run, with where they apply; on the page where the model is on purpose."""

from __future__ import annotations

import warnings

import pytest

import foldyn as fd
from case_texts import MODES_TEXT
from foldyn.cli.main import main
from foldyn.errors import FoldynWarning, StretchWarning, Told, UnitsWarning
from foldyn.studies.pool import run


def test_texts_that_differ_in_numbers_are_told_once():
    told = Told()
    new = [
        told.add(text, where)
        for text, where in (
            ("panels hold 6% of it at t = 0.38 s", "a"),
            ("panels hold 8% of it at t = 1.1e-3 s", "b"),
            ("loads[0]: acts in part", ""),
            ("loads[1]: acts in part", ""),
            ("mode 3 lies above -2 Hz", ""),
            ("mode 4 lies above 7 Hz", ""),
            ("panels hold 6% of it at t = 0.38 s", "a"),
            ("modes 1, 2 lie above 7 Hz", ""),
            ("modes 1, 2, 3 lie above 7 Hz", ""),
        )
    ]
    assert new == [True, False, True, True, True, False, False, True, False]
    assert list(told) == [
        "panels hold 6% of it at t = 0.38 s (a, b)",
        "loads[0]: acts in part",
        "loads[1]: acts in part",
        "mode 3 lies above -2 Hz (and 1 with other numbers)",
        "modes 1, 2 lie above 7 Hz (and 1 with other numbers)",
    ]
    for k in range(9):
        told.add("many", f"run {k}")
    assert list(told)[-1].endswith("run 4, run 5 and 3 more)")


class Warns:
    """A task that warns of its model, and of something else."""

    name = "one"

    def there(self, folder):
        return False

    def make(self, folder):
        warnings.warn("panels that stretch", StretchWarning, stacklevel=2)
        warnings.warn("the damping", FoldynWarning, stacklevel=2)


def test_studies_take_their_models_on_purpose(tmp_path):
    (done,) = run([Warns()], tmp_path, processes=1)
    assert done.warnings == ("the damping",)


@pytest.mark.matrix
def test_shipped_cases_say_on_their_page_what_their_model_lacks(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["run", "gallery/kresling", "--out", "page"]) == 0
    assert capsys.readouterr().err == ""
    page = (tmp_path / "page" / "report.html").read_text("utf-8")
    assert page.count("panels that stretch hold 100% of the strain energy") == 1
    assert main(["run", "gallery/kresling", "--no-figures", "--out", "none"]) == 0
    told = capsys.readouterr().err
    assert told.startswith("foldyn: warning: gallery/kresling: panels that stretch hold 100%")
    assert len(told) < 400


@pytest.mark.matrix
def test_sweeps_say_once_what_points_are_warned_of(tmp_path, capsys, monkeypatch):
    """A sheet of 1 m edges is no thin one from 0.2 m on."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "case.toml").write_text(MODES_TEXT, "utf-8")
    vary = {"sheet.thickness": [0.01, 0.25, 0.3]}
    with pytest.warns(UnitsWarning) as caught:
        found = fd.sweep("case.toml", vary, measures=["mass"], processes=1)
    (one,) = (one for one in caught if one.category is UnitsWarning)
    text = str(one.message)
    assert text.startswith("sheet: thickness = 0.25 m is") and one.filename == __file__
    assert text.endswith("(docs/sheets.md#units) (thickness = 0.25, thickness = 0.3)")
    said = [line.count("UnitsWarning: sheet: thickness") for line in found.warnings.values.tolist()]
    assert said == [0, 1, 1]
    asked = ("--vary", "sheet.thickness=0.25:0.3:2", "--measure", "mass", "--processes", "1")
    assert main(["sweep", "case.toml", *asked, "--no-figures"]) == 0
    lines = capsys.readouterr().err.splitlines()
    (line,) = (line for line in lines if "sheet: thickness" in line)
    assert line == f"foldyn: warning: case.toml: {text}"


def test_many_motions_say_once_what_cases_are_warned_of():
    """Pulses that are shorter than the steps of both."""
    pattern = fd.patterns.simple_fold(dihedral=90)
    structure = fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.01, 1.0), preset="herkal")
    push = fd.Force([0, 1], (1e-6, 0.0, 0.0), fd.HalfSine(1e-5))
    cases = [fd.Case(structure, [fd.Fix([4, 5])], [push])] * 2
    with pytest.warns(FoldynWarning, match="do not resolve the history half_sine") as caught:
        fd.simulate_many(cases, 0.01)
    said = [str(one.message) for one in caught]
    (text,) = (text for text in said if "half_sine" in text)
    assert text.endswith("(docs/integrators.md#steps) (cases[0], cases[1])")
    assert {one.filename for one in caught} == {__file__}
