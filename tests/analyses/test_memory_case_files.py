"""Laws with memory in case files, in stored results, and where they cannot go."""

from __future__ import annotations

import json

import numpy as np
import pytest

import foldyn as fd
from case_texts import HELD_FOLD_TEXT
from foldyn.errors import ComputationError, InputError
from foldyn.exports.creased_shell import fold_slopes
from foldyn.viewer.states import fields
from named_models import named

FOLD = f"""{HELD_FOLD_TEXT.replace("= 60", "= 120")}[[loads]]
nodes = [0, 1]
force = [1e-3, 0, 0]
[model]
mass = "panel"
{{law}}
"""
MOTION = '[analysis]\nkind = "dynamics"\nduration = 0.05\nmethod = "rk4"\n'
LAWS = {
    "prony": (
        'fold_law = { kind = "prony", ratios = [0.5, 0.2], times = [0.02, 0.3], '
        'law = { kind = "enhanced", theta1 = 50, theta2 = 310 } }',
        fd.Prony([0.5, 0.2], [0.02, 0.3], fd.EnhancedLinear(50.0, 310.0)),
    ),
    "plastic": (
        'fold_law = { kind = "plastic", yield_moment = 1e-5, kinematic = 1e-3, law = "linear" }',
        fd.Plastic(1e-5, kinematic=1e-3, law="linear"),
    ),
    "eyring": (
        'fold_law = { kind = "eyring", barrier_moment = 1e-5, rate = 1e-3 }',
        fd.Eyring(1e-5, 1e-3),
    ),
}


def written(folder, text):
    path = folder / "case.toml"
    path.write_text(text)
    return path


@pytest.mark.matrix
@pytest.mark.parametrize("name", LAWS)
def test_a_case_file_has_the_law_and_its_result_keeps_it(tmp_path, name):
    """The motion can be computed again from what it carries, to the last bit."""
    text, law = LAWS[name]
    found = fd.read_case(written(tmp_path, FOLD.format(law=text) + MOTION)).run()
    fd.save(found, tmp_path / "found.nc")
    stored = fd.load(tmp_path / "found.nc")
    case = fd.case_of(stored)
    assert case.structure.fold_law == law
    assert stored.memory.dims == ("time", "branch", "variable")
    assert stored.memory[-1].values.any()
    again = fd.simulate(
        case, float(stored.duration), method=stored.method, dt=float(stored.dt),
        every_steps=int(stored.every_steps),
        initial=fd.initial_state(stored, 0),
    )  # fmt: skip
    np.testing.assert_array_equal(again.displacement, stored.displacement)
    np.testing.assert_array_equal(again.memory, stored.memory)


@pytest.mark.matrix
def test_a_motion_starts_from_a_stored_state_and_its_memory(tmp_path):
    text = FOLD.format(law=LAWS["plastic"][0])
    first = fd.read_case(written(tmp_path, text + MOTION)).run()
    fd.save(first, tmp_path / "first.nc")
    text += MOTION + '[initial]\nfile = "first.nc"\n'
    found = fd.read_case(written(tmp_path, text)).run()
    np.testing.assert_array_equal(found.memory[0], first.memory[-1])


@pytest.mark.parametrize(
    ("law", "message"),
    [
        ('fold_law = "prony"', "the law needs ratios and times"),
        ('fold_law = { kind = "prony", times = 1 }', r"model\.fold_law\.ratios: missing"),
        (
            'fold_law = { kind = "prony", ratio = 1, times = 1 }',
            r"model\.fold_law\.ratio: unknown key; did you mean 'ratios'",
        ),
        (
            'fold_law = { kind = "prony", ratios = 1, times = 1, law = { kind = "linea" } }',
            r"model\.fold_law\.law.*linea",
        ),
        ('bend_law = { kind = "prony", ratios = 1, times = 1, law = "superlinear" }', "none there"),
        (
            'scheme = "n5b8e"\nbend_law = { kind = "eyring", barrier_moment = 1, rate = 1 }',
            'needs "linear"',
        ),
    ],
)
def test_faults_are_named(tmp_path, law, message):
    text = FOLD.format(law=law) + MOTION
    if "n5b8e" in law:
        text = text.replace('mass = "panel"', "").replace('"rk4"', '"generalized_alpha"')
    with pytest.raises(InputError, match=message):
        fd.read_case(written(tmp_path, text)).run()


def fold_case(law, **options):
    pattern, sheet = fd.patterns.simple_fold(dihedral=120), fd.Sheet(1e6, 0.25, 0.01, 1.0)
    return fd.Case(
        fd.discretize(pattern, sheet, fold_law=law, mass="panel", **named(options)),
        [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "z")],
        [fd.Force([0, 1], (1e-3, 0, 0))],
    )


@pytest.mark.matrix
@pytest.mark.parametrize("duration", ["0.5", "[0, 0.5, 2]"])
def test_a_path_with_a_time(tmp_path, duration):
    law = 'fold_law = { kind = "eyring", barrier_moment = 2e-4, rate = 1e-4 }'
    path = f'[analysis]\nkind = "statics"\nload_factors = [0, 1, 1, 1]\nduration = {duration}\n'
    found = fd.read_case(written(tmp_path, FOLD.format(law=law) + path)).run()
    fd.save(found, tmp_path / "found.nc")
    stored = fd.load(tmp_path / "found.nc")
    made = fd.trace(
        fold_case(fd.Eyring(2e-4, 1e-4), preset="n5b8e"),
        load_factors=[0, 1, 1, 1],
        duration=json.loads(duration),
    )
    np.testing.assert_array_equal(stored.displacement, made.displacement)
    np.testing.assert_array_equal(stored.elapsed, made.elapsed)
    assert float(stored.dissipated[-1]) > 0.0
    for bad in ('"slow"', "[1, -1, 1]", "-0.5", "true"):
        text = FOLD.format(law=law) + path.replace(f"duration = {duration}", f"duration = {bad}")
        with pytest.raises(InputError, match=r"analysis\.duration"):
            fd.read_case(written(tmp_path, text))


def test_equilibria_of_creases_that_creep_are_refused():
    for solve in (fd.statics.trace, lambda case: fd.modes(case, state="equilibrium")):
        with pytest.raises(InputError, match="fold_law = 'eyring': creep goes on for ever"):
            solve(fold_case(fd.Eyring(1e-3, 1e-3)))


def test_exports_refuse_what_springs_cannot_do():
    with pytest.raises(InputError, match="springs have no memory"):
        fold_slopes(fold_case(fd.Prony(1.0, 1.0)).structure)


@pytest.mark.parametrize("preset", ["herkal", "plate"])
def test_viewers_leave_out_what_angles_do_not_tell(preset):
    """Beside panels that give way even how creases turn."""
    case = fold_case(fd.Prony(1.0, 1.0), preset=preset, bend_law="linear")
    path = fd.statics.trace(case, load_factors=[0.0])
    found = fields(case, path, np.zeros((1, *case.structure.nodes.shape)))
    assert ("turn" in found) == (preset == "herkal")
    assert "fold_moment" not in found


def test_a_mode_that_does_not_swing_any_more_is_an_error():
    """A dashpot a thousand times as strong as what vibrates."""
    made = fold_case(law := fd.Prony(100.0, 0.02, law="linear"))
    # rigid panels: others would swing on creases that hardly turn
    options = {"fold_law": law, "mass": "panel", "rigid": "all"}
    structure = fd.discretize(made.structure.pattern, made.structure.sheet, **named(options))
    case = fd.Case(structure, made.supports)
    with pytest.raises(ComputationError, match="they damp it so strongly that it does not vibrate"):
        fd.modes(case, 1)
