"""Status 2: bad input gets one message, no traceback, and nothing is written."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import pytest

from foldyn import ram_limit

LOAD = (
    "[[loads]]\nnodes = [7]\nforce = [0.01, 0, 0]\n"
    'history = { kind = "half_sine", duration = 0.05 }\n'
)
KIND = 'kind = "miura"\ncells = [1, 1]\ndihedral = 60'
SQUARE = "vertices = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]{more}]\nfaces = [[0, 1, 2, 3]]"
ALL = "[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12]"

# what is replaced in the good case file, by what; the beginning of the message after the file's
# name; and more that it must say
BAD = {
    "unknown key": (
        [("thickness", "thicknes")],
        "sheet.thicknes: unknown key; did you mean 'thickness'?",
    ),
    "unknown table": (
        [("[analysis]", "[anlysis]")],
        "anlysis: unknown key; did you mean 'analysis'?",
    ),
    "wrong type": ([("= 0.01\ndensity", '= "thin"\ndensity')], 'sheet.thickness = "thin": must be'),
    "node out of range": (
        [("nodes = [7]", "nodes = [13]")],
        "loads[0].nodes = [13]: node 13 is out of range; this structure has nodes 0 to 12",
    ),
    "negative node": (
        [("nodes = [7]", "nodes = [-1]")],
        "loads[0].nodes = [-1]: node -1 is out of range",
    ),
    "load on fixed dofs only": (
        [("nodes = [7]", "nodes = [0, 2]")],
        "loads[0]: the force [0.01, 0.0, 0.0] acts only where supports hold its nodes: 0 (x), 2",
        "load other nodes or axes, or free these",
    ),
    "free node without mass": (
        [
            (KIND, SQUARE.format(more=", [2, 2, 0]")),
            ("nodes = [7]", "nodes = [3]"),
            ("[0, 1, 2]", "[0, 1]"),
        ],
        "node 4 is free but has no mass: fix it along x, y and z, attach a panel to it",
    ),
    "non-manifold pattern": (
        [
            (
                KIND,
                "vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]]\n"
                "faces = [[0, 1, 2], [1, 0, 3], [0, 1, 4]]",
            )
        ],
        "pattern: ",
        "3 faces",
    ),
    "dt above critical": (
        [("duration = 0.1", "duration = 0.1\ndt = 1e-3")],
        "analysis.dt = 0.001 s is above the critical step of 0.00087",
        "take a smaller one or leave dt out (force = true",
    ),
    "negative thickness": (
        [("thickness = 0.01", "thickness = -0.01")],
        "sheet.thickness = -0.01: must be greater than 0",
    ),
    "nu 0.5": ([("= 0.25", "= 0.5")], "sheet.poissons_ratio = 0.5: must lie between -1 and 0.5"),
    "nan in a table": (
        [('"half_sine", duration = 0.05', '"table", times = [0, 1], values = [0, nan]')],
        "loads[0].history.values[1] = nan: must be a finite number",
    ),
    "table runs back": (
        [('"half_sine", duration = 0.05', '"table", times = [0, 2, 1], values = [0, 1, 2]')],
        "loads[0].history.times[2] = 1.0: must be greater than the time before it (2.0)",
    ),
    "mass rule that does not suit the panels": (
        [("dihedral = 60", "dihedral = 60\nb = 4.0\npanel_angle = 30")],
        'model: mass = "circumcenter": panel',
        'use mass = "mixed_voronoi"',
    ),
    "mass rule for quads on triangles": (
        [
            (KIND, "vertices = [[0, 0], [1, 0], [1, 1], [0, 1]]\nfaces = [[0, 1, 2], [0, 2, 3]]"),
            ('"circumcenter"', '"equi_inertial"'),
            ("nodes = [7]", "nodes = [3]"),
        ],
        'model: mass = "equi_inertial"',
        'use mass = "mixed_voronoi"',
    ),
    "duration zero": (
        [("duration = 0.1", "duration = 0")],
        "analysis.duration = 0: must be greater than 0",
    ),
    "duration negative": (
        [("duration = 0.1", "duration = -1")],
        "analysis.duration = -1: must be greater than 0",
    ),
    "duration in words": (
        [("duration = 0.1", 'duration = "1 s"')],
        'analysis.duration = "1 s": must be a number',
    ),
    "duration without end": (
        [("duration = 0.1", "duration = 1e30"), ("every = 0.01", "every = 1e30")],
        "analysis.duration = 1e+30 s: takes 2.29e+33 steps",
        "shorten it",
    ),
    "every longer than duration": (
        [("every = 0.01", "every = 0.2")],
        "output.every = 0.2 s: longer than the duration of 0.1 s",
    ),
    "more steps than there are": (
        [("every = 0.01", "every = 1000")],
        "output.every = 1000: longer than the motion of 230 steps",
    ),
    "every is not a multiple of dt": (
        [("duration = 0.1", "duration = 0.1\ndt = 3e-4")],
        "output.every = 0.01 s is not a whole number of steps of dt = 0.0003 s; use dt = 0.000294",
    ),
    "dt longer than duration": (
        [("duration = 0.1", "duration = 0.1\ndt = 0.2\nforce = true")],
        "analysis.dt = 0.2 s: longer than the duration of 0.1 s",
    ),
    "dt negative": (
        [("duration = 0.1", "duration = 0.1\ndt = -1e-4")],
        "analysis.dt = -0.0001: must be greater than 0",
    ),
    "too many samples": (
        [("duration = 0.1", "duration = 1e6"), ("every = 0.01", "every = 1")],
        "output.every: 2.29e+09 samples of 13 nodes needs about 1.59e+03 GiB",
        "raise it",
    ),
    "unknown analysis": (
        [('kind = "dynamics"', 'kind = "buckling"')],
        'analysis.kind = "buckling": choose one of dynamics, statics, modes, frf',
    ),
    "axes": (
        [('axes = "xyz"', 'axes = "xq"')],
        'supports[0].axes = "xq": must be letters of "xyz", as in "xz"',
    ),
    "crease closed at rest": (
        [("[damping]", "crease_rest = 0\n[damping]")],
        "model: crease_rest = 0: must lie between 0 and 360 degrees",
    ),
    "crease_rest of the wrong length": (
        [("[damping]", "crease_rest = [60, 60]\n[damping]")],
        "model: crease_rest: 2 values for 4 creases: give one, or one for each",
    ),
    "theta1 above theta2": (
        [("[damping]", 'fold_law = { kind = "enhanced", theta1 = 300, theta2 = 45 }\n[damping]')],
        "model.fold_law: theta1 = 300.0, theta2 = 45.0: need 0 < theta1 < theta2",
    ),
    "pattern file that is missing": (
        [(KIND, 'file = "crane.fold"')],
        'pattern.file = "crane.fold": crane.fold: there is no such file',
    ),
    "pattern file of no known format": (
        [(KIND, 'file = "case.toml"')],
        'pattern.file = "case.toml": ',
        ".fold",
    ),
    "everything fixed": (
        [("[0, 1, 2]", ALL), (LOAD, "")],
        "supports: hold every node along x, y and z, so that nothing can move: free one",
    ),
    "negative damping": ([("= 0.0628", "= -1")], "damping.alpha = -1: must be at least 0"),
    "no density": ([("density = 1.0\n", "")], "sheet.density: missing; a motion needs it"),
    "selection that finds nothing": (
        [("nodes = [7]", 'nodes = "x > 10"')],
        'loads[0].nodes = "x > 10": selects no vertex; the pattern spans x 0 to',
    ),
    "a node twice": ([("nodes = [7]", "nodes = [7, 7]")], "loads[0].nodes = [7, 7]: node 7 is"),
    "output axis": (
        [("every = 0.01", 'every = 0.01\naxis = "w"')],
        'output.axis = "w": choose one of x, y, z',
    ),
    "output frequency": (
        [("every = 0.01", "every = 0.01\nmax_frequency = 0")],
        "output.max_frequency = 0: must be greater than 0",
    ),
}

# whole contents of a case file
BAD_FILES = {
    "broken": ("[pattern]\ncells = [1, 1\nb = 1\n", "is not valid TOML: ", "line 3"),
    "binary": (b"\x89PNG\r\n\x1a\n\x00\xff", "is not a text file in UTF-8; give a case file"),
    "another format": ('{"vertices_coords": []}', "is not valid TOML: "),
}


def check(outcome, message: str, *more: str) -> None:
    """One line that names the case file and begins as told; nothing said or written beside it."""
    assert outcome.status == 2, outcome
    assert outcome.new == []
    assert outcome.out == ""
    (line,) = outcome.err.splitlines()
    assert line.startswith(f"foldyn: case.toml: {message}"), line
    for text in more:
        assert text in line, line


@pytest.mark.parametrize("name", BAD)
def test_bad_values(workplace, edited, name) -> None:
    edits, *texts = BAD[name]
    check(workplace.run(edited(*edits)), *texts)


@pytest.mark.parametrize("name", BAD_FILES)
def test_bad_files(workplace, name) -> None:
    content, *texts = BAD_FILES[name]
    check(workplace.run(content), *texts)


def test_every_problem_has_its_line(workplace, edited) -> None:
    text = edited(("thickness", "thicknes"), ("= 0.0628", "= nan"), ("= 0.25", "= 0.6"))
    bad = workplace.run(text)
    assert (bad.status, bad.out, bad.new) == (2, "", [])
    lines = bad.err.splitlines()
    assert len(lines) == 3
    for line, key in zip(lines, ("thicknes:", "poissons_ratio = 0.6", "alpha = nan"), strict=True):
        assert key in line
    empty = workplace.run("")
    assert (empty.status, empty.new) == (2, [])
    assert [line.split(": ")[-2].split()[-1] for line in empty.err.splitlines()] == [
        "pattern",
        "sheet",
        "analysis",
    ]


def test_warnings_wait_until_all_is_well(workplace, edited) -> None:
    text = edited(("nodes = [7]", "nodes = [0, 7]"), ("duration = 0.1", "duration = 0.1\ndt = 1"))
    check(workplace.run(text), "analysis.dt = 1 s: longer than the duration")


def test_one_of_several_mass_rules(workplace, edited) -> None:
    rules = ('"circumcenter"', '["panel", "consistent"]')
    bad = workplace.run(edited(rules, ("duration = 0.1", "duration = 0.1\ndt = 6.25e-4\n")))
    check(bad, 'mass = "consistent": analysis.dt = 0.000625 s is above the critical step')


def test_the_memory_of_all_mass_rules_together(workplace, edited, monkeypatch) -> None:
    monkeypatch.setattr(ram_limit, "memory", lambda: 200e3)  # one motion needs 75 kB
    finer = ("every = 0.01", "every = 0.001")
    rules = ('"circumcenter"', '["panel", "centroid"]')
    assert workplace.run(edited(finer)).status == 0
    workplace.write(edited(finer, rules), "case.toml")
    bad = workplace.call("run", "case.toml", "--out", "other")  # with its page: all in memory
    check(bad, "output.every: 202 samples of 13 nodes of 2 mass rules needs about ", "--force")


def test_a_pattern_file_without_faces(workplace, edited) -> None:
    workplace.write('{"vertices_coords": [[0, 0], [1, 0], [1, 1]]}', "bare.fold")
    check(
        workplace.run(edited((KIND, 'file = "bare.fold"'))),
        'pattern.file = "bare.fold": bare.fold: edges_vertices is missing',
        "export the pattern with its edges",
    )


def test_files_that_are_not_there(workplace) -> None:
    for name in ("none.toml", "x" * 300 + ".toml", "herkal/case9", ""):
        bad = workplace.call("run", name)
        assert (bad.status, bad.out, bad.new) == (2, "", [])
        (line,) = bad.err.splitlines()
        assert "there is no such file; shipped cases are gallery/deployment, " in line
    folder = workplace.call("run", ".")
    assert (folder.status, folder.new) == (2, [])
    assert folder.err == "foldyn: .: is a folder; give a case file (TOML)\n"


@pytest.mark.parametrize(
    ("out", "reason"),
    [
        ("case.toml", "is a file; name a folder"),
        ("case.toml/below", "cannot be written"),
        ("new/" + "x" * 300, "cannot be written"),
        ("", "is empty; name a folder"),
        ("taken", "taken/result.nc is a folder, a file of this name is to be written; name"),
    ],
)
def test_results_folders_that_cannot_be(workplace, miura, out, reason) -> None:
    (workplace.folder / "taken" / "result.nc").mkdir(parents=True)
    bad = workplace.run(miura, "--out", out)
    assert (bad.status, bad.out, bad.new) == (2, "", [])
    (line,) = bad.err.splitlines()
    assert line.startswith(f"foldyn: --out{' ' + out if out else ''}: ")
    assert reason in line
    assert "folder" in line


def test_a_results_folder_without_permission(workplace, miura, monkeypatch) -> None:
    def refused(*_, **__):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(tempfile, "TemporaryFile", refused)  # as the test may run as root
    bad = workplace.run(miura)
    assert (bad.status, bad.out, bad.new) == (2, "", [])
    assert bad.err == (
        "foldyn: results folder case-results: cannot be written (Permission denied); name another "
        "folder\n"
    )


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write")
def test_a_folder_that_is_read_only(workplace, miura) -> None:
    Path("locked").mkdir(mode=0o500)
    bad = workplace.run(miura, "--out", "locked/results")
    assert (bad.status, bad.out, bad.new) == (2, "", [])
    assert "cannot be written (Permission denied)" in bad.err


def test_too_few_samples_for_figures(workplace, edited) -> None:
    workplace.write(edited(("every = 0.01", "every = 0.05")))
    check(
        workplace.call("run", "case.toml", "--figures", "png"),
        "output.every: gives 3 samples, spectra need 4: lower it, lengthen analysis.duration, or",
    )
    assert workplace.call("run", "case.toml", "--no-figures").status == 0
