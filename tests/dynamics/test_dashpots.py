"""Dashpots in motions: decay, energy, momenta, moving bases and the critical step."""

from __future__ import annotations

import numpy as np
import pytest
from oscillators import LENGTH, MASS, equal_steps, linear_law, oscillator, released

import foldyn as fd
from foldyn.dynamics import METHODS
from foldyn.dynamics.stability import MARGIN
from foldyn.signals import log_decrement
from foldyn.structures import ModelOptions

OMEGA = 4.0  # rad/s
RATIO = 0.05
C = 2.0 * RATIO * OMEGA * MASS  # N s/m
PERIOD = 2.0 * np.pi / OMEGA


def damped(*dashpots: fd.Dashpot) -> fd.Case:
    """One mass on a linear spring along x, with dashpots."""
    case = oscillator(linear_law(), MASS * OMEGA**2)
    return fd.Case(case.structure, [*case.supports, *dashpots])


def energy_error(motion) -> float:
    energy = motion.kinetic + motion.strain_bars + motion.dissipated - motion.work
    return float(np.abs(energy - energy[0]).max() / max(energy[0], motion.dissipated.max()))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "dashpot",
    [
        fd.Dashpot(C, nodes=[1]),
        fd.Dashpot(C, nodes=[1], direction="-x"),
        fd.Dashpot(C, between=(0, 1)),
        fd.Dashpot(C, between=(1, 0), direction=(2, 0, 0)),
        fd.Dashpot(4.0 * C, nodes=[1], direction=(1, 0, np.sqrt(3.0))),
    ],
    ids=["ground", "along", "axial", "fixed", "oblique"],
)
def test_decay_of_one_mass(dashpot, method):
    """Logarithmic decrement 2 pi z / sqrt(1 - z^2) with z = c / (2 m w) (Thomson, chapter 2)."""
    numeric = {"dt": PERIOD / 400} | equal_steps(method)
    radius = {"spectral_radius": 1.0} if method == "generalized_alpha" else {}
    motion = fd.simulate(
        damped(dashpot), 6 * PERIOD, method, initial=released(1e-3), every=PERIOD / 40,
        **numeric, **radius,
    )  # fmt: skip
    found = log_decrement(motion.displacement[:, 1, 0].values, PERIOD / 40, rest=0.0)
    assert found.decrement == pytest.approx(2 * np.pi * RATIO / np.sqrt(1 - RATIO**2), rel=2e-4)
    assert energy_error(motion) < 1e-4
    assert float(motion.dissipated[-1]) > 0.9 * float(motion.strain_bars[0])


def pair(c: float, direction=None) -> fd.Case:
    """Two free masses on a soft spring with a dashpot between them."""
    structure = fd.Structure(
        nodes=np.array([[0.0, 0, 0], [LENGTH, 0, 0]]),
        bars=np.array([[0, 1]]),
        bar_area=np.array([1e-4]),
        sheet=fd.Sheet(2.0 * LENGTH / 1e-4, 0.3, 0.01),
        options=ModelOptions(bar_law=linear_law()),
        node_mass=np.array([MASS, 2 * MASS]),
    )
    return fd.Case(structure, [fd.Dashpot(c, between=(0, 1), direction=direction)])


@pytest.mark.parametrize("method", METHODS)
def test_a_tumbling_pair_keeps_its_momenta(method):
    """The axial dashpot follows the line between the masses: it damps the stretch, not the turn."""
    case = pair(0.5)
    v = np.array([[0.1, -1.0, 0.3], [0.3, 0.5, -0.2]])
    motion = fd.simulate(
        case, 6.0, method, dt=0.002, initial=fd.State(np.zeros((2, 3)), v), every=0.1,
        **equal_steps(method),
    )  # fmt: skip
    m = np.array([MASS, 2 * MASS])[:, None]
    x = case.structure.nodes + motion.displacement.values
    momentum = (m * motion.velocity.values).sum(axis=1)
    spin = np.cross(x, m * motion.velocity.values).sum(axis=1)
    assert np.abs(momentum - momentum[0]).max() < 1e-12
    assert np.abs(spin - spin[0]).max() < 1e-5
    assert energy_error(motion) < 2e-5
    length = np.linalg.norm(x[:, 1] - x[:, 0], axis=1)
    rate = np.gradient(length, 0.1)
    assert float(motion.dissipated[-1]) > 10 * 1e-3
    assert float(motion.dissipated[-1]) == pytest.approx(
        0.5 * np.trapezoid(rate**2, dx=0.1), rel=0.02
    )


def test_a_pair_that_only_turns_loses_nothing():
    """Without the spring's stretch: circular motion at its stretched length."""
    case = pair(0.5)
    reduced = MASS * 2 * MASS / (3 * MASS)
    stretch = 0.1
    spin = np.sqrt(2.0 * stretch / (reduced * (LENGTH + stretch)))  # k e = mu w^2 l
    u, v = np.zeros((2, 3)), np.zeros((2, 3))
    u[1, 0] = stretch
    arm = (LENGTH + stretch) * np.array([-2 / 3, 1 / 3])
    v[:, 1] = spin * arm
    motion = fd.simulate(case, 20.0, dt=0.02, initial=fd.State(u, v), every=0.5)
    assert float(motion.dissipated[-1]) < 1e-9 * float(motion.kinetic[0])


@pytest.mark.parametrize("method", ["rk4", "newmark", "energy_momentum"])
@pytest.mark.parametrize("ground", [True, False])
def test_a_moving_base(ground, method):
    """A dashpot to the ground drags at the moving mass; one to the base damps its relative motion.

    Steady motion: x / y = (k + i w c') / (k - w^2 m + i w c), c' = 0 or c (Thomson, section 3.5).
    """
    dashpot = fd.Dashpot(C, nodes=[1]) if ground else fd.Dashpot(C, between=(0, 1))
    case = damped(dashpot)
    w = 3.0
    driven = fd.Case(
        case.structure,
        [*case.supports, fd.BaseMotion("x", fd.Harmonic(w / (2 * np.pi)), 1e-3)],
    )
    motion = fd.simulate(driven, 60.0, method, dt=0.01, every=0.05)
    t, x = motion.time.values, motion.displacement[:, 1, 0].values
    late = t > 45.0
    basis = np.stack([np.sin(w * t[late]), np.cos(w * t[late])], axis=1)
    sine, cosine = np.linalg.lstsq(basis, x[late], rcond=None)[0] / 1e-3
    k = MASS * OMEGA**2
    exact = (k + (0 if ground else 1j * w * C)) / (k - w**2 * MASS + 1j * w * C)
    assert sine + 1j * cosine == pytest.approx(exact, rel=2e-3)
    assert energy_error(motion) < 1e-4
    response = fd.frf(case, fd.BaseMotion("x"), [w / (2 * np.pi)])
    assert complex(response.transmissibility[0, 1, 0]) == pytest.approx(exact, rel=1e-9)


@pytest.mark.filterwarnings("ignore:the energy balance", "ignore:the dashpots make")
@pytest.mark.parametrize("method", ["rk4", "central_difference"])
@pytest.mark.parametrize("ratio", [0.5, 3.0, 30.0])
def test_motion_just_below_and_above_the_limit(ratio, method):
    """The step that a strong dashpot allows is stable, and one a little longer is not."""
    case = damped(fd.Dashpot(2.0 * ratio * OMEGA * MASS, nodes=[1]))
    limit = fd.critical_step(case, method) / MARGIN
    assert limit < fd.critical_step(damped(), method) / MARGIN
    amplitude = []
    for dt in (0.98 * limit, 1.05 * limit):
        try:
            motion = fd.simulate(case, 400 * dt, method, dt=dt, initial=released(0.1), force=True)
        except fd.errors.InstabilityError:
            amplitude.append(np.inf)
        else:
            amplitude.append(float(abs(motion.displacement[-50:]).max()))
    assert amplitude[0] <= 0.6
    if ratio > 1.0:  # else the bound of the damping at lower frequencies counts
        assert amplitude[1] > 10.0 * amplitude[0]


@pytest.mark.filterwarnings("ignore:the energy balance")  # of vibrations that no step resolves
@pytest.mark.parametrize("method", ["rk4", "central_difference"])
def test_a_sheet_with_strong_dampers_stays_stable(method):
    """The bound for damping that no mode is proportional to holds for a whole structure."""
    s = fd.discretize(
        fd.patterns.miura(), fd.Sheet(1e6, 0.25, 0.01, 1.0), bend_law="linear", fold_law="linear"
    )
    dashpots = [fd.Dashpot(5.0, nodes=[8]), fd.Dashpot(2.0, between=[(1, 7), (3, 5)])]
    case = fd.Case(s, [fd.Fix("xmin"), *dashpots], damping=fd.CreaseDamping(1e-3))
    plain = fd.critical_step(fd.Case(s, [fd.Fix("xmin")]), method)
    step = fd.critical_step(case, method)
    assert step < plain
    v = np.zeros_like(s.nodes)
    v[3:] = 1e-3 * np.random.default_rng(1).standard_normal((len(s.nodes) - 3, 3))
    motion = fd.simulate(case, 3000 * step, method, dt=step, initial=fd.State(0 * v, v), every=50)
    kinetic = motion.kinetic.values
    assert kinetic[-1] < 0.1 * kinetic[0] and kinetic.max() <= kinetic[0] * (1 + 1e-9)


def test_dashpots_that_cost_many_steps_are_told():
    case = damped(fd.Dashpot(2000.0 * C, nodes=[1]))
    with pytest.warns(
        fd.errors.FoldynWarning, match="the dashpots make the critical step .* times"
    ):
        fd.simulate(case, 0.01)
