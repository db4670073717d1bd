"""Values that a result lacks by nature say why; any other nan is a failure."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import foldyn as fd
from case_texts import FOLD_TEXT
from foldyn.cli.main import main
from foldyn.results.quantities import REASONS, missing_values

DOCS = (Path(__file__).parents[2] / "docs" / "results.md").read_text("utf-8")
SHEET = fd.Sheet(1e6, 0.25, 0.01, 1.0)
CASE = FOLD_TEXT + '[model]\nbend_law = "linear"\n'
FREE = CASE + '[analysis]\nkind = "modes"\ncount = 8\n'
SHAKEN = (
    CASE
    + """
[analysis]
kind = "frf"
frequencies = [0.0, 1.0]
[[drive]]
nodes = [0]
force = [1e-3, 0, 0]
"""
)
FOLD = fd.discretize(fd.patterns.simple_fold(dihedral=60), SHEET, bend_law="linear")


def test_every_reason_is_in_the_documentation():
    section = DOCS.split("## Missing values")[1].split("\n## ")[0]
    named = re.findall(r"`(\w+)`", "".join(re.findall(r"^\| (`.*?) \|", section, re.M)))
    assert set(named) == set(REASONS)


@pytest.mark.matrix
def test_rigid_modes_have_no_damping_ratio(tmp_path):
    found = fd.modes(fd.Case(FOLD), count=8)
    rigid = found.rigid.values
    assert rigid.sum() == 6
    assert (np.isnan(found.damping_ratio.values) == rigid).all()
    fd.save(found, tmp_path / "modes.nc")
    stored = fd.load(tmp_path / "modes.nc")
    assert stored.damping_ratio.attrs["missing"] == REASONS["damping_ratio"]
    assert "missing" not in stored.frequency.attrs
    assert list(missing_values(stored)) == ["damping_ratio"]
    assert missing_values(stored)["damping_ratio"].startswith(
        "6 of 8 values are missing (nan): a rigid"
    )


@pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
def test_responses_without_damping_or_motion():
    force, held = fd.Force([0, 1], (1e-3, 0, 0)), [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "z")]
    fold = fd.Case(FOLD, held, damping=fd.Rayleigh(alpha=2.0))
    still = fd.frf(fd.Case(FOLD), force, frequencies=[0.0, 1.0])
    assert np.isnan(still.receptance.values[0]).all()
    assert still.receptance.attrs["missing"] == REASONS["receptance"]
    random = fd.frf(
        fold, force, frequencies=[1.0, 2.0, 3.0], method="burst_random", averages=2, duration=4.0,
        integrator="newmark", dt=0.01,
    )  # fmt: skip
    assert np.isnan(random.coherence.values).any()  # of what is held
    assert random.coherence.attrs["missing"] == REASONS["coherence"]
    assert "missing" not in random.receptance.attrs


@pytest.mark.parametrize(
    ("text", "kind", "words"),
    [
        (FREE, "modes", "  damping_ratio: 6 of 8 values are missing (nan): a rigid"),
        (SHAKEN, "frf", "  receptance: "),
    ],
)
def test_the_command_says_what_is_missing(text, kind, words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "case.toml").write_text(text)
    assert main([kind, "case.toml", "--no-figures"]) == 0
    assert words in capsys.readouterr().out


def test_any_other_nan_is_a_failure(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("foldyn.results.quantities.REASONS", {})
    (tmp_path / "case.toml").write_text(FREE)
    assert main(["modes", "case.toml", "--no-figures"]) == 1
    assert "damping_ratio: 6 of 8 values are missing" in capsys.readouterr().err
    assert (tmp_path / "case-modes" / "result.nc").exists()  # kept, and named
