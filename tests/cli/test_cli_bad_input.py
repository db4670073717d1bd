"""Status 2: bad input gets one message, no traceback, and nothing is written."""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

import pytest

from case_texts import begins, changed, rows
from foldyn import ram_limit

# edits of the good case file, and the message after the file's name; the tests of case files have
# those of reading, here are those of what is checked before a run
BAD = """
sheet.thickness =; sheet.thicknes = 0.01 | sheet.thicknes: unknown key; did you mean 'thickness'?
pattern = { vertices = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 2, 0]], faces = [[0, 1, 2,
    3]] }; supports[0].nodes = [0, 1]; loads[0].nodes = [3] | node 4 is free but has no mass: fix
    it along x, y and z, attach a panel to it
supports[0].nodes = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12]; loads = | supports: hold every
    node along x, y and z, so that nothing can move: free one
analysis.dt = 1e-3 | analysis.dt = 0.001 s is above the critical step of 0.00087 ... take a
    smaller one or leave dt out (force = true
analysis.dt = 0.2; analysis.force = true | analysis.dt = 0.2 s: longer than the duration of 0.1 s
analysis.duration = 1e30; output.interval = 1e30 | analysis.duration = 1e+30 s: takes 2.29e+33 steps
    ... shorten it
output.interval = 0.2 | output.interval = 0.2 s: longer than the duration of 0.1 s
output.interval =; output.every_steps = 1000 | output.every_steps = 1000: longer than the
    motion of 230 steps
analysis.dt = 3e-4 | output.interval = 0.01 s is not a whole number of steps of dt = 0.0003 s; use
    dt = 0.000294
analysis.duration = 1e6; output.interval =; output.every_steps = 1 | output.interval: 2.29e+09
    samples of 13 nodes needs about 1.59e+03 GiB ... keep fewer samples
loads[0].nodes = [0, 7]; analysis.dt = 1 | analysis.dt = 1 s: longer than the duration
model.mass = ["panel", "consistent"]; analysis.dt = 6.25e-4 | mass = "consistent": analysis.dt =
    0.000625 s is above the critical step
pattern = { file = "bare.fold" } | pattern.file = "bare.fold": bare.fold: edges_vertices is missing
    ... export the pattern with its edges
"""


@pytest.mark.parametrize(("edits", "message"), rows(BAD))
def test_bad_values(workplace, miura, edits, message) -> None:
    workplace.write('{"vertices_coords": [[0, 0], [1, 0], [1, 1]]}', "bare.fold")
    workplace.write(changed(miura, edits))
    line = workplace.refused("run", "case.toml", "--no-figures")
    assert begins(line, f"case.toml: {message}"), line


def test_a_file_that_is_no_case_file(workplace) -> None:
    workplace.write("[pattern]\ncells = [1, 1\nb = 1\n")
    line = workplace.refused("run", "case.toml")
    assert begins(line, "case.toml: is not valid TOML: ... line 3")


def test_every_problem_has_its_line(workplace, miura) -> None:
    edits = "sheet.thickness =; sheet.thicknes = 1; damping.alpha = nan; sheet.poissons_ratio = -2"
    bad = workplace.run(changed(miura, edits))
    assert (bad.status, bad.out, bad.new) == (2, "", [])
    keys = ("thicknes:", "poissons_ratio = -2", "alpha = nan")
    for line, key in zip(bad.err.splitlines(), keys, strict=True):
        assert key in line


def test_the_memory_of_all_mass_rules_together(workplace, miura, monkeypatch) -> None:
    monkeypatch.setattr(sys.modules["foldyn.structures.discretize"], "PER_NODE", 7000.0)
    monkeypatch.setattr(ram_limit, "memory", lambda: 200e3)  # one motion needs 75 kB
    assert workplace.run(changed(miura, "output.interval = 0.001")).status == 0
    workplace.write(
        changed(miura, 'output.interval = 0.001; model.mass = ["panel", "centroid"]'), "b"
    )
    line = workplace.refused("run", "b", "--out", "other")  # with its page: all in memory
    told = "b: output.interval: 202 samples of 13 nodes of 2 mass rules needs about ... --force"
    assert begins(line, told), line


def test_files_that_are_not_there(workplace) -> None:
    for name in ("none.toml", "x" * 300 + ".toml", "herkal/case9", ""):
        line = workplace.refused("run", name)
        assert "there is no such file; shipped cases are gallery/deployment, " in line
    assert workplace.refused("run", ".") == ".: is a folder; give a case file (TOML)"


@pytest.mark.parametrize(
    ("out", "reason"),
    [
        ("case.toml", "is a file; name a folder"),
        ("case.toml/below", "cannot be written"),
        ("new/" + "x" * 300, "cannot be written"),
        ("", "is empty; name a folder"),
        ("taken", "taken/result.nc is a folder where a file is to be written; name"),
    ],
)
def test_results_folders_that_cannot_be(workplace, miura, out, reason) -> None:
    (workplace.folder / "taken" / "result.nc").mkdir(parents=True)
    workplace.write(miura)
    line = workplace.refused("run", "case.toml", "--out", out)
    assert begins(line, f"--out{' ' + out if out else ''}: ... {reason} ... folder"), line


def test_a_results_folder_without_permission(workplace, miura, monkeypatch) -> None:
    def refused(*_, **__):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(tempfile, "TemporaryFile", refused)  # as the test may run as root
    workplace.write(miura)
    assert workplace.refused("run", "case.toml") == (
        "results folder case-results: cannot be written (Permission denied); name another folder"
    )


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write")
def test_a_folder_that_is_read_only(workplace, miura) -> None:
    Path("locked").mkdir(mode=0o500)
    workplace.write(miura)
    line = workplace.refused("run", "case.toml", "--out", "locked/results")
    assert "cannot be written (Permission denied)" in line


def test_too_few_samples_for_figures(workplace, miura) -> None:
    workplace.write(changed(miura, "output.interval = 0.05"))
    line = workplace.refused("run", "case.toml", "--figures", "png")
    told = "gives 3 samples, spectra need 4: lower it, lengthen analysis.duration, or"
    assert line.startswith(f"case.toml: output.interval: {told}")
    workplace.good("run", "case.toml", "--no-figures")
