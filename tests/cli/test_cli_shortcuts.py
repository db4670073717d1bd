"""`foldyn modes`, `frf` and `bands`: case files of any kind, with what the command line adds."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import foldyn as fd
from case_texts import MODES_TEXT, changed
from foldyn.analyses.reading import read_as
from foldyn.cases import Fix, Force, Gravity, Impose
from foldyn.cli.main import main
from foldyn.errors import FoldynWarning, InputError

GRID = {"first": 0.0, "last": 3.0, "count": 31}
FEW = "--frequencies 0 3 4"
STATICS = 'output =; loads[0].history =; analysis = { kind = "statics" }'
GRAVITY = "loads[1] = { gravity = [0, 0, -9.81] }"
STEP = '{ kind = "step" }'
MOVED = f'{{ nodes = [8], axis = "z", displacement = 0.1, history = {STEP} }}'
BASE = f'supports[1] = {{ base = "x", history = {STEP} }}'


@pytest.fixture
def read(tmp_path):
    """Function that reads a text as a case file of another kind."""

    def read_text(text: str, kind: str, **flags):
        path = tmp_path / "case.toml"
        path.write_text(text)
        return read_as(path, kind, flags)

    return read_text


@pytest.mark.matrix
def test_the_modes_of_a_motion(workplace, miura) -> None:
    again = ("--no-figures", "--count", "3", "--secant", "2", "--out", "pulse")
    workplace.write(miura)
    workplace.good("modes", "case.toml", *again)  # a pulse does not act at rest anyway
    workplace.write(re.sub("history = .*", "", miura))
    done = workplace.call("modes", "case.toml", "--no-figures", "--count", "3", "--secant", "2")
    assert done.status == 0
    (line,) = done.err.splitlines()
    assert line == (
        "foldyn: warning: case.toml: foldyn modes leaves out loads[0]: nothing acts or moves in "
        "the state of rest (--state equilibrium takes the equilibrium under the loads) "
        "(docs/command-line.md#modes-frequency-responses-and-bands)"
    )
    # a folder of its own: the motion's may be there already
    assert done.new == ["case-modes", "case-modes/result.nc"]
    stored = fd.load("case-modes/result.nc")
    expected = fd.linear.modes(fd.case_of(stored), count=3, secant=2.0)
    np.testing.assert_allclose(stored["frequency"], expected["frequency"], rtol=1e-12)


def test_the_response_of_a_motion_to_its_forces(workplace, miura) -> None:
    workplace.write(miura)
    grid = ("--secant", "2", "--frequencies", "0", "3", "31")
    done = workplace.good("frf", "case.toml", "--no-figures", *grid)  # nothing is left out
    assert done.new == ["case-frf", "case-frf/result.nc"]
    stored = fd.load("case-frf/result.nc")
    np.testing.assert_allclose(stored["frequency"], np.linspace(0.0, 3.0, 31))
    assert np.argwhere(stored["drive"].values).tolist() == [[7, 0]]
    assert stored.attrs["drive_force"] == pytest.approx(0.01)


def test_about_the_equilibrium_loads_act(read, miura) -> None:
    text = changed(miura, f"supports[1] = {MOVED}; {GRAVITY}")
    found = read(text, "modes", state="equilibrium")
    given = {"count": 6, "state": "equilibrium", "secant": None, "check_model": True}
    assert found.analysis.arguments == given
    case = found.case()
    assert case.supports == (Fix([0, 1, 2]), Impose([8], "z", 0.1))  # without histories
    assert case.loads == (Force([7], (0.01, 0, 0)), Gravity((0, 0, -9.81)))
    response = read(text, "frf", state="equilibrium", frequencies=GRID)
    assert response.case().loads == case.loads  # the forces are preloads and the drive
    assert response.analysis.arguments["drive"] == [Force([7], (0.01, 0, 0))]


def test_at_rest_moved_nodes_are_held(read, miura) -> None:
    text = changed(miura, f"supports[1] = {MOVED}; {GRAVITY}")
    left = r"leaves out the displacement of supports\[1\], loads\[1\]: nothing acts or moves"
    with pytest.warns(FoldynWarning, match=left):
        found = read(text, "frf", frequencies=GRID)
    assert found.case().supports == (Fix([0, 1, 2]), Fix([8], "z"))
    assert found.case().loads == ()


def test_what_a_motion_starts_with_is_left_out(read, miura) -> None:
    text = changed(miura, "initial.spin = [0, 0, 0]")
    with pytest.warns(FoldynWarning, match=r"leaves out \[initial\]"):
        found = read(text, "modes")
    assert found.initial() is None


def test_a_moving_base_drives_where_no_force_does(read, miura) -> None:
    text = changed(miura, f"loads =; {BASE}")
    for more, value in (("", 1.0), ("supports[1].displacement = -0.02", 0.02)):
        moved = read(changed(text, more), "frf", frequencies=GRID)
        (drive,) = moved.analysis.arguments["drive"]
        assert (drive.axis, drive.value) == ("x", value)
    with pytest.warns(FoldynWarning, match=r"leaves out supports\[1\]"):
        assert read(text, "modes").case().supports == (Fix([0, 1, 2]),)
    with pytest.warns(FoldynWarning, match=r"leaves out supports\[1\]"):
        found = read(changed(miura, BASE), "frf", frequencies=GRID)
    assert found.analysis.arguments["drive"] == [Force([7], (0.01, 0, 0))]


def test_a_path_and_what_its_figures_show(read, miura) -> None:
    text = changed(miura, f'{STATICS}; output = {{ nodes = [7, 8], axis = "-x", shapes = 3 }}')
    found = read(text, "frf", frequencies=GRID)
    assert found.output.nodes.tolist() == [7, 8]
    assert found.output.axis == "-x"  # a response has directions, too
    with pytest.warns(FoldynWarning, match="leaves out"):
        modes = read(text, "modes")
    # they would mean something else there
    assert (modes.output.axis, modes.output.named, modes.output.shapes) == (None, False, 6)


def test_flags_stand_above_what_the_file_says(read, tmp_path) -> None:
    modes = changed(MODES_TEXT, "analysis.secant = 1.0; analysis.count = 3")
    given = {"count": 3, "state": None, "secant": 1.0, "check_model": True}
    assert read(modes, "modes").analysis.arguments == given
    assert read(modes, "modes", count=5).analysis.arguments["count"] == 5
    stored = modes + '[initial]\nfile = "a.nc"\n'
    assert read(stored, "modes", state="rest").initial() is None
    with pytest.raises(InputError, match=r"initial\.file = .*b\.nc.*no such file"):
        read(stored, "modes", state=str(tmp_path / "b.nc")).initial()
    drive = "drive = [{ nodes = 7, force = [1, 0, 0] }]"  # without frequencies of its own
    response = changed(MODES_TEXT, f'{drive}; analysis = {{ kind = "frf", method = "modal" }}')
    with pytest.raises(InputError, match=r"case\.toml: at which frequencies\?"):
        read(response, "frf")
    found = read(response, "frf", frequencies=GRID, method="direct")
    assert found.analysis.arguments["method"] == "direct"
    assert len(found.analysis.arguments["frequencies"]) == 31


@pytest.mark.matrix
def test_a_state_from_a_result(workplace, miura) -> None:
    workplace.write(changed(miura, STATICS), "slow.toml")
    assert workplace.call("run", "slow.toml", "--no-figures").status == 0
    state = ("--state", "slow-results/result.nc")
    workplace.good("modes", "slow.toml", "--no-figures", "--secant", "1", *state)
    about = fd.load("slow-modes/result.nc")["displacement"]
    path = fd.load("slow-results/result.nc")["displacement"]
    np.testing.assert_array_equal(about.values, path.values[-1])


@pytest.mark.matrix
def test_the_bands_of_the_cell_of_a_motion_and_the_table_of_its_gaps(workplace, miura) -> None:
    workplace.write(changed(miura, 'model = { preset = "plate", mass = "panel" }; damping ='))
    path = ("--path", "X-M-G", "--points", "9", "--count", "5")
    done = workplace.call("bands", "case.toml", "--no-figures", *path)
    assert done.status == 0
    assert "leaves out [[supports]], [[loads]]" in done.err
    assert done.new == ["case-bands", "case-bands/result.nc"]
    assert "panel: 5 bands at 9 wave vectors, 0 full gaps" in done.out
    stored = fd.load("case-bands/result.nc")
    cell = fd.UnitCell(fd.case_of(stored))
    own = fd.bands(cell, cell.path("X-M-G", 9), count=5)
    np.testing.assert_allclose(stored["frequency"], own["frequency"], rtol=1e-9, atol=1e-9)
    workplace.good("convert", "case-bands/result.nc", "gaps.csv", "--rows", "gap")
    rows = Path("gaps.csv").read_text().splitlines()
    assert "gap_bottom [Hz]" in rows[0]
    assert len(rows) - 1 == len(fd.linear.band_gaps(own)["gap"])


@pytest.mark.parametrize(
    ("arguments", "edits", "message"),
    [
        ("bands --path G-Q", "", 'analysis.path = "G-Q": "Q" is no point'),
        ("bands --points 1", "", "analysis.points = 1: must be a whole number, at least 5"),
        ("frf", "", "at which frequencies? Give --frequencies FIRST LAST COUNT"),
        ("modes --count 0", "", "analysis.count = 0: must be at least 1"),
        (f"frf {FEW} --method drect", "", "analysis.method = \"drect\": did you mean 'direct'?"),
        (
            f"frf {FEW}.5",
            "",
            "analysis.frequencies.count = 4.5: must be a whole number, at least 2",
        ),
        ("modes --state none.nc", "", "initial.file = "),
        (
            f"frf {FEW}",
            "loads =",
            "nothing drives a frequency response: the file has neither forces nor a base that",
        ),
        # a file that is wrong in its own terms
        ("modes", "analysis.durations = 0.1", "analysis.durations: unknown key; did you mean 'dur"),
        ("modes", f"{STATICS}; sheet.density =", "sheet.density: missing; modes need it (kg/m3)"),
    ],
)
def test_bad_input_gets_one_message(workplace, miura, arguments, edits, message) -> None:
    command, *flags = arguments.split()
    workplace.write(changed(miura, edits))
    assert workplace.refused(command, "case.toml", *flags).startswith(f"case.toml: {message}")


def test_a_file_that_is_no_case_file(read) -> None:
    for text in ("analysis = 3", "", "[analysis]\nkind = 3", "supports = 3\n[analysis]"):
        with pytest.raises(InputError, match=r"case\.toml: "):
            read(text, "modes")


@pytest.mark.filterwarnings("ignore:at the load factor:foldyn.errors.FoldynWarning")
def test_the_load_factors_of_a_path_and_of_a_motion(read, miura) -> None:
    """Loads lose their histories; those that are constant on a path stay constant."""
    plate = changed(miura, 'model = { preset = "plate" }')
    of_motion = read(plate, "buckling", count=2)
    case = of_motion.case()
    assert [load.history for load in case.loads] == [fd.Constant()] * len(case.loads)
    found = of_motion.run()
    np.testing.assert_allclose(found.load_factor, fd.buckling(case, 2).load_factor, rtol=1e-9)
    steady = changed(plate, f"{STATICS}; {GRAVITY}; analysis.constant = [1]")
    assert len(read(steady, "buckling").run().attrs["constant"]) == 1


@pytest.mark.filterwarnings("ignore:modes above:foldyn.errors.FoldynWarning")
def test_a_motion_under_noise(workplace, miura) -> None:
    """The density of a base comes from the command line; loads of the motion do not act."""
    workplace.write(changed(miura, 'model = { preset = "plate" }'))
    base = ("--base", "z", "m2/s3", "1:0.5", "40:2", "--base", "x", "g2/Hz", "1:1e-3", "9:1e-3")
    few = ("--count", "12", "--no-figures", "--reactions")
    assert workplace.call("random", "case.toml", *base, *few).status == 0
    stored = fd.load("case-random/result.nc")
    densities = {
        "z": fd.SpectralDensity([1.0, 40.0], [0.5, 2.0], "m2/s3"),
        "x": fd.SpectralDensity([1.0, 9.0], [1e-3, 1e-3], "g2/Hz"),
    }
    expected = fd.random_response(fd.case_of(stored), base=densities, count=12, reactions=True)
    for name in ("displacement_rms", "reaction_rms"):
        np.testing.assert_allclose(stored[name], expected[name], rtol=1e-9)
    assert "von_mises_rms" not in stored


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("", "case.toml: under which noise? Give --base AXIS UNIT F:DENSITY ..."),
        ("--base z", "--base z: write AXIS UNIT F:DENSITY F:DENSITY ..."),
        ("--base z g2/Hz 1:2 3", "--base z g2/Hz 1:2 3: write AXIS UNIT"),
        ("--base z g2/Hz 3:1 2:1", "case.toml: analysis.base.z.frequency[1] = 2.0: must increase"),
        ("--base q g2/Hz 1:1 2:1", 'case.toml: analysis.base = "q": choose one of x, y, z'),
    ],
)
def test_bad_noise_gets_one_message(workplace, miura, words, message) -> None:
    workplace.write(miura)
    assert workplace.refused("random", "case.toml", *words.split()).startswith(message)


@pytest.mark.parametrize("command", ["modes", "frf", "bands"])
def test_help_tells_the_options(capsys, command) -> None:
    with pytest.raises(SystemExit) as left:
        main([command, "--help"])
    assert left.value.code == 0
    told = capsys.readouterr().out
    for option in ("--out", "--no-figures", "--quiet", "--state", "--secant", f"NAME-{command}"):
        assert option in told
