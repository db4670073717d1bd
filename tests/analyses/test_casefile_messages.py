"""The one message that a bad case file gets."""

from __future__ import annotations

import pytest
from casefile_checks import check

from case_texts import changed, rows
from foldyn.errors import FoldynWarning, InputError

# edits of the example, and how the message begins
BAD = """
sheet.thickness = -0.01: must be greater than 0
sheet.poissons_ratio = 0.5: must lie between
sheet.thickness =; sheet.thicknes = 0.01 | sheet.thicknes: unknown key; did you mean 'thickness'?
    known keys: youngs
sheet.thickness = | sheet.thickness: missing
supports =; support = [{ nodes = [0, 1, 2], axes = "xyz" }] | support: unknown key; did you mean
    'supports'? known keys: title
sheet.thickness = "0.01": must be a number
sheet.thickness = true: must be a number
sheet.density = nan: must be a finite
analysis.duration = inf: must be a fin
sheet.density = 2020-01-01: must be a number
sheet.density = | sheet.density: missing; a motion needs it
damping.alpha = -0.02: must be at least
damping.ratios = [[9, 0.1], [17, 0.1]] | damping.ratios = [[9.0, 0.1], [17.0, 0.1]]: they give
    alpha and beta; leave those out
damping.alpha =; damping.ratios = [9, 0.1] | damping.ratios = [9, 0.1]: must be two pairs of a
    frequency (Hz) and the damping ratio
title = 3: must be text
loads[0].nodes = [6, 99]: node 99 is out of range; this structure has nodes 0 to 12
output.nodes = 13 | output.nodes = [13]: node 13 is out of range
supports[0].nodes = "xmid": xmid is not known
supports[0].nodes = "x > 99": selects no vertex; the pattern spans x 0 to
supports[0].nodes = [0.0]: 0.0 is not a node number
supports[0].axes = "xw": must be letters
supports = { nodes = [0, 1, 2], axes = "xyz" }: must be a list of tables, written [[
title =; damping = 0.02; damp = {} | damping = 0.02: must be a table, written [damping]
supports[0].axes =; supports[0].axess = "xyz" | supports[0].axess: unknown key; did you mean
    'axes'? known keys: nodes
loads[0].force = [0.01, 0]: must be three numbers
loads[0].force[1] = nan: must be a finite number
loads[0].force =; loads[0].gravity = [0, 0, -9.81] | loads[0].gravity: acts on the whole
    structure; leave out nodes, or write [[loads]] for
loads[0] = { gravity = [0, 0, 0] } | loads[0].gravity = [0, 0, 0]: must not be zero
loads[0] = { gravity = [0, 0, inf] } | loads[0].gravity[2] = inf: must be a finite number
loads[0].force = | loads[0].force: missing; give it (N)
loads[0].nodes = | loads[0].nodes: missing; give its value
loads[0].nodes =; loads[0].force = | loads[0]: give nodes and force, or gravity, or creases
loads[0].force =; loads[0].forces = [0.01, 0, 0] | loads[0].forces: unknown key; did you mean
    'force'? known keys: nodes, force, gravity
loads[0].history.duration =; loads[0].history.kind = "table"; loads[0].history.file = "none.csv" |
    loads[0].history.file = "none.csv":
loads[0].history.duration =; loads[0].history.kind = "table"; loads[0].history.file = 3 |
    loads[0].history.file = 3: must be the path of a CSV file
loads[0].history = { kind = "table", file = "a.csv", times = [0, 1] } | loads[0].history.file:
    unknown key; known keys: times, values
loads[0].history = { kind = "table", file = "a.csv", column = "F" } | loads[0].history.column:
    unknown key; known keys: file, time, value, unit
loads[0].history.duration =; loads[0].history.kind = "table" | loads[0].history: give times and
    values, or file (CSV)
loads[0].nodes = [0, 2] | loads[0]: the force [0.01, 0.0, 0.0] acts only where supports hold its
    nodes: 0 (x), 2 ... load other nodes or axes, or free these
loads[0].nodes = [7, 7]: node 7 is
loads[0].history.kind = "puls": did you mean 'pulse'? choose one of const
loads[0].history.duration = -1: must be greater than 0
loads[0].history.duration =; loads[0].history.duratoin = 1.0 | loads[0].history.duratoin: unknown
    key; did you mean 'duration'? known
loads[0].history.duration = | loads[0].history.duration: missing
loads[0].history = "pulse": must be a table { kind = "..." }
loads[0].history = { kind = "table", times = [0, 1], values = [0, nan] } |
    loads[0].history.values[1] = nan: must be a finite number
loads[0].history = { kind = "table", times = [0, 2, 1], values = [0, 1, 2] } |
    loads[0].history.times[2] = 1.0: must increase, and the one before it is 2.0; sort them
model.mass = "circumcentre": did you mean 'circumcenter'? choose one of
model.mass = ["panel", "pannel"] | model.mass[1] = "pannel": did you mean 'panel'?
model.mass = ["panel", "panel"] | model.mass[1] = "panel": is listed twice
model.mass = []: give at least one of
model.mass = 1: choose one of
model.scheme = "n6b8": did you mean 'n5b8'?
model.bend_law = "superliner": did you mean 'superlinear'?
model.fold_law.theta1 = "45": must be a number
model.fold_law.theta1 = 400 | model.fold_law: theta1 = 400.0, theta2 = 315.0: need
    0 < theta1 < theta2
model.fold_law.theta1 =; model.fold_law.thetta1 = 45 | model.fold_law.thetta1: unknown key; did
    you mean 'theta1'? known keys: theta1
pattern.kind = "muira": did you mean 'miura'? choose one of simple_fold
pattern.panel_angle =; pattern.panel_angel = 60 | pattern.panel_angel: unknown key; did you mean
    'panel_angle'? known keys
pattern.panel_angle = 200 | pattern.panel_angle = 200
pattern.panel_angle = "60": must be a number
pattern.panel_angle = nan: must be a finite number
pattern.file = "a.fold" | pattern: give only one of kind and file
pattern.kind = | pattern: give kind (a generator), file, or
analysis.kind = "mode": did you mean 'modes'? choose one of dynamics, statics, modes
analysis.method = "rk5": did you mean 'rk4'? choose one
analysis.duration = | analysis.duration: missing
analysis.duration = 0: must be greater than 0
analysis.dt = 0: must be greater than 0
analysis.force = 1: must be true or false
output.every_steps = 0: must be at least 1
output.interval = -0.1: must be greater
output.interval = true: must be a number
output.axis = "w": choose one of x, y, z
output.axis = ["x"]: choose one of x, y, z
output.axes = "x" | output.axes: unknown key; did you mean 'axis'? known keys: nodes, axis,
    every_steps, interval, max_freq
output.max_frequency = 0: must be greater than 0
output.animation = "mp3": did you mean 'mp4'? choose one of gif, mp4
model.crease_stiffness = [1.0] | model:
model.crease_rest = 0 | model: crease_rest = 0: must lie between 0 and 360 degrees
model.crease_rest = [60, 60] | model: crease_rest: 2 values for 4 creases: give one, or one for each
model.crease_rest = nan: must be a finite number
"""
# the same in the short example
BAD_SHORT = """
pattern = { file = "no.fold" } | pattern.file = "no.fold": ... no.fold: there is no such file
pattern = { file = "case2.toml" } | pattern.file = "case2.toml": ... .fold
pattern = { vertices = [[0, 0]] } | pattern.faces: missing
pattern = { vertices = [[0, nan]], faces = [[0]] } | pattern.vertices[0][1] = nan: must be a finite
pattern = { vertices = [[0, 0]], faces = [[0, 0.5]] } | pattern.faces[0] = [0, 0.5]: must be a list
    of vertex numbers
pattern = { vertices = [[0, 0], [1, 0], [0, 1]], faces = [[0, 1, 2]], welds = [[0, 1]] } | pattern:
    welds: (0, 1) is not an edge of two panels
pattern.b = 4.0; pattern.panel_angle = 30; model.mass = "circumcenter" | model: mass =
    "circumcenter": panel ... use mass = "mixed_voronoi"
pattern = { vertices = [[0, 0], [1, 0], [1, 1], [0, 1]], faces = [[0, 1, 2], [0, 2, 3]] };
    model.mass = "equi_inertial"; loads[0].nodes = [3] | model: mass = "equi_inertial" ... use
    mass = "mixed_voronoi"
"""


@pytest.mark.parametrize(("edits", "message"), rows(BAD))
def test_a_bad_file_gets_one_message(read, example, edits, message) -> None:
    check(read, changed(example, edits), message)


@pytest.mark.parametrize(("edits", "message"), rows(BAD_SHORT))
def test_a_bad_short_file_gets_one_message(read, short, edits, message) -> None:
    check(read, changed(short, edits), message)


def test_missing_sections(read, example) -> None:
    check(read, example[example.index("[sheet]") :], "pattern: missing")
    for section in ("pattern", "sheet", "analysis"):
        check(read, "", f"{section}: missing")


def lines_of(read, text) -> list[str]:
    """All that reading a bad file says."""
    with pytest.raises(InputError) as caught:
        read(text)
    return str(caught.value).split("case2.toml: ")[1].split("\n  also ")


def test_a_bad_csv_file_is_named_with_its_line(read, example, tmp_path) -> None:
    (tmp_path / "pulse.csv").write_text("t [s],f\n0,0\n1,one\n")
    text = example.replace('"pulse", duration = 1.0', '"table", file = "pulse.csv"')
    check(read, text, 'loads[0].history.file = "pulse.csv": ')
    with pytest.raises(InputError, match=r'pulse\.csv: line 3, column "f": "one" is not a number'):
        read(text)


def test_a_misspelled_key_is_told_once(read, example) -> None:
    edits = "sheet.thickness =; sheet.yuongs = 1; sheet.thicknes = 0.01"
    first, second = lines_of(read, changed(example, edits))
    assert first.startswith("sheet.yuongs: unknown key; known keys: youngs_modulus")
    assert second.startswith("sheet.thicknes: unknown key; did you mean 'thickness'?")


def test_a_list_of_mass_rules_warns_once(read, example) -> None:
    text = example.replace('"circumcenter"', '["panel", "centroid"]').replace("[6, 7, 8]", "[0, 6]")
    with pytest.warns(FoldynWarning, match=r"loads\[0\].*in part") as record:
        read(text)
    assert len(record) == 1


def test_all_faults_are_told_at_once(read, short) -> None:
    """Of the keys, of the selections, and then of what only the made sheet can refuse."""
    edits = 'pattern.kind = "mura"; pattern.cell = [1, 1]; supports[0].nodes = "xmn"'
    kind, key, nodes = lines_of(read, changed(short, edits))
    assert kind.startswith("pattern.kind = \"mura\": did you mean 'miura'?")
    assert key.startswith("pattern.cell: unknown key; did you mean 'cells'?")
    assert nodes.startswith('supports[0].nodes = "xmn": xmn is not known; use xmin')
    edits = 'pattern.dihedral = "flat"; pattern.b = "wide"; pattern.a = "long"'
    keys = [line.split(" = ")[0] for line in lines_of(read, changed(short, edits))]
    assert keys == ["pattern.a", "pattern.b", "pattern.dihedral"]  # as declared
    edits = "supports[0].nodes = [99]; loads[0].nodes = [77]"
    held, loaded = lines_of(read, changed(short, edits))
    assert held.startswith("supports[0].nodes = [99]: node 99 is out of range")
    assert loaded.startswith("loads[0].nodes = [77]: node 77 is out of range")
