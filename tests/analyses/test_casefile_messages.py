"""The one message that a bad case file gets."""

from __future__ import annotations

import pytest
from casefile_checks import check, edited

from foldyn.errors import FoldynWarning, InputError

# what is replaced in the example, by what, and how the message begins
BAD = {
    "range": (
        [("thickness = 0.01", "thickness = -0.01")],
        "sheet.thickness = -0.01: must be greater than 0",
    ),
    "nu": ([("= 0.25", "= 0.5")], "sheet.poissons_ratio = 0.5: must lie between -1 and 0.5"),
    "unknown key": (
        [("thickness =", "thicknes =")],
        "sheet.thicknes: unknown key; did you mean 'thickness'? known keys: youngs",
    ),
    "missing key": ([("thickness = 0.01\n", "")], "sheet.thickness: missing"),
    "unknown section": (
        [("[[supports]]", "[[support]]")],
        "support: unknown key; did you mean 'supports'? known keys: title",
    ),
    "text for a number": (
        [("thickness = 0.01", 'thickness = "0.01"')],
        'sheet.thickness = "0.01": must be a number',
    ),
    "truth for a number": (
        [("thickness = 0.01", "thickness = true")],
        "sheet.thickness = true: must be a number",
    ),
    "nan": ([("density = 1000.0", "density = nan")], "sheet.density = nan: must be a finite"),
    "inf": ([("duration = 20.0", "duration = inf")], "analysis.duration = inf: must be a fin"),
    "date": (
        [("density = 1000.0", "density = 2020-01-01")],
        "sheet.density = 2020-01-01: must be a number",
    ),
    "no density": ([("density = 1000.0\n", "")], "sheet.density: missing; a motion needs it"),
    "damping": ([("alpha = 0.02", "alpha = -0.02")], "damping.alpha = -0.02: must be at least"),
    "ratios": (
        [("alpha = 0.02", "alpha = 0.02\nratios = [[9, 0.1], [17, 0.1]]")],
        "damping.ratios = [[9.0, 0.1], [17.0, 0.1]]: they give alpha and beta; leave those out",
    ),
    "one ratio": (
        [("alpha = 0.02", "ratios = [9, 0.1]")],
        "damping.ratios = [9, 0.1]: must be two pairs of a frequency (Hz) and the damping ratio",
    ),
    "title": ([('"an example"', "3")], "title = 3: must be text"),
    "node": (
        [("nodes = [6, 7, 8]", "nodes = [6, 99]")],
        "loads[0].nodes = [6, 99]: node 99 is out of range; this structure has nodes 0 to 12",
    ),
    "output node": (
        [("nodes = [6, 7]", "nodes = 13")],
        "output.nodes = [13]: node 13 is out of range",
    ),
    "selection": (
        [("nodes = [0, 1, 2]", 'nodes = "xmid"')],
        'supports[0].nodes = "xmid": xmid is not known',
    ),
    "empty selection": (
        [("nodes = [0, 1, 2]", 'nodes = "x > 99"')],
        'supports[0].nodes = "x > 99": selects no vertex',
    ),
    "float node": (
        [("nodes = [0, 1, 2]", "nodes = [0.0]")],
        "supports[0].nodes = [0.0]: 0.0 is not a node number",
    ),
    "axes": ([('axes = "xyz"', 'axes = "xw"')], 'supports[0].axes = "xw": must be letters'),
    "one table": (
        [("[[supports]]", "[supports]")],
        'supports = { nodes = [0, 1, 2], axes = "xyz" }: must be a list of tables, written [[',
    ),
    "no table": (
        [
            ("[damping]\nalpha = 0.02\nbeta = 0.0\n", "[damp]\n"),
            ('title = "an example"', "damping = 0.02"),
        ],
        "damping = 0.02: must be a table, written [damping]",
    ),
    "key in a list": (
        [('axes = "xyz"', 'axess = "xyz"')],
        "supports[0].axess: unknown key; did you mean 'axes'? known keys: nodes",
    ),
    "force": (
        [("force = [0.01, 0, 0]", "force = [0.01, 0]")],
        "loads[0].force = [0.01, 0]: must be three numbers",
    ),
    "force item": (
        [("force = [0.01, 0, 0]", "force = [0.01, nan, 0]")],
        "loads[0].force[1] = nan: must be a finite number",
    ),
    "gravity with nodes": (
        [("force = [0.01, 0, 0]", "gravity = [0, 0, -9.81]")],
        "loads[0].gravity: acts on the whole structure; leave out nodes, or write [[loads]] for",
    ),
    "no gravity": (
        [("nodes = [6, 7, 8]\nforce = [0.01, 0, 0]", "gravity = [0, 0, 0]")],
        "loads[0].gravity = [0, 0, 0]: must not be zero",
    ),
    "gravity item": (
        [("nodes = [6, 7, 8]\nforce = [0.01, 0, 0]", "gravity = [0, 0, inf]")],
        "loads[0].gravity[2] = inf: must be a finite number",
    ),
    "load without force": (
        [("force = [0.01, 0, 0]\n", "")],
        "loads[0].force: missing; give it (N)",
    ),
    "load without nodes": (
        [("nodes = [6, 7, 8]\n", "")],
        "loads[0].nodes: missing; give its value",
    ),
    "empty load": (
        [("nodes = [6, 7, 8]\nforce = [0.01, 0, 0]\n", "")],
        "loads[0]: give nodes and force, or gravity, or creases",
    ),
    "misspelled force": (
        [("force = [0.01, 0, 0]", "forces = [0.01, 0, 0]")],
        "loads[0].forces: unknown key; did you mean 'force'? known keys: nodes, force, gravity",
    ),
    "no CSV file": (
        [('"pulse", duration = 1.0', '"table", file = "none.csv"')],
        'loads[0].history.file = "none.csv": ',
    ),
    "CSV path": (
        [('"pulse", duration = 1.0', '"table", file = 3')],
        "loads[0].history.file = 3: must be the path of a CSV file",
    ),
    "CSV key": (
        [('"pulse", duration = 1.0', '"table", file = "a.csv", times = [0, 1]')],
        "loads[0].history.file: unknown key; known keys: times, values",
    ),
    "CSV column": (
        [('"pulse", duration = 1.0', '"table", file = "a.csv", column = "F"')],
        "loads[0].history.column: unknown key; known keys: file, time, value, unit",
    ),
    "empty table": (
        [('"pulse", duration = 1.0', '"table"')],
        "loads[0].history: give times and values, or file (CSV)",
    ),
    "fixed only": (
        [("nodes = [6, 7, 8]", "nodes = [0, 1]")],
        "loads[0]: the force [0.01, 0.0, 0.0] acts only where supports hold",
    ),
    "history kind": (
        [('"pulse"', '"puls"')],
        "loads[0].history.kind = \"puls\": did you mean 'pulse'? choose one of const",
    ),
    "history value": (
        [("duration = 1.0 }", "duration = -1 }")],
        "loads[0].history.duration = -1: must be greater than 0",
    ),
    "history key": (
        [("duration = 1.0 }", "duratoin = 1.0 }")],
        "loads[0].history.duratoin: unknown key; did you mean 'duration'? known",
    ),
    "history lacks": ([(", duration = 1.0 }", " }")], "loads[0].history.duration: missing"),
    "history text": (
        [('{ kind = "pulse", duration = 1.0 }', '"pulse"')],
        'loads[0].history = "pulse": must be a table { kind = "..." }',
    ),
    "nan in a table": (
        [('"pulse", duration = 1.0', '"table", times = [0, 1], values = [0, nan]')],
        "loads[0].history.values[1] = nan: must be a finite number",
    ),
    "mass": (
        [('"circumcenter"', '"circumcentre"')],
        "model.mass = \"circumcentre\": did you mean 'circumcenter'? choose one of",
    ),
    "masses": (
        [('"circumcenter"', '["panel", "pannel"]')],
        "model.mass[1] = \"pannel\": did you mean 'panel'?",
    ),
    "mass twice": (
        [('"circumcenter"', '["panel", "panel"]')],
        'model.mass[1] = "panel": is listed twice',
    ),
    "no mass": ([('"circumcenter"', "[]")], "model.mass = []: give at least one of"),
    "mass number": ([('"circumcenter"', "1")], "model.mass = 1: choose one of"),
    "scheme": ([('"n5b8"', '"n6b8"')], "model.scheme = \"n6b8\": did you mean 'n5b8'?"),
    "law": (
        [('"superlinear"', '"superliner"')],
        "model.bend_law = \"superliner\": did you mean 'superlinear'?",
    ),
    "law value": (
        [("theta1 = 45", 'theta1 = "45"')],
        'model.fold_law.theta1 = "45": must be a number',
    ),
    "law range": ([("theta1 = 45", "theta1 = 400")], "model.fold_law: theta1 ="),
    "law key": (
        [("theta1 = 45", "thetta1 = 45")],
        "model.fold_law.thetta1: unknown key; did you mean 'theta1'? known keys: theta1",
    ),
    "pattern kind": (
        [('"miura"', '"muira"')],
        "pattern.kind = \"muira\": did you mean 'miura'? choose one of simple_fold",
    ),
    "pattern key": (
        [("panel_angle", "panel_angel")],
        "pattern.panel_angel: unknown key; did you mean 'panel_angle'? known keys",
    ),
    "pattern value": ([("panel_angle = 60", "panel_angle = 200")], "pattern.panel_angle"),
    "pattern type": (
        [("panel_angle = 60", 'panel_angle = "60"')],
        'pattern.panel_angle = "60": must be a number',
    ),
    "pattern nan": (
        [("panel_angle = 60", "panel_angle = nan")],
        "pattern.panel_angle = nan: must be a finite number",
    ),
    "two patterns": (
        [('kind = "miura"', 'kind = "miura"\nfile = "a.fold"')],
        "pattern: give only one of kind and file",
    ),
    "no pattern": ([('kind = "miura"\n', "")], "pattern: give kind (a generator), file, or"),
    "other analysis": (
        [('kind = "dynamics"', 'kind = "mode"')],
        "analysis.kind = \"mode\": did you mean 'modes'? choose one of dynamics, statics, modes",
    ),
    "analysis": (
        [('kind = "dynamics"', 'kind = "dynamic"')],
        "analysis.kind = \"dynamic\": did you mean 'dynamics'?",
    ),
    "method": ([('"rk4"', '"rk5"')], "analysis.method = \"rk5\": did you mean 'rk4'? choose one"),
    "no duration": ([("duration = 20.0\n", "")], "analysis.duration: missing"),
    "dt": ([("# dt = 1e-3", "dt = 0")], "analysis.dt = 0: must be greater than 0"),
    "force flag": ([("# dt = 1e-3", "force = 1")], "analysis.force = 1: must be true or false"),
    "every": (
        [("every = 0.01", "every = 0")],
        "output.every = 0: must be a whole number, at least 1 (steps)",
    ),
    "every seconds": ([("every = 0.01", "every = -0.1")], "output.every = -0.1: must be greater"),
    "every truth": ([("every = 0.01", "every = true")], "output.every = true: must be a number"),
    "output axis": (
        [("every = 0.01", 'every = 0.01\naxis = "w"')],
        'output.axis = "w": choose one of x, y, z',
    ),
    "output axis case": (
        [("every = 0.01", 'every = 0.01\naxis = "X"')],
        'output.axis = "X": ',
    ),
    "output axis number": (
        [("every = 0.01", "every = 0.01\naxis = 1")],
        "output.axis = 1: choose one of x, y, z",
    ),
    "output axis list": (
        [("every = 0.01", 'every = 0.01\naxis = ["x"]')],
        'output.axis = ["x"]: choose one of x, y, z',
    ),
    "output axes": (
        [("every = 0.01", 'every = 0.01\naxes = "x"')],
        "output.axes: unknown key; did you mean 'axis'? known keys: nodes, axis, every, max_freq",
    ),
    "max_frequency": (
        [("every = 0.01", "every = 0.01\nmax_frequency = 0")],
        "output.max_frequency = 0: must be greater than 0",
    ),
    "animation": (
        [("every = 0.01", 'every = 0.01\nanimation = "mp3"')],
        "output.animation = \"mp3\": did you mean 'mp4'? choose one of gif, mp4",
    ),
    "animation truth": (
        [("every = 0.01", "every = 0.01\nanimation = false")],
        "output.animation = false: choose one of gif, mp4",
    ),
    "max_frequency nan": (
        [("every = 0.01", "every = 0.01\nmax_frequency = nan")],
        "output.max_frequency = nan: must be a finite number",
    ),
    "max_frequency text": (
        [("every = 0.01", 'every = 0.01\nmax_frequency = "5 Hz"')],
        'output.max_frequency = "5 Hz": must be a number',
    ),
    "crease list": ([("[damping]", "crease_stiffness = [1.0]\n[damping]")], "model: "),
    "crease nan": (
        [("[damping]", "crease_rest = nan\n[damping]")],
        "model.crease_rest = nan: must be a finite number",
    ),
}

# the same in the short example
BAD_SHORT = {
    "pattern file": ([('kind = "miura"', 'file = "no.fold"')], 'pattern.file = "no.fold": '),
    "vertices only": ([('kind = "miura"', "vertices = [[0, 0]]")], "pattern.faces: missing"),
    "nan vertex": (
        [('kind = "miura"', "vertices = [[0, nan]]\nfaces = [[0]]")],
        "pattern.vertices[0][1] = nan: must be a finite number",
    ),
    "face": (
        [('kind = "miura"', "vertices = [[0, 0]]\nfaces = [[0, 0.5]]")],
        "pattern.faces[0] = [0, 0.5]: must be a list of vertex numbers",
    ),
    "non-manifold": (
        [
            (
                'kind = "miura"',
                "vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]]\n"
                "faces = [[0, 1, 2], [1, 0, 3], [0, 1, 4]]",
            )
        ],
        "pattern: ",
    ),
    "negative mass": (
        [
            ('kind = "miura"\n', 'kind = "miura"\nb = 4.0\npanel_angle = 30\n'),
            ("[[supports]]", '[model]\nmass = "circumcenter"\n[[supports]]'),
        ],
        'model: mass = "circumcenter": ',
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_file_gets_one_message(read, example, name) -> None:
    edits, message = BAD[name]
    check(read, edited(example, edits), message)


@pytest.mark.parametrize("name", BAD_SHORT)
def test_a_bad_short_file_gets_one_message(read, short, name) -> None:
    edits, message = BAD_SHORT[name]
    check(read, edited(short, edits), message)


def test_missing_sections(read, example) -> None:
    check(read, example[example.index("[sheet]") :], "pattern: missing")
    check(read, example[: example.index("[analysis]")], "analysis: missing")
    check(read, "", "sheet: missing")


def test_all_problems_are_told_at_once(read, example) -> None:
    text = example.replace("thickness = 0.01", "thickness = -1").replace(
        "alpha = 0.02", "alpha = nan"
    )
    with pytest.raises(InputError) as caught:
        read(text)
    first, second = str(caught.value).splitlines()
    assert first.endswith("case2.toml: sheet.thickness = -1: must be greater than 0 m")
    assert second == "  also damping.alpha = nan: must be a finite number"


def test_a_bad_csv_file_is_named_with_its_line(read, example, tmp_path) -> None:
    (tmp_path / "pulse.csv").write_text("t [s],f\n0,0\n1,one\n")
    text = example.replace('"pulse", duration = 1.0', '"table", file = "pulse.csv"')
    check(read, text, 'loads[0].history.file = "pulse.csv": ')
    with pytest.raises(InputError, match=r'pulse\.csv: line 3, column "f": "one" is not a number'):
        read(text)


def test_a_misspelled_key_is_told_once(read, example) -> None:
    with pytest.raises(InputError) as caught:
        read(example.replace("thickness =", "thicknes =").replace("[sheet]", "[sheet]\nyuongs = 1"))
    first, second = str(caught.value).splitlines()
    assert "sheet.yuongs: unknown key; known keys: youngs_modulus" in first
    assert second.startswith("  also sheet.thicknes: unknown key; did you mean 'thickness'?")


def test_a_list_of_mass_rules_warns_once(read, example) -> None:
    text = example.replace('"circumcenter"', '["panel", "centroid"]').replace("[6, 7, 8]", "[0, 6]")
    with pytest.warns(FoldynWarning, match=r"loads\[0\].*in part") as record:
        read(text)
    assert len(record) == 1


def test_all_faults_are_told_at_once(read, short) -> None:
    """Of the keys, of the selections, and then of what only the made sheet can refuse."""
    text = short.replace('kind = "miura"', 'kind = "mura"\ncell = [1, 1]').replace("xmin", "xmn")
    with pytest.raises(InputError) as caught:
        read(text)
    kind, key, nodes = str(caught.value).split("\n  also ")
    assert "pattern.kind = \"mura\": did you mean 'miura'?" in kind
    assert key.startswith("pattern.cell: unknown key; did you mean 'cells'?")
    assert nodes.startswith('supports[0].nodes = "xmn": xmn is not known; use xmin')
    arguments = 'kind = "miura"\ndihedral = "flat"\nb = "wide"\na = "long"'
    with pytest.raises(InputError) as caught:
        read(short.replace('kind = "miura"', arguments))
    keys = [line.split(" = ")[0] for line in str(caught.value).split("\n  also ")]
    assert [key.split(".")[-1] for key in keys] == ["a", "b", "dihedral"]  # as declared
    text = short.replace('nodes = "xmin"', "nodes = [99]").replace("[7, 6]", "[77]")
    with pytest.raises(InputError) as caught:
        read(text)
    held, loaded = str(caught.value).split("\n  also ")
    assert "supports[0].nodes = [99]: node 99 is out of range" in held
    assert loaded.startswith("loads[0].nodes = [77]: node 77 is out of range")
