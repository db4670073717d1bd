"""Motions of superelements: superposed modes with exact steps."""

from __future__ import annotations

import math
import re
import tomllib
from dataclasses import replace

import numpy as np
import pytest

import foldyn as fd
from foldyn.cli.main import main
from foldyn.errors import ComputationError, FoldynWarning, InputError, ModelRangeWarning
from foldyn.live.case_session import computed

SHEET = fd.Sheet(3e9, 0.3, 1e-3, density=1000.0, length_scale_ratio=0.5)
PATTERN = fd.patterns.simple_fold(a=0.1, b=0.1, dihedral=120)
HELD = (fd.Fix("xmin"),)
TIP = [4, 5]


def model(level=2, **options):
    return fd.superelements(PATTERN, SHEET, level=level, divisions=16, clamped="xmin", **options)


@pytest.fixture(scope="module")
def first():
    """First frequency, Hz."""
    return float(fd.modes(fd.Case(model(), HELD), 1).frequency[0])


def smooth(duration):
    """A rise from 0 to 1 that begins and ends slowly."""
    return fd.Function(lambda t: 0.5 - 0.5 * math.cos(math.pi * t / duration), at=[])


def amplitude(result, frequency, node, axis="z"):
    """Complex amplitude of the last period of a motion, relative to a sine."""
    period = 1.0 / frequency
    last = result.sel(time=result.time > result.time[-1] - period * (1.0 - 1e-9))
    moved = last.displacement.sel(node=node, axis=axis).values
    return 2.0 * np.mean(moved * np.exp(-2j * np.pi * frequency * last.time.values)) * 1j


DAMPED = {
    "proportional": (fd.Rayleigh(40.0, 1e-5), ()),
    "modal": (fd.ModalDamping(0.05, count=12), ()),
    "creases and a dashpot": (
        [fd.CreaseDamping(2e-4), fd.Rayleigh(30.0)],
        (fd.Dashpot(0.05, [TIP[0]]),),
    ),
}


@pytest.mark.parametrize("kind", DAMPED)
@pytest.mark.parametrize("based", [False, True])
def test_a_motion_settles_to_the_frequency_response(first, kind, based):
    damping, more = DAMPED[kind]
    frequency = 0.8 * first
    history = fd.Harmonic(frequency)
    supports, loads = (*HELD, *more), []
    if based:
        drive = fd.BaseMotion("z", value=1e-6)
        supports = (*supports, fd.BaseMotion("z", history, 1e-6))
    else:
        drive = fd.Force(TIP, (0, 0, 1e-3))
        loads = [fd.Force(TIP, (0, 0, 1e-3), history=history)]
    plain = fd.Case(model(), (*HELD, *more), damping=damping)
    response = fd.frf(plain, drive, frequencies=[frequency])
    name = "transmissibility" if based else "receptance"
    expected = complex(response[name].sel(node=TIP[0], axis="z")[0])
    expected *= 1e-6 if based else response.attrs["drive_force"]
    result = fd.simulate(
        fd.Case(model(), supports, loads, damping), 60 / frequency, interval=1 / (40 * frequency)
    )
    assert abs(amplitude(result, frequency, TIP[0]) / expected - 1.0) < 2e-3
    assert result.attrs["energy_error"] < 1e-7
    assert result.attrs["left_out"] <= 1e-3
    assert float(result.dissipated[-1]) > 0.0


LOADS = {
    "force": fd.Force(TIP, (0, 0, 1e-3)),
    "edges": fd.TotalForce((0, 0, 2e-3), edges="xmax"),
    "pressure": fd.Pressure(0.2),
    "gravity": fd.Gravity((0, 0, -9.81)),
    "temperature": fd.Temperature(20.0, expansion=1e-5, curvature=0.01),
    "actuated": fd.Actuate(0, angle=float(np.degrees(model().fold_rest[0])) + 0.2),
}


@pytest.mark.parametrize("name", LOADS)
def test_slow_loads_end_in_equilibrium(first, name):
    """Displacements, reactions, energies and work are those of statics."""
    load, held = LOADS[name], (*HELD, fd.Spring(0.2, TIP))
    case = fd.Case(model(), held, [load])
    path = fd.trace(case, load_factors=[1.0])
    slow = fd.Case(model(), held, [replace(load, history=smooth(50.0 / first))])
    result = fd.simulate(slow, 50.0 / first, interval=1.0 / first)
    one, other = result.isel(time=-1), path.isel(step=-1)
    largest = float(np.abs(other.displacement).max())
    np.testing.assert_allclose(one.displacement, other.displacement, atol=3e-3 * largest)
    np.testing.assert_allclose(
        one.reaction, other.reaction, atol=1e-6 + 5e-3 * float(np.abs(other.reaction).max())
    )
    scale = float(sum(other[group] for group in case.energy_groups))
    for group in case.energy_groups:
        assert float(one[group]) == pytest.approx(float(other[group]), abs=0.01 * scale)
    assert float(one.work) == pytest.approx(scale, rel=0.01)
    assert result.attrs["energy_error"] < 1e-8


def test_supports_that_move_slowly_end_in_equilibrium(first):
    push = fd.Impose([TIP[0]], "z", 1e-4)
    path = fd.trace(fd.Case(model(), (*HELD, push)), "displacement", steps=1)
    moving = fd.Impose([TIP[0]], "z", 1e-4, history=smooth(50.0 / first))
    result = fd.simulate(fd.Case(model(), (*HELD, moving)), 50.0 / first, interval=1.0 / first)
    one, other = result.isel(time=-1), path.isel(step=-1)
    np.testing.assert_allclose(one.displacement, other.displacement, atol=3e-7)
    np.testing.assert_allclose(
        one.reaction, other.reaction, atol=0.01 * float(np.abs(other.reaction).max())
    )
    assert float(one.work) == pytest.approx(float(other.strain_panels + other.strain_folds), 0.01)


def test_steps_are_exact_whatever_the_samples():
    """A load that sets in between two samples acts as one that sets in at a sample, but later."""

    def moved(history, interval):
        case = fd.Case(model(1), HELD, [fd.Force(TIP, (0, 0, 1e-3), history=history)])
        result = fd.simulate(case, 0.02, interval=interval, tolerance=1e-12)
        return result.displacement.values

    late, early = moved(fd.Step(1.5e-3), 1e-3), moved(fd.Constant(), 5e-4)
    np.testing.assert_allclose(late[:2], 0.0, atol=0.0)
    np.testing.assert_allclose(late[2:], early[1 : 2 * len(late) - 4 : 2], atol=1e-12)


def test_a_jump_that_rounding_keeps_from_a_sample():
    """0.3 is less than 3 x 0.1: the step between them would be too short for accelerations."""
    supports = (*HELD, fd.BaseMotion("z", fd.Harmonic(10.0), 1e-5))
    step = fd.Force(TIP, (0, 0, 1e-3), history=fd.Step(0.3))
    case = fd.Case(model(1), supports, [step], fd.Rayleigh(20.0, 1e-5))
    fine, coarse = (fd.simulate(case, 0.3, interval=each) for each in (0.1, 0.3))
    for name in ("velocity", "reaction"):
        one, other = (result[name].values[-1] for result in (fine, coarse))
        np.testing.assert_allclose(one, other, atol=1e-3 * np.abs(other).max())
    assert float(np.abs(fine.reaction[-1]).max()) < 0.1


@pytest.mark.parametrize("time", [0.003, 0.0032])
def test_energies_balance_as_temperature_jumps(time):
    heat = fd.Temperature(1.0, expansion=1e-5, curvature=0.003, history=fd.Step(time))
    case = fd.Case(model(1), (*HELD, fd.Fix([TIP[0]], "x")), [heat])
    result = fd.simulate(case, 0.01, interval=1e-3)
    assert float(result.work[-1]) > 0.0
    assert result.attrs["energy_error"] < 1e-8


def test_springs_between_nodes_are_linear():
    """Their energy is that of small elongations, also where nodes move across the spring."""
    case = fd.Case(
        model(1), (*HELD, fd.Spring(20.0, between=[(0, TIP[0])])), [fd.Force(TIP, (0, 0, 1e-2))]
    )
    assert fd.simulate(case, 0.05, interval=1e-3).attrs["energy_error"] < 1e-9


def test_supports_start_suddenly_on_a_sheet_at_rest():
    """A ramp at the start does what a ramp later does."""
    late = fd.Table([0.004, 0.008], [0.0, 1.0])
    early, later = (
        fd.simulate(
            fd.Case(model(1), (*HELD, fd.BaseMotion("z", history, 1e-5))), end, interval=1e-3
        ).displacement.values
        for history, end in ((fd.Ramp(0.004), 0.01), (late, 0.014))
    )
    np.testing.assert_allclose(later[4:], early, atol=1e-8 * np.abs(early).max())


def test_a_free_sheet_flies_on():
    velocity = np.tile([0.3, -0.2, 0.5], (6, 1))
    free = fd.Case(fd.superelements(PATTERN, SHEET, level=1, divisions=16))
    result = fd.simulate(free, 1000.0, interval=100.0, initial=fd.State(velocity=velocity))
    expected = result.time.values[:, None, None] * velocity
    np.testing.assert_allclose(result.displacement, expected, atol=1e-6 * np.abs(expected).max())


@pytest.mark.matrix
def test_steps_are_short_during_a_pulse_only():
    """As in a motion with more samples during the pulse, and another one after it."""
    hit = fd.Force(TIP, (0, 0, 1e-3), history=fd.HalfSine(4e-4))
    case = fd.Case(model(1), HELD, [hit], fd.Rayleigh(10.0))
    whole = fd.simulate(case, 1.0, interval=1e-2, tolerance=1e-12)
    begun = fd.simulate(case, 1e-2, interval=1e-4, tolerance=1e-12)
    rest = fd.simulate(
        case, 0.99, interval=1e-2, start=1e-2, tolerance=1e-12, initial=fd.initial_state(begun)
    )
    assert whole.attrs["steps"] < 99 + 4096 + 1 and rest.attrs["steps"] == 99
    largest = float(np.abs(whole.displacement).max())
    np.testing.assert_allclose(rest.displacement, whole.displacement[1:], atol=1e-4 * largest)


def test_what_short_steps_miss_is_warned_of():
    case = fd.Case(model(1), HELD, [fd.Force(TIP, (0, 0, 1e-3), history=fd.HalfSine(1e-7))])
    with pytest.warns(FoldynWarning, match="do not resolve the history half_sine of a load"):
        fd.simulate(case, 1e-3, interval=1e-3)


def test_a_motion_that_goes_on_from_its_middle_is_warned_of():
    result = fd.simulate(fd.Case(model(1), HELD, [LOADS["gravity"]]), 0.01, interval=1e-3)
    with pytest.warns(FoldynWarning, match="at = 5: a motion of superelements keeps the vibr"):
        assert fd.initial_state(result, 5).continuation is None


def test_functions_that_fail_stop_the_motion():
    case = fd.Case(model(1), HELD, [LOADS["force"]])
    with pytest.raises(ComputationError, match=r"sample.late, at t = 0.005 s: the function raised"):
        fd.simulate(case, 0.01, interval=1e-3, sample={"late": lambda u, v, t: 1 / (t < 0.0045)})


def test_a_motion_goes_on_from_its_end():
    case = fd.Case(
        model(1), HELD, [fd.Force(TIP, (0, 0, 1e-3), history=fd.HalfSine(0.004))],
        fd.Rayleigh(10.0),
    )  # fmt: skip
    whole = fd.simulate(case, 0.02, interval=1e-4, tolerance=1e-12)
    half = fd.simulate(case, 0.01, interval=1e-4, tolerance=1e-12)
    state = fd.initial_state(half)
    rest = fd.simulate(case, 0.01, interval=1e-4, initial=state, start=0.01, tolerance=1e-12)
    late = whole.displacement.values[100:]
    np.testing.assert_allclose(rest.displacement, late, atol=1e-9 * np.abs(late).max())


def test_a_sheet_that_is_let_go_swings_at_its_frequencies(first):
    """Free, after equilibrium under a tip force: mean place, energy and frequency."""
    path = fd.trace(fd.Case(model(), HELD, [LOADS["force"]]), load_factors=[1.0])
    result = fd.simulate(
        fd.Case(model(), HELD), 20.0 / first, interval=0.02 / first,
        initial=fd.initial_state(path),
    )  # fmt: skip
    np.testing.assert_allclose(
        result.displacement[0], path.displacement[-1], atol=1e-6 * float(path.displacement.max())
    )
    spectrum = np.abs(np.fft.rfft(result.displacement.sel(node=TIP[0], axis="z").values[:-1]))
    assert int(spectrum.argmax()) == 20
    stored = result.strain_panels + result.strain_folds + result.kinetic
    np.testing.assert_allclose(stored, stored[0], rtol=1e-8)


@pytest.mark.matrix
def test_the_motion_of_the_shell():
    """On the same mesh, after a pulse as long as a quarter of the first period."""
    load = fd.Force(TIP, (0, 0, 1e-4), history=fd.HalfSine(0.03))
    mesh = {"divisions": 8, "clamped": "xmin", "vertex_radius": 1e-3}
    shell = fd.shell(PATTERN, SHEET, mass="consistent", **mesh)
    panels = fd.superelements(PATTERN, SHEET, level=3, **mesh)
    one, other = (
        fd.simulate(fd.Case(made, HELD, [load]), 0.06, interval=1e-3) for made in (shell, panels)
    )
    assert (one.attrs["method"], other.attrs["method"]) == ("generalized_alpha", "modal")
    theirs, ours = (each.displacement.sel(node=TIP[0], axis="z").values for each in (one, other))
    assert np.abs(ours - theirs).max() < 1e-3 * np.abs(theirs).max()


CASE = """
[pattern]
kind = "simple_fold"
a = 0.1
b = 0.1
dihedral = 120
[sheet]
youngs_modulus = 3e9
poissons_ratio = 0.3
thickness = 1e-3
density = 1000
[model]
kind = "superelements"
level = 1
divisions = 8
[[supports]]
nodes = "xmin"
axes = "xyz"
along = true
[[loads]]
nodes = "xmax"
force = [0, 0, 1e-4]
history = { kind = "half_sine", duration = 0.01 }
[analysis]
kind = "dynamics"
duration = 0.05
"""


def test_a_case_file(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "fold.toml").write_text(CASE)
    main(["run", "fold.toml", "--no-figures"])
    assert "64 modes (half of them change displacements by" in capsys.readouterr().out
    result = fd.load(tmp_path / "fold-results" / "result.nc")
    assert result.attrs["method"] == "modal" and len(result.time) == 2001
    again = fd.simulate(fd.case_of(result), 0.05, interval=0.05 / 2000)
    np.testing.assert_allclose(again.displacement, result.displacement, atol=1e-12)


@pytest.mark.matrix
def test_the_viewer_computes_motions(tmp_path):
    """Of a file of motions, and of one of modes with loads, whose motion lasts ten periods."""
    steady = CASE.replace('history = { kind = "half_sine", duration = 0.01 }', "")
    modes = f'{steady.split("[analysis]")[0]}[analysis]\nkind = "modes"\n'
    for text, samples in ((CASE, 2001), (modes, 251)):
        _, result = computed(tmp_path / "fold.toml", tomllib.loads(text), "dynamics")
        assert result.attrs["method"] == "modal" and len(result.time) == samples


def test_large_turns_are_warned_of():
    case = fd.Case(model(), HELD, [fd.Force(TIP, (0, 0, 0.5))])
    with pytest.warns(ModelRangeWarning, match=r"panels turn by .* degrees at t = .* are linear"):
        fd.simulate(case, 0.02, interval=1e-3)


@pytest.mark.parametrize(
    ("change", "options", "told"),
    [
        ({"air": fd.Air(added_mass=False)}, {}, "air.drag: grows with the square"),
        ({}, {"dt": 1e-4}, "dt = 0.0001: motions of superelements superpose modes"),
        ({}, {"method": "rk4"}, "method = 'rk4': motions of superelements superpose modes"),
        ({}, {"device": "gpu"}, "device = 'gpu': motions of superelements"),
        ({}, {"every_steps": 2}, "every_steps = 2: motions of superelements"),
        ({}, {"spectral_radius": 0.0}, "spectral_radius = 0.0: motions of superelements"),
        ({}, {"interval": 0.0}, "interval = 0.0: must be greater than 0"),
        ({}, {"start": 1e12}, "start = 1e+12 s: steps of 5e-06 s are lost in its rounding"),
        (
            {"supports": (*HELD, fd.Impose(TIP, "z", 1e-4))},
            {},
            "supports: node 4 is imposed 0.0001 m along z at the start, but stands at 0 m",
        ),
        ({"structure": model(fold_law=fd.Prony([0.5], [0.1]))}, {}, "fold_law: prony has memory"),
    ],
)
def test_refused(change, options, told):
    case = fd.Case(**{"structure": model(), "supports": HELD, **change})
    with pytest.raises(InputError, match=re.escape(told)):
        fd.simulate(case, 0.01, **options)


def test_bars_and_hinges_do_not_superpose_modes():
    case = fd.Case(fd.discretize(PATTERN, SHEET), HELD)
    with pytest.raises(InputError, match="method = 'modal': superposes modes of linear models"):
        fd.simulate(case, 0.01, method="modal")


def test_other_analyses_of_motions_refuse_superelements():
    case = fd.Case(model(), HELD)
    with pytest.raises(InputError, match="superelements"):
        fd.simulate_many([case, case], 0.01)
    assert math.isinf(fd.simulate(case, 0.01, interval=1e-3).attrs["critical_step"])
