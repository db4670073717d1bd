"""The automatic choice between explicit and implicit integration."""

from __future__ import annotations

import numpy as np
import pytest
from moving_sheets import CELL_HELD, case2, cell
from oscillators import MASS, linear_law, oscillator, pulled, released

import foldyn as fd
from foldyn.dynamics import METHODS, prepare
from foldyn.dynamics.method_choice import frequency, vibrating_share
from foldyn.errors import FoldynWarning, MotionInterrupted
from foldyn.studies import find_case


def chosen(case: fd.Case, duration: float, **options) -> tuple[str, str]:
    motion = prepare(case, duration, "auto", **options)
    return motion.method.name, motion.reason


def test_a_small_sheet_in_a_short_motion_is_explicit():
    """Case study 2: 26,000 steps of a few microseconds each."""
    case = fd.read_case(find_case("herkal/case2")).case("circumcenter")
    name, reason = chosen(case, 10.0, interval=0.01)
    assert name == "rk4"
    assert reason.startswith("explicit: about 26,000 explicit steps (critical step 0.00076 s)")


def test_an_impact_is_explicit():
    """A blow that is over before the slow vibrations begin: steps must be short anyway."""
    case = fd.read_case(find_case("herkal/specimen")).case()
    supports = [support for support in case.supports if isinstance(support, fd.Fix)]
    blow = fd.Force([3], (0.5, 0.0, 0.0), fd.HalfSine(1e-4))
    assert chosen(fd.Case(case.structure, supports, [blow]), 2e-3)[0] == "rk4"
    v = np.zeros(case.structure.nodes.shape)
    v[3, 0] = 5.0  # one node alone: its bars vibrate
    kicked = fd.Case(case.structure, supports, damping=fd.Rayleigh(1.0))
    assert chosen(kicked, 0.1, initial=fd.State(velocity=v))[0] == "dormand_prince"


KICK = fd.State(velocity=np.outer(np.arange(13) == 7, [1.0, 0.0, 0.0]))
DAMPED = fd.Rayleigh(0.1)


def test_velocities_that_shake_the_bars_get_steps_that_resolve_them():
    """RK4 takes the energy out of vibrations near its critical step, whatever damps the sheet."""
    case = fd.Case(cell(), CELL_HELD, damping=DAMPED)
    motion = fd.simulate(case, 0.2, method="auto", initial=KICK, interval=0.01)
    assert motion.attrs["method"] == "dormand_prince"
    assert motion.attrs["energy_error"] < 2e-3
    assert "% of the initial kinetic energy is in vibrations" in motion.attrs["method_reason"]
    with pytest.warns(FoldynWarning, match="the energy balance of the motion is off"):
        damped = fd.simulate(case, 0.2, method="rk4", initial=KICK, interval=0.01)
    assert damped.attrs["energy_error"] > 0.1
    thick = cell(preset="plate")
    slow = fd.modes(fd.Case(thick, CELL_HELD), 1).shape[0].values
    smooth = fd.State(velocity=1e-3 * slow / np.abs(slow).max())
    assert chosen(fd.Case(thick, CELL_HELD, damping=DAMPED), 0.2, initial=smooth)[0] == "rk4"


@pytest.fixture
def given(tmp_path) -> dict:
    """A motion that is kept, and starts as the choice does not see: with stretched bars."""
    start = {"initial": fd.State(0.01 * KICK.velocity), "interval": 0.01}
    case = fd.Case(cell(), CELL_HELD, damping=DAMPED)
    return {"case": case, "duration": 0.2, "store": tmp_path / "run.nc", "checkpoint": 1e-9} | start


def anew(motion, given) -> None:
    """Hold a motion to one that was computed by the method of the second attempt."""
    assert motion.attrs["method"] == "dormand_prince"
    plain = {name: given[name] for name in ("case", "duration", "initial", "interval")}
    alone = fd.simulate(**plain, method="dormand_prince")
    assert np.array_equal(motion.displacement, alone.displacement)


@pytest.mark.matrix
def test_a_motion_whose_energies_do_not_balance_is_computed_anew(given):
    why = 'again with dormand_prince: with rk4.* is off by .* method = "dormand_prince" avoids'
    with pytest.warns(FoldynWarning, match=why):
        motion = fd.simulate(**given, method="auto")
    assert motion.attrs["energy_error"] < 0.01
    assert "computed again: with rk4 the energy" in motion.attrs["method_reason"]
    anew(motion, given)
    read = fd.simulate(**given, method="auto", resume=True)
    assert read.attrs["wall_seconds"] == motion.attrs["wall_seconds"]  # not computed again


@pytest.mark.matrix
def test_a_second_attempt_that_was_cut_off_goes_on(given):
    reached = []

    def stop(now):
        reached.append(now.time)
        if len(reached) > 3 and 0.05 < now.time < 0.2 and min(reached[-3:]) < max(reached):
            raise KeyboardInterrupt

    with pytest.warns(FoldynWarning, match="computed again"), pytest.raises(MotionInterrupted):
        fd.simulate(**given, method="auto", progress=stop)
    anew(fd.simulate(**given, method="auto", resume=True), given)


@pytest.mark.matrix
def test_a_lasting_motion_is_computed_anew_with_shorter_steps():
    """The errors of central differences do not grow; those of other explicit methods add up."""
    case = fd.Case(cell(), CELL_HELD)
    why = "again with steps of .*: with steps of .*; dt = .* avoids"
    with pytest.warns(FoldynWarning, match=why):
        motion = fd.simulate(case, 40.0, method="auto", initial=KICK, interval=0.1)
    assert motion.attrs["method"] == "central_difference"
    assert motion.attrs["energy_error"] < 0.01
    assert motion.sizes["time"] == 401


def test_stiff_damping_is_implicit():
    """With beta the specimen's critical step is below a microsecond."""
    case = fd.read_case(find_case("herkal/specimen-release")).case()
    damped = fd.Case(case.structure, case.supports, case.loads, fd.Rayleigh(14.4, 4.1e-4))
    name, reason = chosen(damped, 1.0, interval=0.01)
    assert name == "generalized_alpha"
    assert "critical step 1.8e-07 s" in reason


@pytest.mark.matrix
def test_a_slow_load_is_implicit():
    """Ten seconds of pushing are half a million explicit steps, and a few hundred implicit ones."""
    case = fd.read_case(find_case("herkal/specimen-release")).case()
    slow = fd.Force(range(7), (0.01, 0.0, 0.0), fd.Ramp(10.0, smooth=True))
    case = fd.Case(case.structure, case.supports, [slow], fd.Rayleigh(15.8))
    assert chosen(case, 10.0)[0] == "generalized_alpha"
    motion = fd.simulate(case, 10.0, method="auto", tolerance=1e-4)
    assert motion.attrs["method"] == "generalized_alpha"
    assert motion.attrs["method_reason"].startswith("implicit: about")
    assert motion.attrs["steps"] < 1000


def test_what_nothing_damps_gets_a_method_that_conserves():
    """A long free vibration: central differences, or energy and momentum for a stiff sheet."""
    v = np.zeros((13, 3))
    v[[6, 7, 8], 0] = 0.01
    state = fd.State(velocity=v)
    assert chosen(fd.Case(cell(), CELL_HELD), 0.01, initial=state)[0] == "dormand_prince"
    assert chosen(fd.Case(cell(), CELL_HELD), 100.0, initial=state)[0] == "central_difference"
    # a thin sheet, whose bars are far stiffer than its folds, let go from a slightly bent shape
    thin = cell(sheet=fd.Sheet(1e9, 0.25, 1e-4, 1e3), bend_law="linear")
    bent = fd.trace(fd.Case(thin, CELL_HELD, [fd.Force([7], (1e-6, 0.0, 0.0))]), steps=1)
    start = fd.initial_state(bent)
    for springs in ([], [fd.Spring(1e-4, between=[(0, 8)])]):
        name, reason = chosen(fd.Case(thin, [*CELL_HELD, *springs]), 100.0, initial=start)
        assert name == "energy_momentum", reason


def test_a_given_step_or_tolerance_decides():
    case = case2(fd.HalfSine(0.5), alpha=0.1)
    critical = fd.critical_step(case)
    assert chosen(case, 1.0, dt=0.5 * critical) == (
        "rk4",
        f"explicit: dt is within the critical step of {critical:.2g} s",
    )
    name, reason = chosen(case, 1.0, dt=5.0 * critical)
    assert name == "generalized_alpha"
    assert "above the critical step" in reason
    assert chosen(case, 1.0, tolerance=1e-8)[0] == "dormand_prince"


def test_nodes_without_mass_are_implicit():
    case = oscillator(linear_law(), 8.0)
    structure = fd.Structure(
        case.structure.nodes, case.structure.bars, case.structure.bar_area, case.structure.sheet,
        case.structure.options, node_mass=np.array([1.0, 0.0]),
    )  # fmt: skip
    name, reason = chosen(fd.Case(structure, case.supports), 1.0)
    assert METHODS[name].implicit
    assert "without mass" in reason


def test_frequency_of_an_oscillator():
    """By the force that pushes it and by the state from which it is let go."""
    omega, still = 4.0, np.zeros((2, 3))
    case = oscillator(linear_law(), MASS * omega**2)
    let_go, flung = released(0.01).displacement, released(0.0, 0.1).velocity
    assert frequency(pulled(case, 0.1), still, still, 100.0) == pytest.approx(omega, rel=1e-2)
    assert frequency(case, let_go, still, 100.0) == pytest.approx(omega, rel=1e-2)
    assert frequency(case, still, flung, 100.0) == pytest.approx(omega, rel=1e-9)
    turning = fd.Case(cell())
    spin = np.cross([0.0, 0.0, 3.0], turning.structure.nodes)
    found = frequency(turning, np.zeros_like(spin), spin, 10.0)
    assert found == pytest.approx(3.0, rel=1e-6)


def test_what_varies_slowly_vibrates_little():
    rest, still = np.zeros((13, 3)), np.zeros((13, 3))
    omega = 5.0  # a period of 1.3 s

    def share(history, start=0.0):
        return vibrating_share(case2(history), rest, still, start, 100.0, omega)

    assert share(fd.Step(1.0)) == 1.0
    assert share(fd.Pulse(2.0)) == 1.0
    assert share(fd.Constant()) == 1.0  # there from the beginning
    assert share(fd.Harmonic(0.8)) > 0.5
    assert share(fd.Ramp(90.0, smooth=True)) < 2e-3
    assert share(fd.Ramp(90.0, smooth=True)) < share(fd.Ramp(90.0)) < 0.02
    moving = still.copy()
    moving[7, 0] = 1.0
    assert vibrating_share(case2(fd.Ramp(90.0)), rest, moving, 0.0, 100.0, omega) == 1.0
