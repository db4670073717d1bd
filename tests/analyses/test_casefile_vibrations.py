"""Case files of modes and frequency responses: what they give, and the messages for bad ones."""

from __future__ import annotations

import numpy as np
import pytest
from casefile_checks import check

from case_texts import HELD_MIURA_TEXT, PLATE, changed, rows
from foldyn.cases import BaseMotion, Fix, Force, Gravity, Impose
from foldyn.errors import InputError

MODES = f'{HELD_MIURA_TEXT}{PLATE}[analysis]\nkind = "modes"\n'
RESPONSE = (
    MODES.replace("modes", "frf")
    + """frequencies = { first = 0, last = 5, count = 51 }
[[drive]]
nodes = [7, 6]
force = [1, 0, 0]
"""
)
PRELOADS = """
[[supports]]
nodes = [8]
axis = "z"
displacement = -0.1
[[loads]]
gravity = [0, 0, -9.81]
"""


def test_what_is_left_out_has_its_default(read) -> None:
    modes = read(MODES)
    assert modes.analysis.kind == "modes"
    assert modes.analysis.arguments == {
        "count": 6,
        "state": None,
        "secant": None,
        "check_model": True,
    }
    assert (modes.output.shapes, modes.output.animation, modes.output.axis) == (6, None, None)
    assert not modes.output.named
    assert modes.initial() is None
    response = read(RESPONSE)
    given = dict(response.analysis.arguments)
    np.testing.assert_array_equal(given.pop("frequencies"), np.linspace(0.0, 5.0, 51))
    assert given.pop("drive") == [Force([7, 6], (1, 0, 0))]
    none = {"state": None, "secant": None, "check_model": True}
    assert given == {"method": "direct", "amplitude": 1.0, **none}
    assert response.case().loads == ()  # the drive is no preload
    np.testing.assert_array_equal(response.output.nodes, [6, 7])  # the driven ones
    assert response.output.quantity is None


def test_everything_that_can_be_said_of_modes(read) -> None:
    text = MODES + 'count = 12\nstate = "equilibrium"\nsecant = 0.5\n' + PRELOADS
    output = '[output]\nshapes = [1, 3]\naxis = "y"\nnodes = "xmax"\nanimation = "mp4"\n'
    found = read(text + output)
    given = {"count": 12, "state": "equilibrium", "secant": 0.5, "check_model": True}
    assert found.analysis.arguments == given
    assert found.output.shapes == (1, 3)
    assert (found.output.axis, found.output.animation, found.output.named) == ("y", "mp4", True)
    np.testing.assert_array_equal(found.output.nodes, [6, 7, 8])
    assert found.case().supports == (Fix("xmin"), Impose([8], "z", -0.1))
    assert found.case().loads == (Gravity((0, 0, -9.81)),)


def test_everything_that_can_be_said_of_a_response(read) -> None:
    analysis = 'method = "burst_random"\naverages = 3\nseed = 4\namplitude = 0.1\n'
    text = RESPONSE.replace("{ first = 0, last = 5, count = 51 }\n", f"[1, 2.5, 4]\n{analysis}")
    found = read(text + '[output]\naxis = "z"\nquantity = "mobility"\nnodes = 3\n')
    given = dict(found.analysis.arguments)
    np.testing.assert_array_equal(given.pop("frequencies"), [1.0, 2.5, 4.0])
    del given["drive"]
    # of the options of the method those that the file names; the others are left to the method
    none = {"state": None, "secant": None, "check_model": True}
    assert given == {"method": "burst_random", "amplitude": 0.1, "averages": 3, "seed": 4, **none}
    assert (found.output.axis, found.output.quantity) == ("z", "mobility")
    np.testing.assert_array_equal(found.output.nodes, [3])


def test_a_base_drives_and_every_vertex_that_can_move_is_shown(read) -> None:
    found = read(changed(RESPONSE, 'drive[0] = { base = "x", displacement = 1e-3 }'))
    assert found.analysis.arguments["drive"] == [BaseMotion("x", value=1e-3)]
    np.testing.assert_array_equal(found.output.nodes, [3, 4, 5, 6, 7, 8])


def test_a_stored_state_and_a_list_of_mass_rules(read, tmp_path) -> None:
    text = MODES.replace('preset = "plate"', 'mass = ["panel", "centroid"]')
    found = read(text + '[initial]\nfile = "pressed.nc"\nat = 3\n' + PRELOADS)
    assert found.masses == ["panel", "centroid"]
    assert found.analysis.arguments["state"] is None
    with pytest.raises(InputError, match=r'initial\.file = "pressed\.nc": .*no such file'):
        found.initial()


BAD = """
analysis.counts = 3 | analysis.counts: unknown key; did you mean 'count'? known keys: kind, count,
    state, sec
analysis.count = 0: must be at least 1
analysis.state = "equilibrum": did you mean 'equilibrium'? choose one of rest, equil
analysis.secant = 0: must be greater than 0
analysis.secant = 200: must be at most 180
analysis.internal = 3 | analysis.internal: internal amplitudes are no more, as superelements have
    the modes of panels; leave it out, and take model.kind = "superelements"
sheet.density = | sheet.density: missing; modes need it (kg/m3)
analysis.duration = 1.0 | analysis.duration: only for analysis.kind = "dynamics", "statics" or
    "frf"; leave it out
drive = [{ nodes = 7, force = [1, 0, 0] }] | drive: only for analysis.kind = "frf"; leave it out
initial = { spin = [0, 0, 1] } | initial.spin: only for analysis.kind = "dynamics"; leave it out
analysis.state = "rest"; initial = { file = "a.nc" } | analysis.state = "rest": initial.file
    gives the state already; leave out one of the two
loads = [{ nodes = 7, force = [1, 0, 0] }] | loads[0]: does not act in the state of rest; write
    state = "equilibrium" under [analysis], or leave it out
supports[1] = { nodes = 7, axis = "x", displacement = 1 } | supports[1]: moves nothing in the
    state of rest; write state = "equilibrium" under [analysis], or leave it out, or hold its
    nodes by axes
loads = [{ nodes = 7, force = [1, 0, 0], history = { kind = "step" } }] | loads[0].history = {
    kind = "step" }: small vibrations are about one state, in which loa
supports[1] = { base = "x" } | supports[1].base = "x": a base moves over time, and small
    vibrations are about one state
output.shapes = 0: give 1 to 12 modes, or a list of mode numbers
output.shapes = [0, 1]: modes are counted from 1
output = { shapes = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13] } | output.shapes: 13 modes; give
    at most 12
output.axis = "-x": did you mean 'x'? choose one of x, y, z
output = { quantity = "mobility" } | output.quantity: only for analysis.kind = "frf"; leave it out
"""
BAD_RESPONSE = """
analysis.internal = 3 | analysis.internal: internal amplitudes are no more, as superelements have
analysis.frequencies = | analysis.frequencies: missing; give
analysis.frequencies = "all": must be { first = 1, last = 25, count = 241 }, in Hz, or a
analysis.frequencies = []: must be { first = 1
analysis.frequencies = [1, nan] | analysis.frequencies[1] = nan: must be a finite number
analysis.frequencies = [-1, 1] | analysis.frequencies[0] = -1: must be at least 0
analysis.frequencies = [1, 3, 2] | analysis.frequencies[2] = 2.0: must increase, and the one before
    it is 3.0
analysis.frequencies.count =; analysis.frequencies.step = 1 | analysis.frequencies.step: unknown
    key; known keys: first, last, count
analysis.frequencies.count = | analysis.frequencies.count: missing; give first and last (Hz) and
    their count
analysis.frequencies.first = 5; analysis.frequencies.count = 2 | analysis.frequencies.last = 5:
    must be greater than 5
analysis.frequencies.count = 1: must be a whole number, at least 2
analysis.frequencies.count = 1000000: must be at most 100000
analysis.method = "impuls": did you mean 'impulse'? choose one of direct, modal, har
analysis.method = "modal"; analysis.averages = 4 | analysis.averages: only for method =
    "burst_random"; leave it out
analysis.duration = 4.0 | analysis.duration: only for method = "impulse" or "burst_random"; leave
    it out
analysis.method = "impulse"; analysis.secant = 1 | analysis.secant = 1.0: the method impulse takes
    the amplitude of the drive instead; leave it
analysis.amplitude = 0: must be greater than 0
analysis.method = "impulse"; analysis.integrator = "rk5" | analysis.integrator = "rk5": did you
    mean 'rk4'? choose one of rk4
analysis.method = "burst_random"; analysis.averages = 1 | analysis.averages = 1: must be a whole
    number, at least 2
analysis.method = "burst_random"; analysis.burst = 1 | analysis.burst = 1: must be less than 1
analysis.method = "burst_random"; analysis.estimator = "h3" | analysis.estimator = "h3": choose
    one of h1, h2
analysis.method = "stepped_sine"; analysis.sweep = "upp" | analysis.sweep = "upp": did you mean
    'up'? choose one of up, down
drive = | drive: missing; give its value
drive = { nodes = [7, 6], force = [1, 0, 0] }: must
drive = []: must have at least one entry
drive[0].nodes =; drive[0].force = | drive[0]: give nodes and force, or base (the axis of a
drive[0].force =; drive[0].nodes = 7 | drive[0].force: missing; give it (N)
drive[0].nodes = | drive[0].nodes: missing; give its value
drive[0].nodes =; drive[0].node = 7 | drive[0].node: unknown key; did you mean 'nodes'? known
    keys: nodes, force, base, disp
drive[0].history = { kind = "step" }: a drive has an amplitude only, analysis.method says
drive[0].nodes = 99 | drive[0].nodes = [99]: node 99 is out of range; this structure has nodes 0
    to 12
drive[0].base = "x" | drive[0].base: moves all nodes that supports hold along its axis; leave out
    nodes and
drive[0] = { base = "w" } | drive[0].base = "w": must be one of "x", "y" and "z"
drive[0].displacement = 1.0 | drive[0].displacement: moves all nodes that
    supports hold along its axis; leave out nodes
drive[0] = { base = "x" }; drive[1] = { nodes = [7, 6], force = [1, 0, 0] } | drive[0]: a moving
    base must be the only drive; run a case file for each
drive[0] = { base = "x" }; output = { quantity = "mobility" } | output.quantity = "mobility": the
    response to a moving base is always shown as transm
output.quantity = "mobilty": did you mean 'mobility'? choose one of receptance, mob
output = { animation = "gif" } | output.animation: only for analysis.kind = "dynamics", "statics"
    or "modes"; leave it
sheet.density = | sheet.density: missing; a frequency response needs it (kg/m3)
loads = [{ gravity = [0, 0, -9.81] }] | loads[0]: does not act in the state of rest; write state =
    "equilibrium" under [analysis], or leave it out
"""


@pytest.mark.parametrize(("edits", "message"), rows(BAD))
def test_a_bad_file_of_modes_gets_one_message(read, edits, message) -> None:
    check(read, changed(MODES, edits), message)


@pytest.mark.parametrize(("edits", "message"), rows(BAD_RESPONSE))
def test_a_bad_file_of_a_response_gets_one_message(read, edits, message) -> None:
    check(read, changed(RESPONSE, edits), message)


def test_keys_of_vibrations_in_a_motion_are_told_as_such(read, short) -> None:
    kinds = '"modes", "frf", "bands", "fidelity", "buckling" or "random"'
    text = changed(short, "analysis.count = 5")
    check(read, text, f"analysis.count: only for analysis.kind = {kinds}; leave it out")
