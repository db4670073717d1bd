"""The mass rule bubble: plates that translate, turn, twist and bulge."""

from __future__ import annotations

import numpy as np
import pytest
from mass_samples import PANELS, RHO, SHEET, T, exact_second_moments, one, second_moments

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
def test_twist(name):
    """Corners at +w, -w in turn, w xi eta between: m w^2/9; 1/6 consistent, 1/3 inertia_exact."""
    twist = np.array([1.0, -1.0, 1.0, -1.0, 0.0])
    found = {}
    for rule in ("bubble", "consistent", "inertia_exact"):
        s = one(PANELS[name], rule)
        found[rule] = twist @ (s.mass @ twist) / (RHO * T * s.pattern.face_areas[0])
    assert found == pytest.approx({"bubble": 1 / 9, "consistent": 1 / 6, "inertia_exact": 1 / 3})


@pytest.mark.parametrize("name", PARALLELOGRAMS)
def test_translations_and_rotations(name):
    s = one(PANELS[name], "bubble")
    exact = exact_second_moments(s)
    np.testing.assert_allclose(second_moments(s), exact, atol=1e-14 * np.trace(exact))
    np.testing.assert_allclose(
        s.nodal_mass / s.total_mass, [1 / 12] * 4 + [2 / 3], rtol=1e-12
    )  # fmt: skip


@pytest.mark.parametrize("name", sorted(set(PANELS) - set(PARALLELOGRAMS)))
@pytest.mark.parametrize("scheme", ["n5b8", "n4b5"])
def test_other_panels_are_consistent(name, scheme):
    bubble, consistent = (
        one(PANELS[name], rule, scheme=scheme) for rule in ("bubble", "consistent")
    )
    np.testing.assert_array_equal(bubble.mass.toarray(), consistent.mass.toarray())


def test_parallelograms_beside_other_panels():
    """A square between a triangle and a trapezoid: the sum of their own matrices."""
    x = [[0, 0], [1, 0], [1, 1], [0, 1], [-1, 0.5], [2, 0.1], [2, 0.7]]
    faces = [[0, 3, 4], [0, 1, 2, 3], [1, 5, 6, 2]]
    whole = fd.discretize(fd.Pattern(x, faces), SHEET, mass="bubble")
    total = np.zeros((len(whole.nodes),) * 2)
    for face, center, rule in zip(
        faces, whole.centers, ("consistent", "bubble", "consistent"), strict=True
    ):
        own = one(np.array(x)[face], rule)
        nodes = [*face, center] if center >= 0 else face
        total[np.ix_(nodes, nodes)] += own.mass.toarray()
    np.testing.assert_allclose(whole.mass.toarray(), total, rtol=1e-12, atol=1e-15)


def test_motions_take_it():
    """The error of the energy in an explicit motion is of the integrator's order."""
    pattern = fd.patterns.simple_fold(dihedral=90)
    sheet = fd.Sheet(1e6, 0.25, 0.01, density=1.0)
    structure = fd.discretize(pattern, sheet, mass="bubble", bend_law="linear")
    case = fd.Case(
        structure,
        [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "z")],
        [fd.Force([0, 1], (-1e-4, 0.0, 0.0))],
    )
    step = 0.5 * float(fd.critical_step(case))
    errors = [fd.simulate(case, 100 * step, dt=h).attrs["energy_error"] for h in (step, step / 2)]
    assert 0 < errors[1] < errors[0] / 12 < 1e-4
