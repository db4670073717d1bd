"""Warnings: once in a run, with where they apply; on the page where the model is on purpose."""

from __future__ import annotations

import warnings

from foldyn.cli.main import main
from foldyn.cli.streams import Told
from foldyn.errors import FoldynWarning, StretchWarning
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
        )
    ]
    assert new == [True, False, True, True, True, False, False]
    assert list(told) == [
        "panels hold 6% of it at t = 0.38 s (a, b)",
        "loads[0]: acts in part",
        "loads[1]: acts in part",
        "mode 3 lies above -2 Hz (and 1 with other numbers)",
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


def test_shipped_cases_say_on_their_page_what_their_model_lacks(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["run", "gallery/kresling", "--out", "page"]) == 0
    assert capsys.readouterr().err == ""
    page = (tmp_path / "page" / "report.html").read_text("utf-8")
    assert page.count("panels that stretch hold 100% of the strain energy") == 1
    assert main(["run", "gallery/kresling", "--no-figures", "--out", "none"]) == 0
    told = capsys.readouterr().err
    assert told.startswith("foldyn: warning: panels that stretch hold 100%") and len(told) < 400
