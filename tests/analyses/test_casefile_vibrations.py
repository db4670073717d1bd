"""Case files of modes and frequency responses: what they give, and the messages for bad ones."""

from __future__ import annotations

import numpy as np
import pytest
from casefile_checks import check, edited

from case_texts import HELD_MIURA_TEXT
from foldyn.cases import BaseMotion, Fix, Force, Gravity, Impose
from foldyn.errors import InputError

MODES = (
    HELD_MIURA_TEXT
    + """\
[analysis]
kind = "modes"
"""
)

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
    assert modes.analysis.arguments == {"count": 6, "state": None, "secant": None, "internal": 0}
    assert (modes.output.shapes, modes.output.animation, modes.output.axis) == (6, None, None)
    assert not modes.output.named
    assert modes.initial() is None
    response = read(RESPONSE)
    given = dict(response.analysis.arguments)
    np.testing.assert_array_equal(given.pop("frequencies"), np.linspace(0.0, 5.0, 51))
    assert given == {
        "method": "direct",
        "state": None,
        "secant": None,
        "internal": 0,
        "amplitude": 1.0,
        "drive": [Force([7, 6], (1, 0, 0))],
    }
    assert response.case().loads == ()  # the drive is no preload
    np.testing.assert_array_equal(response.output.nodes, [6, 7])  # the driven ones
    assert response.output.quantity is None


def test_everything_that_can_be_said_of_modes(read) -> None:
    text = MODES + 'count = 12\nstate = "equilibrium"\nsecant = 0.5\n' + PRELOADS
    output = '[output]\nshapes = [1, 3]\naxis = "y"\nnodes = "xmax"\nanimation = "mp4"\n'
    found = read(text + output)
    given = {"count": 12, "state": "equilibrium", "secant": 0.5, "internal": 0}
    assert found.analysis.arguments == given
    assert found.output.shapes == (1, 3)
    assert (found.output.axis, found.output.animation, found.output.named) == ("y", "mp4", True)
    np.testing.assert_array_equal(found.output.nodes, [6, 7, 8])
    assert found.case().supports == (Fix("xmin"), Impose([8], "z", -0.1))
    assert found.case().loads == (Gravity((0, 0, -9.81)),)


@pytest.mark.matrix
def test_internal_amplitudes_belong_to_one_scheme(read) -> None:
    plates = '[model]\npreset = "n5b8e"\n[analysis]'
    found = read(MODES.replace("[analysis]", plates) + "internal = 3\n").run(count=4)
    assert found.attrs["internal"] == 3
    driven = RESPONSE.replace("[analysis]", plates).replace("[[drive]]", "internal = 3\n[[drive]]")
    response = read(driven).run(frequencies=[1.0])
    assert response.attrs["internal"] == 3
    with pytest.raises(InputError, match=r"analysis\.internal = 3: .* the scheme n5b8e"):
        read(MODES + "internal = 3\n").computation()
    with pytest.raises(InputError, match=r"analysis\.internal = 3: .* the scheme n5b8e"):
        read(RESPONSE.replace("[[drive]]", "internal = 3\n[[drive]]")).computation()


def test_everything_that_can_be_said_of_a_response(read) -> None:
    old = "{ first = 0, last = 5, count = 51 }"
    text = edited(
        RESPONSE,
        [(old, '[1, 2.5, 4]\nmethod = "burst_random"\naverages = 3\nseed = 4\namplitude = 0.1')],
    )
    found = read(text + '[output]\naxis = "z"\nquantity = "mobility"\nnodes = 3\n')
    given = dict(found.analysis.arguments)
    np.testing.assert_array_equal(given.pop("frequencies"), [1.0, 2.5, 4.0])
    del given["drive"]
    # of the options of the method those that the file names; the others are left to the method
    assert given == {
        "method": "burst_random",
        "state": None,
        "secant": None,
        "internal": 0,
        "amplitude": 0.1,
        "averages": 3,
        "seed": 4,
    }
    assert (found.output.axis, found.output.quantity) == ("z", "mobility")
    np.testing.assert_array_equal(found.output.nodes, [3])


def test_a_base_drives_and_every_vertex_that_can_move_is_shown(read) -> None:
    drive = "nodes = [7, 6]\nforce = [1, 0, 0]"
    found = read(edited(RESPONSE, [(drive, 'base = "x"\ndisplacement = 1e-3')]))
    assert found.analysis.arguments["drive"] == [BaseMotion("x", value=1e-3)]
    np.testing.assert_array_equal(found.output.nodes, [3, 4, 5, 6, 7, 8])


def test_a_stored_state_and_a_list_of_mass_rules(read, tmp_path) -> None:
    text = MODES.replace("[analysis]", '[model]\nmass = ["panel", "centroid"]\n[analysis]')
    found = read(text + '[initial]\nfile = "pressed.nc"\nat = 3\n' + PRELOADS)
    assert found.masses == ["panel", "centroid"]
    assert found.analysis.arguments["state"] is None
    with pytest.raises(InputError, match=r'initial\.file = "pressed\.nc": .*no such file'):
        found.initial()


AT_REST = 'write state = "equilibrium" under [analysis], or leave it out'

BAD = {
    "unknown key": (
        [('"modes"', '"modes"\ncounts = 3')],
        "analysis.counts: unknown key; did you mean 'count'? known keys: kind, count, state, sec",
    ),
    "count": ([('"modes"', '"modes"\ncount = 0')], "analysis.count = 0: must be at least 1"),
    "half a mode": (
        [('"modes"', '"modes"\ncount = 2.5')],
        "analysis.count = 2.5: must be a whole number",
    ),
    "state": (
        [('"modes"', '"modes"\nstate = "equilibrum"')],
        "analysis.state = \"equilibrum\": did you mean 'equilibrium'? choose one of rest, equil",
    ),
    "secant": ([('"modes"', '"modes"\nsecant = 0')], "analysis.secant = 0: must be greater than 0"),
    "secant all around": (
        [('"modes"', '"modes"\nsecant = 200')],
        "analysis.secant = 200: must be at most 180",
    ),
    "too many amplitudes": (
        [('"modes"', '"modes"\ninternal = 7')],
        "analysis.internal = 7: must be at most 6",
    ),
    "no density": ([("density = 1.0\n", "")], "sheet.density: missing; modes need it (kg/m3)"),
    "key of a motion": (
        [('"modes"', '"modes"\nduration = 1.0')],
        'analysis.duration: only for analysis.kind = "dynamics", "statics" or "frf"; leave it out',
    ),
    "drive": (
        [("[analysis]", "[[drive]]\nnodes = 7\nforce = [1, 0, 0]\n[analysis]")],
        'drive: only for analysis.kind = "frf"; leave it out',
    ),
    "start of a motion": (
        [("[analysis]", "[initial]\nspin = [0, 0, 1]\n[analysis]")],
        'initial.spin: only for analysis.kind = "dynamics"; leave it out',
    ),
    "two states": (
        [('"modes"', '"modes"\nstate = "rest"\n[initial]\nfile = "a.nc"')],
        'analysis.state = "rest": the state is that of initial.file; leave out one of the two',
    ),
    "load at rest": (
        [("[analysis]", "[[loads]]\nnodes = 7\nforce = [1, 0, 0]\n[analysis]")],
        f"loads[0]: does not act in the state of rest; {AT_REST}",
    ),
    "moved support at rest": (
        [("[analysis]", '[[supports]]\nnodes = 7\naxis = "x"\ndisplacement = 1\n[analysis]')],
        f"supports[1]: moves nothing in the state of rest; {AT_REST}, or hold its nodes by axes",
    ),
    "history of a load": (
        [
            (
                "[analysis]",
                '[[loads]]\nnodes = 7\nforce = [1, 0, 0]\nhistory = { kind = "step" }\n[analysis]',
            )
        ],
        'loads[0].history = { kind = "step" }: small vibrations are about one state, in which loa',
    ),
    "base": (
        [("[analysis]", '[[supports]]\nbase = "x"\n[analysis]')],
        'supports[1].base = "x": a base moves over time, and small vibrations are about one state',
    ),
    "no modes shown": (
        [('"modes"', '"modes"\n[output]\nshapes = 0')],
        "output.shapes = 0: give 1 to 12 modes, or a list of mode numbers",
    ),
    "mode 0": (
        [('"modes"', '"modes"\n[output]\nshapes = [0, 1]')],
        "output.shapes = [0, 1]: modes are counted from 1",
    ),
    "modes in words": (
        [('"modes"', '"modes"\n[output]\nshapes = "all"')],
        'output.shapes = "all": "all" is not a mode number',
    ),
    "too many modes": (
        [('"modes"', f'"modes"\n[output]\nshapes = {list(range(1, 14))}')],
        "output.shapes: 13 modes; give at most 12",
    ),
    "direction": (
        [('"modes"', '"modes"\n[output]\naxis = "-x"')],
        "output.axis = \"-x\": did you mean 'x'? choose one of x, y, z",
    ),
    "quantity": (
        [('"modes"', '"modes"\n[output]\nquantity = "mobility"')],
        'output.quantity: only for analysis.kind = "frf"; leave it out',
    ),
    "node": (
        [('"modes"', '"modes"\n[output]\nnodes = 99')],
        "output.nodes = [99]: node 99 is out of range",
    ),
}

KEYS = "{ first = 0, last = 5, count = 51 }"
DRIVE = "nodes = [7, 6]\nforce = [1, 0, 0]"
BAD_RESPONSE = {
    "amplitudes of a method by amplitude": (
        [("[[drive]]", 'method = "harmonic"\ninternal = 3\n[[drive]]')],
        "analysis.internal = 3: the method harmonic goes by the amplitude of the drive, internal",
    ),
    "no frequencies": ([(f"frequencies = {KEYS}\n", "")], "analysis.frequencies: missing; give"),
    "frequencies in words": (
        [(KEYS, '"all"')],
        'analysis.frequencies = "all": must be { first = 1, last = 25, count = 241 }, in Hz, or a',
    ),
    "no frequency": ([(KEYS, "[]")], "analysis.frequencies = []: must be { first = 1"),
    "frequency nan": (
        [(KEYS, "[1, nan]")],
        "analysis.frequencies[1] = nan: must be a finite number",
    ),
    "negative frequency": (
        [(KEYS, "[-1, 1]")],
        "analysis.frequencies[0] = -1: must be at least 0",
    ),
    "frequencies fall": (
        [(KEYS, "[1, 3, 2]")],
        "analysis.frequencies[2] = 2: must be greater than the frequency before it (3)",
    ),
    "range key": (
        [(KEYS, "{ first = 0, last = 5, step = 1 }")],
        "analysis.frequencies.step: unknown key; known keys: first, last, count",
    ),
    "range without count": (
        [(KEYS, "{ first = 0, last = 5 }")],
        "analysis.frequencies.count: missing; give first and last (Hz) and their count",
    ),
    "range backwards": (
        [(KEYS, "{ first = 5, last = 5, count = 2 }")],
        "analysis.frequencies.last = 5: must be greater than 5",
    ),
    "one frequency of a range": (
        [(KEYS, "{ first = 0, last = 5, count = 1 }")],
        "analysis.frequencies.count = 1: must be a whole number, at least 2",
    ),
    "too many frequencies": (
        [(KEYS, "{ first = 0, last = 5, count = 1000000 }")],
        "analysis.frequencies.count = 1000000: must be at most 100000",
    ),
    "method": (
        [('"frf"', '"frf"\nmethod = "impuls"')],
        "analysis.method = \"impuls\": did you mean 'impulse'? choose one of direct, modal, har",
    ),
    "option of another method": (
        [('"frf"', '"frf"\nmethod = "modal"\naverages = 4')],
        'analysis.averages: only for method = "burst_random"; leave it out',
    ),
    "option of other methods": (
        [('"frf"', '"frf"\nduration = 4.0')],
        'analysis.duration: only for method = "impulse" or "burst_random"; leave it out',
    ),
    "secant in time": (
        [('"frf"', '"frf"\nmethod = "impulse"\nsecant = 1')],
        "analysis.secant = 1.0: the method impulse goes by the amplitude of the drive; leave it",
    ),
    "amplitude": (
        [('"frf"', '"frf"\namplitude = 0')],
        "analysis.amplitude = 0: must be greater than 0",
    ),
    "integrator": (
        [('"frf"', '"frf"\nmethod = "impulse"\nintegrator = "rk5"')],
        "analysis.integrator = \"rk5\": did you mean 'rk4'? choose one of rk4",
    ),
    "averages": (
        [('"frf"', '"frf"\nmethod = "burst_random"\naverages = 1')],
        "analysis.averages = 1: must be a whole number, at least 2",
    ),
    "burst": (
        [('"frf"', '"frf"\nmethod = "burst_random"\nburst = 1')],
        "analysis.burst = 1.0: must be a part of the record, between 0 and 1",
    ),
    "estimator": (
        [('"frf"', '"frf"\nmethod = "burst_random"\nestimator = "h3"')],
        'analysis.estimator = "h3": choose one of h1, h2',
    ),
    "sweep": (
        [('"frf"', '"frf"\nmethod = "stepped_sine"\nsweep = "upp"')],
        "analysis.sweep = \"upp\": did you mean 'up'? choose one of up, down",
    ),
    "no drive": ([(f"[[drive]]\n{DRIVE}\n", "")], "drive: missing; give its value"),
    "one table": (
        [("[[drive]]", "[drive]")],
        "drive = { nodes = [7, 6], force = [1, 0, 0] }: must",
    ),
    "empty drive": (
        [(f"[[drive]]\n{DRIVE}\n", ""), ("[pattern]", "drive = []\n[pattern]")],
        "drive = []: must have at least one entry",
    ),
    "drive of nothing": ([(DRIVE, "")], "drive[0]: give nodes and force, or base (the axis of a"),
    "drive without force": ([(DRIVE, "nodes = 7")], "drive[0].force: missing; give its value"),
    "drive without nodes": (
        [(DRIVE, "force = [1, 0, 0]")],
        "drive[0].nodes: missing; give its value",
    ),
    "drive key": (
        [(DRIVE, "node = 7\nforce = [1, 0, 0]")],
        "drive[0].node: unknown key; did you mean 'nodes'? known keys: nodes, force, base, disp",
    ),
    "drive history": (
        [(DRIVE, DRIVE + '\nhistory = { kind = "step" }')],
        'drive[0].history = { kind = "step" }: a drive has an amplitude only, analysis.method says',
    ),
    "drive node": (
        [(DRIVE, "nodes = 99\nforce = [1, 0, 0]")],
        "drive[0].nodes = [99]: node 99 is out of range; this structure has nodes 0 to 12",
    ),
    "base and force": (
        [(DRIVE, DRIVE + '\nbase = "x"')],
        "drive[0].base: moves all nodes that supports hold along its axis; leave out nodes and",
    ),
    "base axis": ([(DRIVE, 'base = "w"')], 'drive[0].base = "w": must be one of "x", "y" and "z"'),
    "displacement of a force": (
        [(DRIVE, DRIVE + "\ndisplacement = 1.0")],
        'drive[0].displacement: is that of a base, as in base = "x"; leave it out, or give base',
    ),
    "base beside a force": (
        [("[[drive]]", '[[drive]]\nbase = "x"\n[[drive]]')],
        "drive[0]: a base drives alone, along one axis; run a case file for each",
    ),
    "quantity of a base": (
        [(DRIVE, 'base = "x"\n[output]\nquantity = "mobility"')],
        'output.quantity = "mobility": a base drives, and what responds to it is shown as transm',
    ),
    "quantity": (
        [(DRIVE, DRIVE + '\n[output]\nquantity = "mobilty"')],
        "output.quantity = \"mobilty\": did you mean 'mobility'? choose one of receptance, mob",
    ),
    "animation": (
        [(DRIVE, DRIVE + '\n[output]\nanimation = "gif"')],
        'output.animation: only for analysis.kind = "dynamics", "statics" or "modes"; leave it',
    ),
    "no density": (
        [("density = 1.0\n", "")],
        "sheet.density: missing; a frequency response needs it (kg/m3)",
    ),
    "load at rest": (
        [("[[drive]]", "[[loads]]\ngravity = [0, 0, -9.81]\n[[drive]]")],
        f"loads[0]: does not act in the state of rest; {AT_REST}",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_file_of_modes_gets_one_message(read, name) -> None:
    edits, message = BAD[name]
    check(read, edited(MODES, edits), message)


@pytest.mark.parametrize("name", BAD_RESPONSE)
def test_a_bad_file_of_a_response_gets_one_message(read, name) -> None:
    edits, message = BAD_RESPONSE[name]
    check(read, edited(RESPONSE, edits), message)


def test_keys_of_vibrations_in_a_motion_are_told_as_such(read, short) -> None:
    check(
        read,
        short.replace("duration = 10", "duration = 10\ncount = 5"),
        'analysis.count: only for analysis.kind = "modes", "frf" or "fidelity"; leave it out',
    )
    drive = "[[drive]]\nnodes = 7\nforce = [1, 0, 0]\n"
    check(read, short + drive, 'drive: only for analysis.kind = "frf"; leave it out')


def test_a_case_file_that_is_wrong_in_two_places(read) -> None:
    with pytest.raises(InputError) as caught:
        read(edited(RESPONSE, [("count = 51", "count = 1"), ("thickness = 0.01", "thickness = 0")]))
    assert len(str(caught.value).splitlines()) == 2
