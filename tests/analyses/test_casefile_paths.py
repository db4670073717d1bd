"""Case files of paths: what a good one gives, and the one message that a bad one gets."""

from __future__ import annotations

import numpy as np
import pytest
from casefile_checks import check

import foldyn as fd
from case_texts import HELD_MIURA_TEXT, changed, rows
from foldyn.cases import Fix, Force, Gravity, Impose
from foldyn.cases.reached import ReachedDisplacement
from foldyn.errors import InputError
from foldyn.statics import Settings
from foldyn.structures import PRESETS

PATH = f"""{HELD_MIURA_TEXT.replace("density = 1.0", "")}[[loads]]
nodes = [7, 6]
force = [1, 0, 0]
[analysis]
kind = "statics"
"""
MOVED = 'supports[1] = { nodes = [8], axis = "z", displacement = -0.1 }'
EVERYTHING = """
method = "arc_length"
load_factors = [0, 0.5]
steps = 30
first_step = 0.01
constant = [1]
until = { node = 7, axis = "x", displacement = 0.02 }
inertia_relief = false
tolerance = 1e-10
largest_turn = 3
stability = false
[output]
nodes = [7]
axis = "-x"
shapes = [0, 5, -1]
animation = "mp4"
[[loads]]
gravity = [0, 0, -9.81]
"""


def test_what_is_left_out_has_its_default(read) -> None:
    found = read(PATH)  # without density
    assert found.analysis.kind == "statics"
    none = dict.fromkeys(("load_factors", "steps", "duration", "first_step", "until"))
    given = {"method": "newton", "constant": (), "inertia_relief": False, "settings": Settings()}
    assert found.analysis.arguments == given | none
    output = found.output
    np.testing.assert_array_equal(output.nodes, [6, 7])  # the loaded ones
    assert (output.axis, output.shapes, output.animation) == (None, 4, None)
    assert output.max_frequency is None
    assert found.masses == [PRESETS["n5b8e"].mass]
    assert found.case().loads == (Force([7, 6], (1, 0, 0)),)
    assert found.initial() is None


def test_everything_that_can_be_said(read) -> None:
    found = read(PATH.replace("= 0.01\n", "= 0.01\ndensity = 1.0\n") + EVERYTHING)
    given = {"method": "arc_length", "load_factors": [0.0, 0.5], "steps": 30, "first_step": 0.01}
    given |= {"duration": None, "constant": (1,), "inertia_relief": False}
    given["until"] = ReachedDisplacement(node=7, axis="x", displacement=0.02)
    given["settings"] = Settings(tolerance=1e-10, largest_turn=3.0, stability=False)
    assert found.analysis.arguments == given
    assert found.output.shapes == (0, 5, -1)
    assert (found.output.axis, found.output.animation) == ("-x", "mp4")
    assert found.case().loads[1] == Gravity((0, 0, -9.81))


def test_gravity_by_its_name_and_one_mass_rule(read) -> None:
    text = PATH.replace("= 0.01\n", '= 0.01\ndensity = 1.0\n[model]\nmass = "panel"\n')
    found = read(text + 'constant = "gravity"\n[[loads]]\ngravity = [0, 0, -9.81]\n')
    assert found.masses == ["panel"]
    assert found.analysis.arguments["constant"] == "gravity"


def test_moved_supports_are_shown_where_nothing_is_loaded(read) -> None:
    found = read(changed(PATH, f"loads =; {MOVED}"))
    assert found.case().supports == (Fix("xmin"), Impose([8], "z", -0.1))
    np.testing.assert_array_equal(found.output.nodes, [8])
    np.testing.assert_array_equal(read(changed(PATH, MOVED)).output.nodes, [6, 7])


@pytest.mark.matrix
def test_a_path_starts_from_a_stored_state(read, tmp_path) -> None:
    found = read(PATH + '[initial]\nfile = "first.nc"\nat = 1\n')
    with pytest.raises(InputError, match=r'initial\.file = "first\.nc": .*no such file'):
        found.initial()
    first = read(PATH).run(load_factors=[0.0, 1e-5, 2e-5])
    fd.save(first, tmp_path / "first.nc")
    np.testing.assert_array_equal(found.initial().displacement, first.displacement.values[1])
    assert found.start().load_factor == 1e-5


# edits of the text, and how the message begins
BAD = """
analysis.method = "newtn": did you mean 'newton'? choose one of newton, displacement
analysis.method = "rk4": choose one of newton, displacement, mgdcm, arc_length
analysis.load_factor = [1] | analysis.load_factor: unknown key; did you mean 'load_factors'? known
    keys: kind, method
analysis.dt = 1.0 | analysis.dt: only for analysis.kind = "dynamics" or "frf"; leave it out
output = { interval = 0.1 } | output.interval: only for analysis.kind = "dynamics"; leave it out
initial = { velocity = [0, 0, 1] } | initial.velocity: only for analysis.kind = "dynamics"; leave
    it out
initial = {} | initial.file: missing
analysis.load_factors = "all": must be a list of numbers, as in [0, 0.5, 1]
analysis.load_factors = [0, nan] | analysis.load_factors[1] = nan: must be a finite number
analysis.load_factors = []: must be a list of numbers
analysis.steps = 0: must be at least 1
analysis.steps = 2.5: must be a whole number
analysis.first_step = "small": must be a number
analysis.constant = "weight": give "gravity", or numbers of [[loads]], as in [0]
analysis.constant = [0.5]: 0.5 is not a load number
analysis.tolerance = 0.1: must be at most 0.01
analysis.stability = 1: must be true or false
analysis.until = 0.1: must be a table
analysis.until = { nodes = 7, axis = "x", displacement = 0.1 } | analysis.until.nodes: unknown
    key; did you mean 'node'? known keys: node, axis, displ
analysis.until = { node = 99, axis = "x", displacement = 0.1 } | analysis.until.node = 99: node
    99 is out of range; this structure has nodes 0 to 12
analysis.until = { node = 7, axis = "-x", displacement = 0.1 } | analysis.until.axis = "-x": must
    be one of "x", "y" and "z"
analysis.until = { node = 7, axis = "x", displacement = 0 } | analysis.until.displacement = 0:
    is the value at rest; give another
loads[0].history = { kind = "step" }: a path has no time; leave it out: what loads and
supports[0] = { nodes = [0], axis = "x", displacement = 1, history = { kind = "step" } } |
    supports[0].history = { kind = "step" }: a path has no time; leave it out
supports[1] = { base = "x" } | supports[1].base = "x": a base moves over time, and a path has no
    time; give nodes, axis
model.mass = ["panel", "centroid"]: a path is computed once; give one rule, or none
model.mass = "centroids": did you mean 'centroid'?
loads[0] = { gravity = [0, 0, -9.81] } | loads[0]: gravity needs the mass of the structure:
supports[1] = { nodes = [0], axis = "x", displacement = 0.1 } | supports[1]: node 0 is held and
    imposed along x, a contradictory support; leave out one
output.axis = "+x": did you mean 'x'? choose one of x, y, z, -x, -y, -z
output.shapes = 0: give 1 to 12 shapes, or a list of point numbers
output.shapes = "all": "all" is not a point number
"""


@pytest.mark.parametrize(("edits", "message"), rows(BAD))
def test_a_bad_file_gets_one_message(read, edits, message) -> None:
    check(read, changed(PATH, edits), message)


def test_keys_of_a_path_in_a_motion_are_told_as_such(read, short) -> None:
    shaped = '"statics", "modes" or "buckling"'
    for key, kinds in (("output.shapes", shaped), ("analysis.steps", '"statics"')):
        text = changed(short, f"{key} = 3")
        check(read, text, f"{key}: only for analysis.kind = {kinds}; leave it out")


def test_a_file_that_does_not_say_its_kind(read) -> None:
    with pytest.raises(InputError) as caught:
        read(changed(PATH, "analysis.kind =; analysis.load_factors = [1]; output.shapes = 3"))
    (line,) = str(caught.value).splitlines()  # what depends on the kind is not complained about
    known = "dynamics, statics, modes, frf, response, bands, effective, fidelity, buckling, random"
    assert line.endswith(f"analysis.kind: missing; choose one of {known}")
