"""Frequency responses estimated from simulated motions: those of the matrices, if it is linear."""

from __future__ import annotations

import importlib
from itertools import product

import numpy as np
import pytest
from frf_structures import chain, chain_modes, chain_response, largest_error, miura_case

import foldyn as fd
from foldyn.checks import observed_order
from foldyn.errors import FoldynWarning, InputError
from foldyn.linear import frf, peaks_of
from pairwise import beyond

F = np.arange(0.25, 4.01, 0.25)
PUSH = fd.Force([1], (1e-6, 0, 0))  # N: the motion is small against the bars
DAMPING = {"alpha": 1.0, "beta": 2e-3}
TIMED = {
    "impulse": {"duration": 30.0},
    "burst_random": {"duration": 40.0, "averages": 2},
    "stepped_sine": {"settled": 1e-5},
}


def error_of(method, case=None, **options) -> float:
    found = frf(case or chain(**DAMPING), PUSH, frequencies=F, method=method, **options)
    exact = chain_response(F, **DAMPING)[:, :, 0]
    return largest_error(found.receptance.values[:, 1:, 0], exact)


@pytest.mark.matrix
def test_simulated_motions_write_no_document_and_discretize_nothing(monkeypatch):
    """The response alone carries the case, whose structure is known to be made again."""
    case, calls = miura_case(alpha=2.0), []

    def spied(of, name):
        return lambda *given: calls.append(name) or of(*given)

    for module, name in (
        ("foldyn.structures.discretize", "n5b8"), ("foldyn.results.dataset", "to_document")
    ):  # fmt: skip
        home = importlib.import_module(module)
        monkeypatch.setattr(home, name, spied(getattr(home, name), name))
    found = frf(case, LIFT, frequencies=[1.0, 2.0], method="stepped_sine", settled=0.5)
    assert calls == ["to_document"] and found.attrs["rerunnable"] == 1


# ------------------------------------------------------------------------ linear structures
@pytest.mark.parametrize(
    ("method", "integrator"),
    [*product(TIMED, ["dormand_prince"]), *beyond(product(TIMED, ["rk4"]), 2)],
)
def test_the_response_of_the_matrices(method, integrator):
    """Alpha and beta both; at the default step, half the critical one, and at a smaller one."""
    assert error_of(method, integrator=integrator, **TIMED[method]) < 5e-4
    if integrator == "rk4":
        assert error_of(method, dt=0.005, **TIMED[method]) < 3e-5


@pytest.mark.matrix
@pytest.mark.parametrize("method", ["impulse", "burst_random"])
def test_the_error_falls_with_the_sampling(method):
    """With the fourth power: the drive is the cubic spline through its samples."""
    intervals = np.array([1 / 20, 1 / 40, 1 / 80])
    options = TIMED[method] | ({"pulse": 0.25} if method == "impulse" else {})
    errors = [error_of(method, interval=h, dt=0.002, **options) for h in intervals]
    assert errors[0] < 3e-3
    assert observed_order(intervals, errors) == pytest.approx(4.0, abs=0.5)


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")  # of the motion much is left
def test_the_error_falls_with_the_duration_and_with_the_steadiness():
    """As the motion does, exp(-z w t) for the slower mode."""
    frequency, ratio = chain_modes(**DAMPING)
    durations = np.array([8.0, 12.0, 16.0, 20.0])
    errors = [error_of("impulse", duration=duration, dt=0.002) for duration in durations]
    rate = -np.polyfit(durations, np.log(errors), 1)[0]
    assert rate == pytest.approx((2 * np.pi * ratio * frequency).min(), rel=0.1)
    for settled in (1e-2, 1e-4):
        assert error_of("stepped_sine", settled=settled, dt=0.004) < 2.0 * settled


LIFT = fd.Force([7], (1e-6, 0, 0))


@pytest.mark.matrix
def test_a_miura_cell():
    case, f = miura_case(alpha=2.0), np.arange(0.2, 4.01, 0.2)
    exact = frf(case, LIFT, frequencies=f).receptance.values
    impulse = frf(case, LIFT, frequencies=f, method="impulse")
    assert largest_error(impulse.receptance.values, exact) < 2e-4
    assert impulse.attrs["left_at_end"] < 1e-4
    other = frf(case, fd.Force([6], (0, 1e-6, 0)), frequencies=f, method="impulse").receptance[
        :, 7, 0
    ]
    assert largest_error(impulse.receptance[:, 6, 1], other) < 1e-5  # reciprocity
    sines = frf(case, LIFT, frequencies=f[::5], method="stepped_sine", settled=1e-4)
    assert largest_error(sines.receptance.values, exact[::5]) < 1e-3
    assert (sines.unsteadiness <= 1e-4).all()


@pytest.mark.matrix
def test_bursts_are_coherent_and_repeatable():
    case, drive = chain(**DAMPING), PUSH
    options = {"averages": 3, "duration": 30.0, "estimator": "h2"}
    one, same, other = (
        frf(case, drive, frequencies=F, method="burst_random", seed=s, **options) for s in (1, 1, 2)
    )
    np.testing.assert_array_equal(one.receptance, same.receptance)
    assert not np.array_equal(one.receptance, other.receptance)
    assert one.coherence.values[:, 1:, 0].min() > 1 - 1e-6
    assert one.attrs["estimator"] == "h2"
    assert (one.attrs["seed"], one.attrs["averages"]) == (1, 3)
    assert not one.receptance.values[:, 0].any()


# ------------------------------------------------------------------------ windows
def test_an_exponential_window_and_its_correction():
    """A lightly damped motion, cut off: the windowed response is that at s = i w + rate."""
    damping, rate, f = {"alpha": 0.1, "beta": 1e-3}, 1.0, np.arange(0.05, 4.501, 0.05)
    found = frf(
        chain(**damping),
        PUSH,
        frequencies=f,
        method="impulse",
        window_rate=rate,
        duration=20.0,
        dt=0.005,
    )
    exact = chain_response(f, rate=rate, **damping)[:, :, 0]
    assert largest_error(found.receptance.values[:, 1:, 0], exact) < 1e-4
    assert found.attrs["window_rate"] == rate
    frequency, ratio = chain_modes(**damping)
    for node in (1, 2):
        peaks = peaks_of(found, node, axis="x")
        np.testing.assert_allclose([p.natural_frequency for p in peaks], frequency, rtol=1e-4)
        np.testing.assert_allclose([p.damping_ratio for p in peaks], ratio, rtol=0.01)


def test_half_power_points_without_the_window():
    single = {"stiffness": (100.0,), "masses": (0.5,), "alpha": 0.4}
    options = {"method": "impulse", "window_rate": 1.0, "duration": 20.0, "dt": 0.01}
    found = frf(chain(**single), PUSH, frequencies=np.arange(0.05, 4.501, 0.05), **options)
    (peak,) = peaks_of(found, 1, axis="x")
    assert peak.half_power == pytest.approx(chain_modes(**single)[1][0], rel=1e-3)
    assert peak.textbook > 2 * peak.half_power


def test_a_motion_that_has_not_died_away_or_settled_is_told():
    with pytest.warns(FoldynWarning, match=r"of the motion is left.*window_rate = \d"):
        found = frf(chain(alpha=0.1), PUSH, frequencies=F, method="impulse", duration=10.0)
    assert found.attrs["left_at_end"] > 0.3
    with pytest.warns(FoldynWarning, match="has not settled after 40 cycles at 1.4 Hz"):
        found = frf(
            chain(alpha=0.02), PUSH, frequencies=[1.4], method="stepped_sine", most_cycles=40
        )
    assert found.unsteadiness.values[0] > 1e-3


# ------------------------------------------------------------------------ base motion
@pytest.mark.parametrize("method", beyond(TIMED, 2))
def test_transmissibility_from_motions(method):
    case, base = chain(**DAMPING), fd.BaseMotion("x", value=1e-6)
    exact = frf(case, base, frequencies=F).transmissibility.values
    found = frf(case, base, frequencies=F, method=method, dt=0.005, **TIMED[method])
    assert largest_error(found.transmissibility.values, exact) < 3e-5


@pytest.mark.matrix
@pytest.mark.parametrize("mass", ["circumcenter", "consistent"])
def test_transmissibility_of_a_miura_cell(mass):
    case, f = miura_case(mass=mass, alpha=2.0, beta=1e-3), np.arange(0.25, 3.01, 0.25)
    base = fd.BaseMotion("z", value=1e-6)
    exact = frf(case, base, frequencies=f).transmissibility.values
    found = frf(case, base, frequencies=f, method="impulse", duration=8.0)
    assert largest_error(found.transmissibility.values, exact) < 2e-3


# ------------------------------------------------------------------------ states
STATES = np.arange(0.5, 3.01, 0.5)  # Hz


def struck(case, **given):
    """Response of the matrices about a state, which a struck structure has, too."""
    given = {"state": "equilibrium", **given}
    direct, found = (
        frf(case, LIFT, frequencies=STATES, method=m, **given) for m in ("direct", "impulse")
    )
    assert largest_error(found.receptance, direct.receptance.values) < 5e-4
    np.testing.assert_array_equal(found.displacement, direct.displacement)
    return direct


def test_a_preloaded_state():
    """Loads hold the structure where it is; the drive moves it about there."""
    direct = struck(miura_case([fd.Gravity((0, 0, -1.0))], alpha=4.0))
    assert np.abs(direct.displacement).max() > 0.01
    at_rest = frf(miura_case(alpha=4.0), LIFT, frequencies=STATES)
    assert largest_error(at_rest.receptance, direct.receptance.values) > 0.02


@pytest.mark.matrix
def test_folds_turned_part_of_the_way():
    """A state on the way of an actuation, with the load factor there."""
    case = miura_case([fd.Actuate("all", angle=100)], alpha=4.0)
    path = fd.trace(case, method="displacement", load_factors=[0.0, 0.5])
    struck(case, state=fd.initial_state(path), load_factor=0.5)


@pytest.mark.matrix
def test_damping_of_the_state():
    """K0 in the state about which it moves, also where steps of a sine start elsewhere."""
    loaded = miura_case([fd.Force([7], (0.004, 0, 0))])
    case = loaded.altered(damping=fd.Rayleigh(2.0, 1e-3, state="initial"))
    direct = struck(case)
    at_rest = loaded.altered(damping=fd.Rayleigh(2.0, 1e-3))
    other = frf(at_rest, LIFT, frequencies=STATES, state="equilibrium")
    assert largest_error(other.receptance, direct.receptance.values) > 0.02
    steps = frf(case, LIFT, frequencies=STATES, state="equilibrium", method="stepped_sine")
    assert largest_error(steps.receptance, direct.receptance.values) < 3e-3


def test_imposed_nodes_stay_where_the_state_puts_them():
    loaded = miura_case(alpha=4.0)
    case = loaded.altered(supports=[*loaded.supports, fd.Impose([8], "x", 0.05)])
    place = struck(case).displacement.sel(node=8, axis="x")
    assert float(place) == pytest.approx(0.05)


# ------------------------------------------------------------------------ progress, refusals
@pytest.mark.parametrize("method", ["direct", *beyond(TIMED, 1)])
def test_progress(method):
    told = []
    frf(
        chain(**DAMPING),
        PUSH,
        frequencies=F,
        method=method,
        progress=told.append,
        **TIMED.get(method, {}),
    )
    parts = [now.time / now.duration for now in told]
    assert parts[-1] == pytest.approx(1.0, abs=0.7 if method == "stepped_sine" else 1e-6)
    assert max(parts) <= 1 + 1e-9
    assert (np.diff([now.time for now in told]) > -1e-9).all()


@pytest.mark.parametrize(
    ("method", "change", "message"),
    [
        ("impulse", {"interval": 0.1}, "interval = 0.1 s: 4 Hz has only 2.5 samples"),
        ("burst_random", {"interval": 0.1}, "interval = 0.1 s: 4 Hz has only 2.5 samples"),
        ("impulse", {"frequencies": [0.5, 0.5 + 0.5 / np.pi]}, "multiples of one spacing"),
        ("impulse", {"frequencies": [0.0]}, "0 Hz alone"),
        ("stepped_sine", {"frequencies": [0.0, 1.0]}, "cannot give 0 Hz"),
        ("burst_random", {"frequencies": [0.0, 1.0]}, "cannot give 0 Hz"),
        ("impulse", {"pulse": 1.0}, "pulse = 1 s: has no strength left at 4 Hz"),
        ("impulse", {"pulse": 0.3, "duration": 0.2}, "does not end within"),
        ("impulse", {"pulse": 0.01, "interval": 0.01}, "has only 1 samples"),
        ("impulse", {"secant": 1.0}, "takes the laws as they are"),
        ("impulse", {"integrator": "euler"}, "integrator"),
        ("impulse", {"dt": -1.0}, "dt"),
        (
            "impulse",
            {"frequencies": [0.1, 0.2], "dt": 0.2, "interval": 0.5},
            "above the critical step",
        ),
        ("impulse", {"averages": 4}, "no option of the method impulse"),
        ("burst_random", {"averages": 1}, "averages = 1"),
        ("burst_random", {"burst": 1.0}, "burst = 1.0"),
        ("burst_random", {"duration": 0.5}, "burst"),
        ("burst_random", {"seed": -1}, "seed"),
        ("burst_random", {"estimator": "h3"}, "estimator"),
        ("stepped_sine", {"cycles": 1}, "cycles = 1"),
        ("stepped_sine", {"most_cycles": 5}, "most_cycles = 5"),
        ("stepped_sine", {"sweep": "sideways"}, "sweep"),
    ],
)
def test_refused_in_time(method, change, message):
    with pytest.raises(InputError, match=message):
        frf(chain(**DAMPING), PUSH, **({"frequencies": F} | change), method=method)


def test_steps_are_shortened_to_divide_the_sampling():
    options = {"duration": 30.0, "interval": 0.0123}
    found = frf(chain(**DAMPING), PUSH, frequencies=F, method="impulse", dt=10.0, **options)
    assert found.attrs["interval"] <= 0.0123
    finer = frf(
        chain(**DAMPING),
        PUSH,
        frequencies=F,
        method="impulse",
        dt=found.attrs["interval"],
        **options,
    )
    np.testing.assert_array_equal(found.receptance, finer.receptance)
