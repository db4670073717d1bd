"""The mass rules bubble and condensed: plates that translate, turn, twist and bulge."""

from __future__ import annotations

import numpy as np
import pytest
from mass_samples import HEXAGON, PANELS, RHO, SHEET, T, exact_second_moments, one, second_moments

import foldyn as fd

PARALLELOGRAMS = ["square", "rectangle", "rhombus", "parallelogram", "oblique"]


def natural(count):
    """Points and weights (k,) of a quadrature of [-1, 1]^2, exact to degree 2 count - 1."""
    x, w = np.polynomial.legendre.leggauss(count)
    xi, eta = np.meshgrid(x, x)
    return xi.ravel(), eta.ravel(), np.outer(w, w).ravel() / 4.0


@pytest.mark.parametrize("name", PARALLELOGRAMS)
def test_the_matrix_is_that_of_its_shape_functions(name):
    xi, eta, weight = natural(6)
    bulge = 1.0 - 0.5 * (xi**2 + eta**2)
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    shapes = [(1 + a * xi) * (1 + b * eta) / 4 - bulge / 4 for a, b in corners] + [bulge]
    expected = np.einsum("ik,jk,k->ij", shapes, shapes, weight)
    s = one(PANELS[name], "bubble")
    total = RHO * T * s.pattern.face_areas[0]
    np.testing.assert_allclose(s.mass.toarray() / total, expected, atol=1e-15)
    assert np.linalg.eigvalsh(expected).min() > 0.02


@pytest.mark.parametrize("name", PARALLELOGRAMS)
def test_translations_rotations_and_twists(name):
    """Corners at +w, -w in turn, w xi eta between: m w^2/9."""
    s, twist = one(PANELS[name], "bubble"), np.array([1.0, -1.0, 1.0, -1.0, 0.0])
    exact = exact_second_moments(s)
    np.testing.assert_allclose(second_moments(s), exact, atol=1e-14 * np.trace(exact))
    shares = s.nodal_mass / s.total_mass
    np.testing.assert_allclose(shares, [1 / 12] * 4 + [2 / 3], rtol=1e-12)
    assert twist @ (s.mass @ twist) / s.total_mass == pytest.approx(1 / 9)


@pytest.mark.parametrize("name", sorted(set(PANELS) - set(PARALLELOGRAMS)))
@pytest.mark.parametrize("scheme", ["n5b8", "n4b5"])
def test_other_panels_are_consistent(name, scheme):
    bubble, other = (one(PANELS[name], rule, scheme=scheme) for rule in ("bubble", "consistent"))
    np.testing.assert_array_equal(bubble.mass.toarray(), other.mass.toarray())


def test_parallelograms_beside_other_panels():
    """A square between a triangle and a trapezoid: the sum of their own matrices."""
    x = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [-1, 0.5], [2, 0.1], [2, 0.7]])
    faces = {(0, 3, 4): "consistent", (0, 1, 2, 3): "bubble", (1, 5, 6, 2): "consistent"}
    whole = fd.discretize(fd.Pattern(x, list(faces)), SHEET, mass="bubble", preset="plate")
    total = np.zeros((len(whole.nodes),) * 2)
    for (face, rule), center in zip(faces.items(), whole.centers, strict=True):
        nodes = [*face, center] if center >= 0 else face
        total[np.ix_(nodes, nodes)] += one(x[list(face)], rule).mass.toarray()
    np.testing.assert_allclose(whole.mass.toarray(), total, rtol=1e-12, atol=1e-15)


def test_motions_take_it():
    """The error of the energy in an explicit motion is of the integrator's order."""
    pattern, sheet = fd.patterns.simple_fold(dihedral=90), fd.Sheet(1e6, 0.25, 0.01, density=1.0)
    structure = fd.discretize(pattern, sheet, mass="bubble", bend_law="linear")
    held = [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "z")]
    case = fd.Case(structure, held, [fd.Force([0, 1], (-1e-4, 0.0, 0.0))])
    step = 0.5 * float(fd.critical_step(case))
    errors = [
        fd.simulate(case, 100 * step, method="rk4", dt=h).attrs["energy_error"]
        for h in (step, step / 2)
    ]
    assert 0 < errors[1] < errors[0] / 12 < 1e-4


@pytest.mark.parametrize("name", sorted(PANELS))
@pytest.mark.parametrize("scheme", ["n5b8", "n4b5"])
def test_what_is_linear_over_a_panel_is_exact(name, scheme):
    """Translations, rotations and changes of shape: a plate follows them without bending."""
    s = one(PANELS[name], "condensed", scheme=scheme)
    exact = exact_second_moments(s)
    assert s.total_mass == pytest.approx(RHO * T * s.pattern.face_areas.sum(), rel=1e-9)
    np.testing.assert_allclose(second_moments(s), exact, atol=1e-8 * np.trace(exact))
    assert np.linalg.eigvalsh(s.mass.toarray()).min() > 0.0


@pytest.mark.parametrize("name", ["square", "rectangle"])
def test_twist(name):
    """A rectangle between corners at +w, -w in turn is w xi eta: m w^2/9."""
    twist = np.array([1.0, -1.0, 1.0, -1.0, 0.0])
    s = one(PANELS[name], "condensed")
    assert twist @ (s.mass @ twist) / s.total_mass == pytest.approx(1 / 9, rel=2e-4)


def test_bulge():
    """The center lifted off fixed corners: near the parabola of `bubble`, 22/45; a tent has 1/6."""
    lifted = {
        rule: one(PANELS["square"], rule).mass[4, 4] / (RHO * T)
        for rule in ("condensed", "bubble", "consistent")
    }
    assert lifted["bubble"] == pytest.approx(22 / 45)
    assert lifted["condensed"] == pytest.approx(22 / 45, rel=0.15)
    assert lifted["consistent"] == pytest.approx(1 / 6)


def test_a_hexagon_keeps_its_symmetry():
    mass = one(HEXAGON, "condensed").mass.toarray()
    rolled = np.r_[np.roll(np.arange(6), 1), 6]
    np.testing.assert_allclose(mass[np.ix_(rolled, rolled)], mass, rtol=1e-5)


def test_straight_creases_make_a_difference():
    """A panel between two creases follows its corners along straight edges."""
    strip = fd.Pattern([(0, 0), (1, 0), (2, 0), (3, 0), (0, 1), (1, 1), (2, 1), (3, 1)],
                       [(0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6)])  # fmt: skip
    sheet = fd.Sheet(1e6, 0.3, T, density=RHO)
    mass = fd.discretize(strip, sheet, mass="condensed", preset="plate").mass.toarray()
    centers = [8, 9, 10]
    own = mass[centers, centers] / (RHO * T)
    assert own[0] == pytest.approx(own[2], rel=1e-6)
    assert own[1] < own[0] * 0.99
