"""Periodic motions of models with unknowns without mass: edges that give way, rotations of shells.

Small motions against frequency responses are in `linear/test_all_damping.py`.
"""

import numpy as np
import pytest

import foldyn as fd
from foldyn.periodic.balance import Fourier, values_of
from foldyn.periodic.equation import Equation
from foldyn.periodic.orbit import Shooting

pytestmark = pytest.mark.filterwarnings("ignore:damping. beta resists rotations")
F = 0.4
PATTERN, SHEET = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60), fd.Sheet(1e5, 0.25, 0.01, 1.0)
MODELS = {
    "n5b8e": fd.discretize(PATTERN, SHEET, preset="n5b8e"),
    "shell": fd.shell(PATTERN, SHEET, divisions=2),
}
HELD = [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "yz")]
PUSH = fd.Force([0, 1], (1e-3, 0, 0), history=fd.Harmonic(F, phase=40.0))
DRAG, BOTH = fd.Rayleigh(alpha=0.5), fd.Rayleigh(alpha=0.2, beta=0.05)


def fold(loads=(PUSH,), supports=(), damping=DRAG, model="n5b8e"):
    return fd.Case(MODELS[model], [*HELD, *supports], list(loads), damping)


def size(motion):
    return np.ptp(motion.displacement.values, axis=0).max()


def difference(one, other):
    return np.abs(one.displacement.values - other.displacement.values).max() / size(other)


def after(case, motion, periods=1, **options):
    """Largest distance from a motion after periods that are simulated from its start, of its size.

    Compared at the end and after the first quarter.
    """
    begin = fd.State(motion.displacement.values[0], motion.velocity.values[0])
    run = fd.simulate(case, periods / F, initial=begin, interval=0.25 / F, **options)
    ends = run.displacement.values[[1, -1]] - motion.displacement.values[[32, 0]]
    return np.abs(ends).max() / size(motion)


def fine(count):
    return {"method": "generalized_alpha", "dt": 1.0 / F / count}


@pytest.mark.matrix
@pytest.mark.parametrize("damping", [DRAG, BOTH])
def test_harmonics_and_shooting_find_the_same_motion(damping):
    case = fold(damping=damping)
    one = fd.periodic_motion(case, harmonics=9)
    two = fd.periodic_motion(case, method="shooting", steps=32)
    assert difference(one, two) < 3.0 * one.attrs["truncation"] + 1e-6


@pytest.mark.parametrize(
    ("damping", "options"),
    [
        (DRAG, {"method": "rk4"}),
        pytest.param(BOTH, {"method": "newmark", "dt": 0.02}, marks=pytest.mark.matrix),
    ],
)
def test_multipliers_are_those_of_deviations_of_simulated_motions(damping, options):
    """With beta, edges begin in balance, which they are not in the deviation."""
    case, far = fold(damping=damping), 1e-6
    one = fd.periodic_motion(case, harmonics=7)
    equation, fourier = Equation(case, "a test"), Fourier(7, samples=128)
    at = equation.at(fourier.phase)
    amplitudes = fourier.complex_of(fourier.fit @ equation.unknowns(one.displacement.values, at))
    x, v = (values_of(amplitudes, np.zeros(1), k)[0] for k in (0, 1))
    state = np.concatenate([x, v[: equation.heavy]])
    _, derivative = Shooting(equation, 2.0 * np.pi * F, 32).period(state)
    value = np.sort(np.abs(np.linalg.eigvals(derivative)))[::-1]
    assert np.abs(one.floquet.values[:2]) == pytest.approx(value[:2], rel=1e-3)
    way, still = np.zeros_like(state), equation.at(np.zeros(1))
    way[: equation.size] = equation.vibrations(still.tangents(x[None])[0], 0, 0)[1][:, 0]
    ends = []
    for moved in (far, -far):
        begin = fd.State(
            one.displacement.values[0] + moved * of_nodes(equation, way), one.velocity.values[0]
        )
        run = fd.simulate(case, 1.0 / F, initial=begin, interval=1.0 / F, **options)
        ends.append(run.displacement.values[-1])
    grown = of_nodes(equation, derivative @ way)
    close = 1e-2 * np.abs(grown).max()
    assert (ends[0] - ends[1]) / (2.0 * far) == pytest.approx(grown, abs=close)


def of_nodes(equation, state):
    return equation.nodal((equation.basis @ state[: equation.size])[None])[0]


DRIVES = {
    "base, late edges": ([], [fd.BaseMotion("x", value=0.02, history=fd.Harmonic(F))], BOTH),
    "imposed": ([], [fd.Impose([1], "x", value=0.02, history=fd.Harmonic(F))], DRAG),
    "actuated": ([fd.Actuate("all", angle=290.0, history=fd.Harmonic(F))], [], DRAG),
    "moment": ([fd.CreaseMoment("all", 1e-3, history=fd.Harmonic(F))], [], DRAG),
    "pressure": ([fd.Pressure(1e-3, history=fd.Harmonic(F))], [], DRAG),
    "linked": ([PUSH], [fd.Link([0, 1], "x")], DRAG),
}


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.matrix if n != "moment" else ()) for n in DRIVES]
)
def test_simulation_from_a_point_of_it_comes_back(name):
    loads, supports, damping = DRIVES[name]
    case = fold(loads, supports, damping)
    one = fd.periodic_motion(case, harmonics=9)
    assert after(case, one, **fine(256)) < 3e-4
    if not damping.beta:
        assert after(case, one, method="rk4") < 1e-3  # with an inertia of edges


@pytest.mark.matrix
def test_simulated_motion_from_rest_settles_on_it():
    case = fold(damping=fd.Rayleigh(alpha=0.8))
    one = fd.periodic_motion(case, harmonics=9)
    run = fd.simulate(case, 16.0 / F, interval=0.25 / F, method="rk4")
    last, there = run.displacement.values[[-2, -1]], one.displacement.values[[96, 0]]
    assert last == pytest.approx(there, abs=1e-3 * size(one))


def test_backbone_begins_at_the_linear_frequency():
    case = fold(damping=BOTH)
    linear = fd.modes(case, count=2, check_model=False).frequency.values[-1]
    found = fd.backbone(case, 2, amplitudes=(1e-6, 1.1e-6), harmonics=2)
    assert found.frequency.values[0] == pytest.approx(linear, rel=1e-8)
    assert found.energy_drift.values.max() < 1e-12


@pytest.mark.matrix
def test_energy_along_a_backbone_is_constant_and_free_motions_come_back():
    case = fold()
    last = fd.backbone(case, amplitudes=(1e-3, 5e-2), harmonics=7).isel(point=-1)
    assert float(last.energy_drift) < 1e-9
    start, period = last.coefficient.values.sum(axis=0).real, 1.0 / float(last.frequency)
    free = fd.Case(case.structure, HELD)
    for options in ({"method": "generalized_alpha", "dt": period / 512}, {"method": "rk4"}):
        run = fd.simulate(free, period, initial=fd.State(start), interval=period, **options)
        assert run.displacement.values[-1] == pytest.approx(start, abs=1e-5 * 5e-2)


@pytest.mark.matrix
@pytest.mark.parametrize("damping", [DRAG, BOTH])
def test_few_modes_come_near_and_say_how_near(damping):
    case = fold(damping=damping)
    whole, one = (fd.periodic_motion(case, harmonics=6, modes=modes) for modes in (None, 4))
    assert 0.1 * one.attrs["reduction"] < difference(one, whole) < 30.0 * one.attrs["reduction"]
    assert one.attrs["reduction"] < 1e-3


@pytest.mark.parametrize("model", MODELS)
def test_tangents_are_derivatives_of_forces(model):
    """With contact, pressure, a moment and actuation, at displacements of all unknowns."""
    loads = [PUSH, *(DRIVES[name][0][0] for name in ("actuated", "moment", "pressure"))]
    wall = fd.Plane((-0.05, 0, 0), (1, 0, 0))
    near = fd.Contact(0.06, stiffness=0.1, panels=False, planes=[wall])
    equation = Equation(fold(loads, model=model).altered(contact=near), "a test")
    at, random = equation.at(np.array([0.7, 2.0])), np.random.default_rng(0)
    x, way = random.normal(size=(2, 2, equation.size))
    x *= 2e-3
    up, down = (at.forces(x + s * way) for s in (1e-7, -1e-7))
    slope = np.einsum("skl,sl->sk", at.tangents(x), way)
    assert (up - down) / 2e-7 == pytest.approx(slope, rel=1e-5, abs=1e-7 * np.abs(slope).max())


@pytest.mark.matrix
def test_the_exponent_of_a_motion_is_that_of_its_multipliers():
    case = fold(damping=fd.Rayleigh(alpha=0.05, beta=0.002))
    one = fd.periodic_motion(case, harmonics=9)
    start = fd.State(one.displacement.values[0], one.velocity.values[0])
    found = fd.lyapunov_exponent(case, 24.0 / F, settle=16.0 / F, initial=start)
    rate = F * np.log(np.abs(one.floquet.values[0]))
    assert rate < -0.03  # alpha alone: -0.025
    assert float(found.exponent) == pytest.approx(rate, rel=0.05)


@pytest.mark.matrix
def test_a_response_curve_ends_in_the_motion_that_is_found_there():
    case = fold([fd.Force([0, 1], (2e-4, 0, 0), history=fd.Harmonic(F))], damping=BOTH)
    curve = fd.response_curve(case, (0.42, 0.36), harmonics=5, steps=16, longest_step=0.5)
    last = curve.isel(point=-1)
    assert curve.attrs["complete"]
    one = fd.periodic_motion(case, float(last.frequency), harmonics=5, steps=16)
    assert last.coefficient.values == pytest.approx(one.coefficient.values, abs=1e-7 * size(one))
    assert abs(last.floquet.values[:2]) == pytest.approx(abs(one.floquet.values[:2]), rel=1e-5)
