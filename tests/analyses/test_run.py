"""`CaseFile.run`: every key of the file counts, and arguments take the place of the file's."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from case_texts import HELD_FOLD_TEXT as FOLD
from foldyn.errors import FoldynWarning, InputError

PUSH = "[[loads]]\nnodes = [0, 1]\nforce = [-1e-3, 0, 0]\n"
MOTION = '[analysis]\nkind = "dynamics"\nduration = 0.02\n'


def test_a_motion_starts_as_the_file_says(read) -> None:
    free = FOLD.split("[[supports]]")[0] + "[initial]\nvelocity = [0, 0, 1]\nspin = [1, 0, 0]\n"
    case_file = read(free + MOTION)
    found = case_file.run()
    given = case_file.initial().velocity
    assert np.ptp(given[:, 2]) > 0.1
    np.testing.assert_array_equal(found.velocity.isel(time=0), given)


@pytest.mark.matrix
def test_settings_of_a_path_count(read) -> None:
    """A largest turn that is smaller gives more points."""
    text = FOLD + PUSH + '[analysis]\nkind = "statics"\nmethod = "arc_length"\n'
    text += "load_factors = [0, 1]\n"
    counts = [read(f"{text}largest_turn = {turn}\n").run().sizes["step"] for turn in (0.02, 5.0)]
    assert counts[0] > counts[1]
    never = {"node": 0, "axis": "x", "displacement": -1.0}
    with pytest.warns(FoldynWarning, match="has not reached `until`"):
        finer = read(text).run(largest_turn=0.02, until=never)
    assert finer.sizes["step"] == counts[0]
    assert finer.attrs["status"] == "until not reached"


@pytest.mark.matrix
def test_each_mass_rule_and_other_arguments(read) -> None:
    model = '[model]\npreset = "plate"\nmass = ["panel", "centroid"]\n'
    case_file = read(FOLD + PUSH + MOTION + model)
    motions = {mass: case_file.run(mass, duration=0.01) for mass in case_file.masses}
    first = case_file.run(duration=0.01)
    np.testing.assert_array_equal(first.displacement, motions["panel"].displacement)
    assert not np.array_equal(first.displacement[-1], motions["centroid"].displacement[-1])
    assert float(first.time[-1]) == pytest.approx(0.01)
    direct = fd.simulate(
        case_file.case("panel"),
        0.01,
        method="rk4",
        interval=case_file.analysis.arguments["interval"],
    )
    np.testing.assert_array_equal(first.displacement, direct.displacement)


def test_modes_and_responses(read) -> None:
    modes = read(FOLD + '[analysis]\nkind = "modes"\ncount = 3\nsecant = 1.0\n').run(count=2)
    assert modes.sizes["mode"] == 2 and modes.attrs["secant"] == 1.0
    drive = "[[drive]]\nnodes = [0, 1]\nforce = [1e-3, 0, 0]\n"
    text = FOLD + drive + '[analysis]\nkind = "frf"\nfrequencies = [1.0, 2.0]\nsecant = 1.0\n'
    assert read(text).run(frequencies=[3.0]).frequency.values.tolist() == [3.0]


def test_what_cannot_be_run(read) -> None:
    case_file = read(FOLD + PUSH + MOTION)
    for changes, message in (
        ({"nonsense": 1}, 'run: argument = "nonsense": choose one of duration, method'),
        ({"dt": -1}, r"case2\.toml: analysis\.dt = -1: must be greater than 0"),
        ({"interval": 3.0}, r"case2\.toml: output\.interval = 3 s: longer than the duration"),
    ):
        with pytest.raises(InputError, match=message) as caught:
            case_file.run(**changes)
    assert (caught.value.field, caught.value.file) == ("output.interval", case_file.path)
    with pytest.raises(InputError, match='mass = "pannel": did you mean'):
        case_file.run("pannel")
