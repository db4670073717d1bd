"""What free motions keep: linear and angular momentum, energy; and that methods agree."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from measured import apart, drift, energy, momenta, order
from moving_sheets import CELL_HELD, IMPLICIT, LINEAR, SHEET, cell, equal_steps, spinning, steps_of

import foldyn as fd
from foldyn.dynamics import METHODS

pytestmark = pytest.mark.filterwarnings("ignore:the energy balance")


def tumbling(case: fd.Case, spin: float = 1.0, shake: float = 0.02) -> fd.State:
    """A rotation about an oblique axis, a translation and a little disorder."""
    start = spinning(case.structure, spin * np.array([0.3, -0.5, 0.8]), (0.2, 0.1, 0.4))
    noise = np.random.default_rng(5).standard_normal(start.velocity.shape)
    return fd.State(velocity=start.velocity + shake * noise)


@pytest.mark.parametrize("mass", ["mixed_voronoi", "consistent"])
@pytest.mark.parametrize("method", METHODS)
def test_linear_momentum_over_many_steps(method, mass):
    """Over 2e4 steps of explicit methods; implicit ones take 500, ten times as long."""
    case = fd.Case(cell(dihedral=100, mass=mass))
    s, implicit = case.structure, METHODS[method].implicit
    dt = (4.0 if implicit else 0.4) * fd.critical_step(case, "rk4" if implicit else method)
    motion = fd.simulate(
        case, (500 if implicit else 20_000) * dt, method=method, dt=dt,
        every_steps=100 if implicit else 400,
        initial=tumbling(case), **equal_steps(method),
    )  # fmt: skip
    p, _ = momenta(s, motion)
    assert drift(p) < 1e-12
    center = np.array([(s.mass @ u).sum(axis=0) for u in motion.displacement.values])
    assert apart(center, motion.time.values[:, None] * p[0]) < 1e-11


def test_central_differences_keep_energy_and_angular_momentum_over_1e5_steps():
    case = fd.Case(cell(dihedral=100))
    dt = 0.5 * fd.critical_step(case, "central_difference")
    initial = tumbling(case, shake=0.005)
    motion = fd.simulate(
        case, 1e5 * dt, method="central_difference", dt=dt, every_steps=500, initial=initial
    )
    assert drift(momenta(case.structure, motion)[1]) < 1e-11
    error = np.abs(energy(motion) / energy(motion)[0] - 1.0)
    # bounded: the second half of the motion is no worse than the first
    assert error[1:100].max() < 0.02
    assert error[100:].max() < 1.5 * error[1:100].max()


@pytest.mark.parametrize("method", ["rk4", "dormand_prince"])
def test_angular_momentum_drifts_with_the_order_or_faster(method):
    """These methods cannot keep it; the drift over a fixed time falls with their order."""
    case = fd.Case(cell(dihedral=100, **LINEAR))
    steps = np.ceil(0.05 / fd.critical_step(case) * np.array([12, 16, 24])).astype(int)
    lost = []
    for n in steps.tolist():
        motion = fd.simulate(
            case, 0.05, method=method, dt=0.05 / n, every_steps=n,
            initial=tumbling(case, spin=60.0, shake=0.0), **equal_steps(method),
        )  # fmt: skip
        lost.append(drift(momenta(case.structure, motion)[1]))
    assert order(steps, lost) > METHODS[method].order - 0.15


@pytest.mark.parametrize("method", ["newmark", "generalized_alpha"])
def test_implicit_methods_drift_with_the_square_of_the_step(method):
    paper = fd.Sheet(1.219e9, 0.2, 0.24e-3, 667.0, length_scale_ratio=2.7)
    pattern = fd.patterns.miura((2, 1), 0.025, b=0.025, dihedral=90)
    case = fd.Case(fd.discretize(pattern, paper, preset="herkal", **LINEAR))
    start, steps, lost = spinning(case.structure, (2.0, 50.0, 1.5), (0.4, 0.0, 2.0)), [], []
    for n in (100, 200, 400):
        motion = fd.simulate(case, 0.02, method=method, dt=0.02 / n, every_steps=n, initial=start)
        steps.append(n)
        lost.append(np.linalg.norm(np.diff(momenta(case.structure, motion)[1], axis=0)))
    assert order(steps, lost) == pytest.approx(2.0, abs=0.3)


# duration, damping by stiffness and numbers of steps; the fastest mode (3700 rad/s) is excited, too
RUNS = {
    **dict.fromkeys(IMPLICIT, (1.0, 1e-4, [50, 100, 200])),
    "rk4": (0.2, 1e-5, [2000, 4000, 8000]),
    "central_difference": (0.2, 1e-5, [4000, 8000, 16000]),
    "dormand_prince": (0.2, 1e-5, [800, 1200, 1600]),
}


@cache
def damped(mass, beta):
    """A cell with linear folds and bends, a smooth load, and both kinds of damping."""
    load = fd.Force([7], (0.01, 0.0, 0.0), fd.Harmonic(frequency=0.7))
    return fd.Case(cell(**LINEAR, mass=mass), CELL_HELD, [load], fd.Rayleigh(0.5, beta))


@cache
@cache
def end(mass, beta, duration, method, n):
    """Displacements after so many steps."""
    given = {"dt": duration / n, "every_steps": n} | equal_steps(method)
    motion = fd.simulate(damped(mass, beta), duration, method=method, **given)
    return motion.displacement.values[-1]


@pytest.mark.parametrize("mass", ["circumcenter", "consistent"])
@pytest.mark.parametrize("method", METHODS)
def test_methods_converge_to_one_motion_with_their_orders(method, mass):
    duration, beta, steps = RUNS.get(method, RUNS["rk4"])
    made = mass, beta, duration
    reference = end(*made, "rk4", 64_000)
    errors = [np.linalg.norm(end(*made, method, n) - reference) for n in steps]
    assert errors[-1] < (1e-3 if method in IMPLICIT else 1e-5) * np.linalg.norm(reference)
    assert order(steps, errors) == pytest.approx(METHODS[method].order, rel=0.075)


@pytest.mark.matrix
@pytest.mark.parametrize("method", METHODS)
def test_energies_balance_in_the_default_model_and_methods_agree(method):
    push = fd.Force([7], (0.01, 0.0, 0.0), fd.HalfSine(0.1))
    s = fd.discretize(fd.patterns.miura(dihedral=60), SHEET, preset="plate")
    case = fd.Case(s, CELL_HELD, [push], fd.Rayleigh(alpha=0.5))
    motion, true = (
        fd.simulate(case, 0.3, method=name, interval=0.01, **steps_of(name, 1e-4))
        for name in (method, "rk4")
    )
    assert motion.attrs["energy_error"] < 1e-4
    assert apart(motion, true) < 2e-3
