"""Drag of panels in air: terminal velocity, wind, gusts, the energy that the air takes."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import foldyn as fd
from foldyn.dynamics.dampers import air_terms
from foldyn.dynamics.methods import METHODS
from foldyn.errors import InputError
from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.term import ThreadTerms, evaluate

SHEET = fd.Sheet(youngs_modulus=1e6, poissons_ratio=0.25, thickness=1e-3, density=300.0)
FLUID = {"density": 20.0, "added_mass": False, "drag_coefficient": 1.2}
SIDE, G = 0.1, 9.81
MASS, PRESSING = 0.3 * SIDE**2, 0.5 * 20.0 * 1.2 * SIDE**2  # kg; 1/2 rho Cd A, kg/m
TERMINAL = np.sqrt(MASS * G / PRESSING)


UNTURNED = np.eye(3)


def plate(turn=UNTURNED, sheet=SHEET):
    corners = SIDE * np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)])
    return fd.discretize(fd.Pattern(corners @ turn.T, [(0, 1, 2, 3)]), sheet, preset="plate")


BALANCED = {"rk4": 1e-9, "central_difference": 1e-4, "dormand_prince": 1e-9, "newmark": 1e-5} | {
    "generalized_alpha": 1e-4, "energy_momentum": 1e-10
}  # fmt: skip


def steps(method):
    return {"dt": 2e-3} if METHODS[method].implicit else {}


@pytest.mark.parametrize("method", METHODS)
def test_a_falling_sheet_reaches_the_terminal_velocity(method):
    """v = V tanh(g t / V) with V = sqrt(2 m g / (rho Cd A)), exact for a quadratic drag."""
    case = fd.Case(plate(), loads=[fd.Gravity((0, 0, -G))], air=fd.Air(**FLUID))
    motion = fd.simulate(case, 0.3, method=method, interval=0.02, **steps(method))
    speed = -motion.velocity.values[:, :, 2]
    exact = TERMINAL * np.tanh(G * motion.time.values / TERMINAL)
    assert np.abs(speed - exact[:, None]).max() < 1e-3 * TERMINAL
    assert_allclose(speed[-1], TERMINAL, rtol=1e-3)
    assert motion.attrs["energy_error"] < BALANCED.get(method, 1e-4)
    assert_allclose(motion.air[-1], motion.work[-1] - motion.kinetic[-1], rtol=1e-5)


@pytest.mark.parametrize("method", METHODS)
def test_wind_blows_a_sheet_away(method):
    """m v' = k (w - v)^2 from rest: v = w (1 - 1 / (1 + k w t / m)); the air gives the energy."""
    wind = 0.5
    case = fd.Case(plate(), air=fd.Air(**FLUID, velocity=(0.3, -0.2, wind)))
    motion = fd.simulate(case, 0.2, method=method, interval=0.02, **steps(method))
    exact = wind * (1.0 - 1.0 / (1.0 + PRESSING * wind * motion.time.values / MASS))
    assert_allclose(motion.velocity.values[:, 0, 2], exact, rtol=1e-3)
    assert np.abs(motion.velocity.values[:, :, :2]).max() < 1e-9 * wind
    assert_allclose(-motion.air[-1], 0.5 * MASS * exact[-1] ** 2, rtol=2e-3)
    assert motion.attrs["energy_error"] < BALANCED.get(method, 1e-4)


@pytest.fixture(scope="module")
def hinged():
    """A plate that gusts turn about an edge."""
    gust = fd.Air(**FLUID, velocity=(0.2, 0.1, 1.0), history=fd.Harmonic(frequency=4.0))
    return fd.Case(plate(), supports=[fd.Fix(nodes=[0, 1], axes="xyz")], air=gust)


@pytest.fixture(scope="module")
def blown(hinged):
    motion = fd.simulate(hinged, 0.25, method="dormand_prince", interval=0.05, tolerance=1e-8)
    return motion.displacement.values[:, 2]


@pytest.mark.parametrize("method", METHODS)
def test_gusts_move_a_sheet_alike_by_all_methods(hinged, blown, method):
    motion = fd.simulate(hinged, 0.25, method=method, interval=0.05, **steps(method))
    assert np.abs(blown).max() > 0.3 * SIDE
    assert_allclose(motion.displacement.values[:, 2], blown, atol=2e-3 * SIDE)
    assert motion.attrs["energy_error"] < 100.0 * BALANCED.get(method, 1e-4)


def test_drag_turns_with_the_sheet_and_the_wind():
    turn = np.linalg.qr(np.random.default_rng(1).standard_normal((3, 3)))[0]
    turn *= np.linalg.det(turn)
    wind, moves, taken = np.array([0.2, -0.1, 0.6]), [], []
    for turned in (np.eye(3), turn):
        air = fd.Air(**FLUID, velocity=turned @ wind)
        gravity = fd.Gravity(turned @ (1.0, 2.0, -G))
        case = fd.Case(plate(turned), loads=[gravity], air=air)
        spin = np.cross(turned @ (3.0, 1.0, 2.0), plate(turned).nodes)
        start = fd.State(velocity=spin + turned @ (0.3, 0.1, 0.2))
        motion = fd.simulate(case, 0.02, method="rk4", interval=0.02, initial=start)
        moves.append(motion.displacement.values[-1] @ turned)
        taken.append(float(motion.air[-1]))
    assert abs(taken[0]) > 1e-8
    assert_allclose(taken[1], taken[0], rtol=1e-9)
    assert_allclose(moves[1], moves[0], atol=1e-12)


def test_panels_that_move_along_themselves_meet_no_drag():
    case = fd.Case(plate(), air=fd.Air(**FLUID))
    start = fd.State(velocity=np.tile([0.7, -0.4, 0.0], (5, 1)))
    motion = fd.simulate(case, 0.05, method="rk4", interval=0.05, initial=start)
    assert_allclose(motion.velocity[-1], start.velocity, rtol=1e-12)
    assert np.abs(motion.air).max() < 1e-20


def forces(case, v):
    """Forces (n, 3) of drag at rest with velocities v, and minus their derivative (3n, 3n)."""
    (term,) = air_terms(case, [])
    body = Assembly(case.structure.body.sheet, term)
    model, force = ThreadTerms(body, body.thread_parts(1)[0]), np.zeros_like(v)
    evaluate(model.terms, np.zeros_like(v), v, force, np.zeros(0))
    return force, term.damping(np.zeros(v.size)).toarray()


@pytest.mark.matrix
def test_drag_of_a_turning_panel_is_that_of_its_parts():
    """A plate that turns about an edge: 1/2 rho Cd w^2 int y^2 dA = 1/2 rho Cd w^2 b a^3 / 3."""
    structure, rate = plate(), 3.0
    v = np.zeros((5, 3))
    v[:, 2] = rate * structure.nodes[:, 1]
    force, _ = forces(fd.Case(structure, air=fd.Air(**FLUID)), v)
    assert_allclose(force.sum(axis=0), [0, 0, PRESSING * rate**2 * SIDE**2 / 3.0], atol=1e-15)


@pytest.mark.matrix
def test_derivative_by_the_velocities():
    case = fd.Case(plate(), air=fd.Air(**FLUID, velocity=(0.1, 0.3, -0.4)))
    v = np.random.default_rng(3).standard_normal((5, 3))
    _, matrix = forces(case, v)
    for k in range(v.size):
        ahead, back, step = v.copy(), v.copy(), 1e-6
        ahead.flat[k] += step
        back.flat[k] -= step
        slope = (forces(case, ahead)[0] - forces(case, back)[0]).ravel() / (2.0 * step)
        assert_allclose(matrix[:, k], slope, atol=1e-9)


def test_many_motions_in_air_are_those_of_each():
    cases = [
        fd.Case(plate(), loads=[fd.Gravity((0, 0, -g))], air=fd.Air(**FLUID)) for g in (5.0, 9.0)
    ]
    many = fd.simulate_many(cases, 0.01, interval=0.01)
    for k, case in enumerate(cases):
        one = fd.simulate(
            case, 0.01, method="central_difference", dt=float(many.attrs["dt"]), interval=0.01
        )
        assert_allclose(many.displacement[k], one.displacement, rtol=1e-12)
        assert_allclose(many.air[k], one.air, rtol=1e-12)


def test_statics_refuse_wind():
    held = [fd.Fix(nodes=[0, 1], axes="xyz")]
    loads = [fd.Gravity((0, 0, -G))]
    case = fd.Case(plate(), held, loads, air=fd.Air(**FLUID, velocity=(0, 0, 1)))
    with pytest.raises(InputError, match="statics would leave wind out; take still air"):
        fd.trace(case, steps=2)
