"""`foldyn modes` and `foldyn frf`: case files of any kind, with what the command line adds."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.analyses.reading import read_as
from foldyn.cases import Fix, Force, Gravity, Impose
from foldyn.cli.main import main
from foldyn.errors import FoldynWarning, InputError

GRID = {"first": 0.0, "last": 3.0, "count": 31}
STATICS = ('kind = "dynamics"\nduration = 0.1\n[output]\nevery = 0.01', 'kind = "statics"')
HISTORY = 'history = { kind = "half_sine", duration = 0.05 }\n'
GRAVITY = "[[loads]]\ngravity = [0, 0, -9.81]\n[analysis]"
MOVED = '[[supports]]\nnodes = [8]\naxis = "z"\ndisplacement = 0.1\nhistory = { kind = "step" }\n'
BASE = '[[supports]]\nbase = "x"\nhistory = { kind = "step" }\n'


@pytest.fixture
def read(tmp_path):
    """Function that reads a text as a case file of another kind."""

    def read_text(text: str, kind: str, **flags):
        path = tmp_path / "case.toml"
        path.write_text(text)
        return read_as(path, kind, flags)

    return read_text


def test_the_modes_of_a_motion(workplace, miura) -> None:
    workplace.write(miura)
    done = workplace.call("modes", "case.toml", "--no-figures", "--count", "3", "--secant", "2")
    assert done.status == 0
    (line,) = done.err.splitlines()
    assert line == (
        "foldyn: warning: case.toml: foldyn modes leaves out loads[0]: nothing acts or moves in "
        "the state of rest (--state equilibrium takes the equilibrium under the loads)"
    )
    # a folder of its own: the motion's may be there already
    assert done.new == ["case-modes", "case-modes/result.nc"]
    stored = fd.load("case-modes/result.nc")
    expected = fd.linear.modes(fd.case_of(stored), count=3, secant=2.0)
    np.testing.assert_allclose(stored["frequency"], expected["frequency"], rtol=1e-12)


def test_the_response_of_a_motion_to_its_forces(workplace, miura) -> None:
    workplace.write(miura)
    done = workplace.call(
        "frf", "case.toml", "--no-figures", "--secant", "2", "--frequencies", "0", "3", "31"
    )
    assert (done.status, done.err) == (0, "")  # nothing is left out: the force drives
    assert done.new == ["case-frf", "case-frf/result.nc"]
    stored = fd.load("case-frf/result.nc")
    np.testing.assert_allclose(stored["frequency"], np.linspace(0.0, 3.0, 31))
    assert np.argwhere(stored["drive"].values).tolist() == [[7, 0]]
    assert stored.attrs["drive_force"] == pytest.approx(0.01)


def test_about_the_equilibrium_loads_act(read, miura) -> None:
    text = miura.replace("[[loads]]", MOVED + "[[loads]]").replace("[analysis]", GRAVITY)
    found = read(text, "modes", state="equilibrium")
    given = {"count": 6, "state": "equilibrium", "secant": None, "internal": 0}
    assert found.analysis.arguments == given
    case = found.case()
    assert case.supports == (Fix([0, 1, 2]), Impose([8], "z", 0.1))  # without histories
    assert case.loads == (Force([7], (0.01, 0, 0)), Gravity((0, 0, -9.81)))
    response = read(text, "frf", state="equilibrium", frequencies=GRID)
    assert response.case().loads == case.loads  # the forces are preloads and the drive
    assert response.analysis.arguments["drive"] == [Force([7], (0.01, 0, 0))]


def test_at_rest_moved_nodes_are_held(read, miura) -> None:
    text = miura.replace("[[loads]]", MOVED + "[[loads]]").replace("[analysis]", GRAVITY)
    left = r"leaves out the displacement of supports\[1\], loads\[1\]: nothing acts or moves"
    with pytest.warns(FoldynWarning, match=left):
        found = read(text, "frf", frequencies=GRID)
    assert found.case().supports == (Fix([0, 1, 2]), Fix([8], "z"))
    assert found.case().loads == ()


def test_what_a_motion_starts_with_is_left_out(read, miura) -> None:
    text = miura.replace("[analysis]", "[initial]\nspin = [0, 0, 0]\n[analysis]")
    with pytest.warns(FoldynWarning, match=r"leaves out loads\[0\], \[initial\]"):
        found = read(text, "modes")
    assert found.initial() is None


def test_a_moving_base_drives_where_no_force_does(read, miura) -> None:
    text = miura.replace("[[loads]]\nnodes = [7]\nforce = [0.01, 0, 0]\n" + HISTORY, BASE)
    for displacement, value in (("", 1.0), ("displacement = -0.02\n", 0.02)):
        moved = text.replace('base = "x"\n', f'base = "x"\n{displacement}')
        (drive,) = read(moved, "frf", frequencies=GRID).analysis.arguments["drive"]
        assert (drive.axis, drive.value) == ("x", value)
    with pytest.warns(FoldynWarning, match=r"leaves out supports\[1\]"):
        assert read(text, "modes").case().supports == (Fix([0, 1, 2]),)
    both = miura.replace("[[loads]]", BASE + "[[loads]]")
    with pytest.warns(FoldynWarning, match=r"leaves out supports\[1\]"):
        found = read(both, "frf", frequencies=GRID)
    assert found.analysis.arguments["drive"] == [Force([7], (0.01, 0, 0))]


def test_a_path_and_what_its_figures_show(read, edited) -> None:
    text = edited(STATICS, (HISTORY, "")) + '[output]\nnodes = [7, 8]\naxis = "-x"\nshapes = 3\n'
    found = read(text, "frf", frequencies=GRID)
    assert found.output.nodes.tolist() == [7, 8]
    assert found.output.axis == "-x"  # a response has directions, too
    with pytest.warns(FoldynWarning, match="leaves out"):
        modes = read(text, "modes")
    # they would mean something else there
    assert (modes.output.axis, modes.output.named, modes.output.shapes) == (None, False, 6)


OWN = """
[pattern]
kind = "miura"
dihedral = 60
[sheet]
youngs_modulus = 1e6
poissons_ratio = 0.25
thickness = 0.01
density = 1.0
[[supports]]
nodes = "xmin"
[analysis]
"""


def test_flags_stand_above_what_the_file_says(read, tmp_path) -> None:
    modes = OWN + 'kind = "modes"\ncount = 3\nsecant = 1.0\ninternal = 2\n'
    given = {"count": 3, "state": None, "secant": 1.0, "internal": 2}
    assert read(modes, "modes").analysis.arguments == given
    assert read(modes, "modes", count=5).analysis.arguments["count"] == 5
    assert read(modes, "modes", internal=3).analysis.arguments["internal"] == 3
    stored = modes + '[initial]\nfile = "a.nc"\n'
    assert read(stored, "modes", state="rest").initial() is None
    with pytest.raises(InputError, match=r"initial\.file = .*b\.nc.*no such file"):
        read(stored, "modes", state=str(tmp_path / "b.nc")).initial()
    drive = "[[drive]]\nnodes = 7\nforce = [1, 0, 0]\n"
    response = OWN + 'kind = "frf"\nmethod = "modal"\n' + drive  # without frequencies of its own
    with pytest.raises(InputError, match=r"case\.toml: at which frequencies\?"):
        read(response, "frf")
    found = read(response, "frf", frequencies=GRID, method="direct")
    assert found.analysis.arguments["method"] == "direct"
    assert len(found.analysis.arguments["frequencies"]) == 31


def test_a_state_from_a_result(workplace, edited) -> None:
    text = edited(STATICS, (HISTORY, ""))
    workplace.write(text, "slow.toml")
    assert workplace.call("run", "slow.toml", "--no-figures").status == 0
    state = ("--state", "slow-results/result.nc")
    done = workplace.call("modes", "slow.toml", "--no-figures", "--secant", "1", *state)
    assert (done.status, done.err) == (0, "")
    about = fd.load("slow-modes/result.nc")["displacement"]
    path = fd.load("slow-results/result.nc")["displacement"]
    np.testing.assert_array_equal(about.values, path.values[-1])


BAD = {
    "no frequencies": (("frf",), [], "at which frequencies? Give --frequencies FIRST LAST COUNT"),
    "count": (("modes", "--count", "0"), [], "analysis.count = 0: must be at least 1"),
    "method": (
        ("frf", "--frequencies", "0", "3", "4", "--method", "drect"),
        [],
        "analysis.method = \"drect\": did you mean 'direct'?",
    ),
    "half a frequency": (
        ("frf", "--frequencies", "0", "3", "4.5"),
        [],
        "analysis.frequencies.count = 4.5: must be a whole number, at least 2",
    ),
    "state": (
        ("modes", "--state", "none.nc"),
        [],
        "initial.file = ",
    ),
    "nothing drives": (
        ("frf", "--frequencies", "0", "3", "4"),
        [("[[loads]]\nnodes = [7]\nforce = [0.01, 0, 0]\n" + HISTORY, "")],
        "nothing drives a frequency response: the file has neither forces nor a base that moves",
    ),
    "a file that is wrong in its own terms": (
        ("modes",),
        [("duration = 0.1\n", "durations = 0.1\n")],
        "analysis.durations: unknown key; did you mean 'duration'?",
    ),
    "no density": (
        ("modes",),
        [STATICS, (HISTORY, ""), ("density = 1.0\n", "")],
        "sheet.density: missing; modes need it (kg/m3)",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_gets_one_message_and_nothing_is_written(workplace, edited, name) -> None:
    (command, *flags), edits, message = BAD[name]
    workplace.write(edited(*edits))
    bad = workplace.call(command, "case.toml", *flags)
    assert (bad.status, bad.out, bad.new) == (2, "", [])
    (line,) = bad.err.splitlines()
    assert line.startswith(f"foldyn: case.toml: {message}"), line


def test_a_file_that_is_no_case_file(read, workplace) -> None:
    for text in ("analysis = 3", "", "[analysis]\nkind = 3", "supports = 3\n[analysis]"):
        with pytest.raises(InputError, match=r"case\.toml: "):
            read(text, "modes")


@pytest.mark.parametrize(
    "arguments", [["modes"], ["modes", "a.toml", "--count", "many"], ["frf", "a.toml", "--quick"]]
)
def test_a_wrong_command_line_has_status_2(workplace, arguments) -> None:
    with pytest.raises(SystemExit) as left:
        main(arguments)
    assert left.value.code == 2
    assert "usage: foldyn" in workplace.capsys.readouterr().err


@pytest.mark.parametrize("command", ["modes", "frf"])
def test_help_tells_the_options(capsys, command) -> None:
    with pytest.raises(SystemExit) as left:
        main([command, "--help"])
    assert left.value.code == 0
    told = capsys.readouterr().out
    for option in ("--out", "--no-figures", "--quiet", "--state", "--secant", f"NAME-{command}"):
        assert option in told
