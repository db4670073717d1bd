"""The linearization of a case: its state, matrices and the slope of oscillations."""

from __future__ import annotations

import re
import warnings
from dataclasses import replace

import numpy as np
import pytest
from bodies import body, flat, miura, paper_specimen
from scipy.integrate import quad
from scipy.special import gamma

import foldyn as fd
from foldyn.errors import FoldynWarning, InputError
from foldyn.linear import equivalent_slope, linearize

RNG = np.random.default_rng(5)
HELD = [fd.Fix([0, 1, 2], "xyz")]
LIFT = fd.Force([24], (0.0, 0.0, 2e-4))
STRAIGHT = {"fold_law": "linear", "bend_law": "linear"}


def at_random(s, size=1e-3):
    return fd.State(size * RNG.standard_normal(s.nodes.shape))


# ------------------------------------------------------------------ matrices


@pytest.mark.parametrize("mass", ["mixed_voronoi", "consistent"])
def test_matrices_are_those_of_the_structure_on_free_dofs(mass):
    s = miura(mass=mass, **STRAIGHT)
    case = fd.Case(s, [fd.Fix([0, 1], "xz"), fd.Fix([4], "y")], damping=fd.Rayleigh(0.3, 0.02))
    found, free = linearize(case), case.free_dofs
    np.testing.assert_array_equal(found.free, free)
    tangent, weights = (
        flat(matrix)[np.ix_(free, free)]
        for matrix in (s.tangent(np.zeros_like(s.nodes)), np.kron(flat(s.mass), np.eye(3)))
    )
    np.testing.assert_array_equal(flat(found.stiffness), tangent)
    np.testing.assert_array_equal(flat(found.mass), weights)
    np.testing.assert_allclose(flat(found.damping), 0.3 * weights + 0.02 * tangent, rtol=1e-15)
    assert found.soft == 0 and found.residual == 0.0 and found.secant is None


def test_stiffness_is_the_derivative_of_the_force_in_the_state():
    """Central difference of the internal force, error h^2; bent hinges are not soft."""
    case = fd.Case(miura(), HELD)
    state = at_random(case.structure)
    with pytest.warns(FoldynWarning, match="no equilibrium"):
        found = linearize(case, state)
    way, h = np.zeros(case.structure.nodes.size), 1e-6
    way[found.free] = RNG.standard_normal(len(found.free))
    step = h * way.reshape(-1, 3)
    ahead, behind = (case.structure.internal_force(state.displacement + d) for d in (step, -step))
    slope = ((ahead - behind) / (2 * h)).ravel()[found.free]
    error = np.linalg.norm(found.stiffness @ way[found.free] - slope)
    assert error < 1e-6 * np.linalg.norm(slope)
    assert found.soft == 0


def test_damping_takes_the_stiffness_at_rest_unless_told_otherwise():
    s = miura(**STRAIGHT)
    pressed = fd.Case(s, [fd.Fix([0, 1, 2, 3, 4], "xyz"), fd.Impose([20, 24], "x", -0.2)])
    state = fd.initial_state(fd.trace(pressed, load_factors=[1.0]))
    free = pressed.free_dofs
    for where, u in (("rest", np.zeros_like(s.nodes)), ("initial", state.displacement)):
        damped = replace(pressed, damping=fd.Rayleigh(0.0, 0.5, state=where))
        expected = 0.5 * flat(s.tangent(u))[np.ix_(free, free)]
        np.testing.assert_allclose(flat(linearize(damped, state).damping), expected, rtol=1e-15)


# ------------------------------------------------------------------ the state


def test_equilibrium_is_the_end_of_the_path_under_the_loads():
    case = fd.Case(miura(**STRAIGHT), HELD, [LIFT])
    path = fd.trace(case, load_factors=[1.0])
    found = linearize(case, "equilibrium")
    np.testing.assert_allclose(found.displacement, path.displacement[-1], rtol=0, atol=1e-12)
    assert found.residual < 1e-8
    again = linearize(case, fd.initial_state(path))
    assert abs(again.stiffness - found.stiffness).max() < 1e-9 * abs(found.stiffness).max()
    with pytest.warns(FoldynWarning, match="do not act in the rest state.*'equilibrium'"):
        assert not linearize(case).displacement.any()
    pulse = replace(LIFT, history=fd.HalfSine(0.1))  # which acts in motions alone
    assert not linearize(fd.Case(case.structure, HELD, [pulse])).displacement.any()
    with pytest.warns(FoldynWarning, match="the loads of a free body must balance"):
        linearize(fd.Case(miura(**STRAIGHT), loads=[LIFT]), "equilibrium")


def test_a_state_on_the_way_is_an_equilibrium_under_part_of_the_loads():
    case = fd.Case(miura(**STRAIGHT), HELD, [fd.Gravity((0, 0, -0.002)), LIFT])
    path = fd.trace(case, load_factors=[0.3], constant="gravity")
    assert linearize(case, fd.initial_state(path)).residual < 1e-8  # and no warning
    case = fd.Case(miura(**STRAIGHT), HELD, [fd.Actuate("all", angle=150.0)])
    state = fd.initial_state(fd.trace(case, "displacement", load_factors=[0.0, 0.1]))
    assert linearize(case, state, load_factor=0.1).residual < 1e-8
    with pytest.warns(FoldynWarning, match="load_factor of its actuated folds"):
        linearize(case, state)


def test_folds_with_a_moment_at_rest_relax():
    case = paper_specimen(rest="as_published")
    with pytest.warns(FoldynWarning) as caught:
        linearize(case)
    text = " ".join(str(w.message) for w in caught)
    assert "no equilibrium" in text and "state = 'equilibrium'" in text and "soft" not in text
    found = linearize(case, "equilibrium")
    assert found.residual < 1e-8
    assert np.abs(found.displacement).max() > 1e-3
    free = fd.Case(case.structure)  # the same with nothing that holds it
    assert linearize(free, "equilibrium").residual < 1e-8


# ------------------------------------------------------------------ hinges without slope


def test_soft_hinges_are_counted_and_the_user_is_told():
    case = fd.Case(miura(), HELD)
    with pytest.warns(FoldynWarning, match="64 hinges .* secant = an amplitude"):
        found = linearize(case)
    assert found.soft == len(case.structure.bends) == 64
    stripped = replace(case.structure, bend_stiffness=np.zeros(64))
    free = case.free_dofs
    without = stripped.tangent(np.zeros_like(stripped.nodes))[free][:, free]
    np.testing.assert_array_equal(flat(found.stiffness), flat(without))
    assert linearize(case, secant=1.0).soft == 0


@pytest.mark.parametrize("degrees", [0.1, 1.0, 5.0])
def test_secant_at_rest_is_a_linear_law_of_another_stiffness(degrees):
    """k A^(1/3) 2/sqrt(pi) Gamma(5/3) / Gamma(13/6): the integral of cos^(7/3)."""
    s = miura()
    factor = 2 / np.sqrt(np.pi) * gamma(5 / 3) / gamma(13 / 6) * np.radians(degrees) ** (1 / 3)
    options = replace(s.options, bend_law="linear")
    linear = replace(s, bend_stiffness=factor * s.bend_stiffness, options=options)
    found = linearize(fd.Case(s, HELD), secant=degrees).stiffness
    expected = linearize(fd.Case(linear, HELD)).stiffness
    # the superlinear tangent at rest has angles of rounding in it, the linear one has not
    assert abs(found - expected).max() < 1e-10 * abs(expected).max()


def test_secant_leaves_other_laws_alone():
    case = fd.Case(miura(fold_law=fd.EnhancedLinear(75, 285), bend_law="linear"), HELD)
    one, other = (flat(linearize(case, secant=a).stiffness) for a in (2.0, None))
    np.testing.assert_array_equal(one, other)


def test_secant_of_small_amplitude_is_the_tangent_of_a_bent_state():
    case = fd.Case(body("kresling", bend_law="superlinear", fold_law="superlinear"))
    state = at_random(case.structure, 1e-2)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)  # a state that is no equilibrium
        exact, *secants = (linearize(case, state, secant=a).stiffness for a in (None, 2e-3, 1e-3))
    errors = [abs(one - exact).max() for one in secants]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)  # of order A^2


@pytest.mark.parametrize("ratio", [0.0, 0.2, 0.7, 0.999, 1.0, 1.001, 1.5, 20.0])
def test_equivalent_slope_is_the_first_harmonic_of_the_moment(ratio):
    amplitude = 0.05
    offset = ratio * amplitude

    def harmonic(phase):
        d = offset + amplitude * np.cos(phase)
        return np.sign(d) * abs(d) ** (4 / 3) * np.cos(phase) / (np.pi * amplitude)

    kinks = [np.arccos(-ratio)] if ratio < 1 else None
    expected = 2 * quad(harmonic, 0, np.pi, points=kinks, epsabs=1e-13, limit=200)[0]
    assert equivalent_slope(offset, amplitude) == pytest.approx(expected, rel=1e-10)
    assert equivalent_slope(-offset, amplitude) == equivalent_slope(offset, amplitude)


def test_equivalent_slope_gives_the_frequency_of_an_oscillation():
    """x'' + |x|^(4/3) sgn x = 0 with amplitude A, whose period is known:

    energy x'^2/2 + 3/7 |x|^(7/3) gives T = 4 sqrt(7/6) A^(-1/6) int_0^1 ds / sqrt(1 - s^(7/3)), and
    the integral is sqrt(pi) Gamma(1 + 3/7) / Gamma(1/2 + 3/7). Harmonic balance is 0.1 % off.
    """
    integral = np.sqrt(np.pi) * gamma(1 + 3 / 7) / gamma(1 / 2 + 3 / 7)
    exact = 2 * np.pi / (4 * np.sqrt(7 / 6) * 0.02 ** (-1 / 6) * integral)
    found = float(np.sqrt(equivalent_slope(0.0, 0.02)))
    assert 1e-5 < abs(found / exact - 1.0) < 2e-3  # an approximation all the same


# ------------------------------------------------------------------ refusals


@pytest.mark.parametrize("secant", [0.0, -1.0, np.nan, np.inf, 200.0, True, "1"])
def test_a_secant_that_is_no_amplitude(secant):
    with pytest.raises(InputError, match="secant = "):
        linearize(fd.Case(miura()), secant=secant)


def test_a_state_that_is_none():
    for state, message in (
        ("buckled", "state = 'buckled'"), (np.zeros((3, 3)), "got ndarray; give None"),
        (fd.State(np.zeros((3, 3))), re.escape("shape (3, 3): the case has (41, 3)")),
    ):  # fmt: skip
        with pytest.raises(InputError, match=message):
            linearize(fd.Case(miura()), state)


def test_nothing_to_move_or_no_mass():
    s = miura()
    bare = replace(s, node_mass=(np.arange(len(s.nodes)) != 7).astype(float))
    unknown = replace(s, sheet=replace(s.sheet, density=None))
    for case, message in (
        (fd.Case(s, [fd.Fix(range(len(s.nodes)), "xyz")]), "free one"),
        (fd.Case(bare), "node 7 is free but has no mass"),
        (fd.Case(unknown), "density is missing"),
    ):
        with pytest.raises(InputError, match=message):
            linearize(case)
    assert linearize(fd.Case(bare, [fd.Fix([7], "xyz")]), secant=1.0).mass.min() >= 0.0
