"""The rule inertia_exact, and every rule's rotational inertia about a panel edge."""

from __future__ import annotations

import numpy as np
import pytest
from mass_samples import (
    HEXAGON,
    PANELS,
    QUADS_ONLY,
    RECTANGLE,
    RHO,
    RULES,
    SQUARE,
    T,
    exact_second_moments,
    one,
    rotational_inertia,
    second_moments,
    shares,
)

import foldyn as fd
from foldyn.structures import MASS_RULES

# ---------------------------------------------------------------------------- inertia_exact


@pytest.mark.parametrize("panel", ["square", "rectangle", "rhombus", "parallelogram", "oblique"])
def test_inertia_exact_on_parallelograms(panel):
    """2/3 and 1/12, and every second moment exact: so is the inertia about any axis."""
    found = shares(PANELS[panel], "inertia_exact")
    np.testing.assert_allclose(found, [1 / 12] * 4 + [2 / 3], rtol=1e-12)
    x = np.c_[np.array(PANELS[panel]), np.zeros(4)] @ rotation(2).T + [0.3, -0.8, 0.5]
    s = one(x, "inertia_exact")
    exact = exact_second_moments(s)
    np.testing.assert_allclose(second_moments(s), exact, atol=1e-12 * np.trace(exact))


def test_inertia_exact_on_a_regular_hexagon():
    """By symmetry: corners c, center 1 - 6c, 3 c = 5/24 (radius 1)."""
    found = shares(HEXAGON, "inertia_exact")
    np.testing.assert_allclose(found, [5 / 72] * 6 + [42 / 72], rtol=1e-12)


@pytest.mark.parametrize("panel", sorted(PANELS))
@pytest.mark.parametrize("scheme", ["n5b8", "n4b5"])
def test_inertia_exact_on_any_panel(panel, scheme):
    """Exact total and center of mass, positive, second moments no worse than the centroid's."""
    x = np.c_[PANELS[panel], np.zeros(len(PANELS[panel]))] @ rotation(3).T + [3.0, -2.0, 1.0]
    s, c = (one(x, rule, scheme=scheme) for rule in ("inertia_exact", "centroid"))
    m, total = s.mass.diagonal(), RHO * T * s.pattern.face_areas.sum()
    assert m.sum() == pytest.approx(total, rel=1e-14)
    assert (m > 0.2 * c.mass.diagonal()).all()
    middle = s.nodes[s.triangles].mean(axis=1)
    center = s.surface.triangle_area @ middle / s.surface.triangle_area.sum()
    np.testing.assert_allclose(m @ s.nodes / total, center, rtol=1e-13)
    exact = exact_second_moments(s) - total * np.outer(center, center)

    def error(structure):
        found = second_moments(structure) - total * np.outer(center, center)
        return np.linalg.norm(found - exact) / np.linalg.norm(exact)

    assert error(s) < error(c) + 1e-13
    if panel in ("hexagon", "pentagon", "quad", "trapezoid", "kite") and scheme == "n5b8":
        assert error(s) < 0.7 * error(c)


MATRICES = {"consistent", "bubble", "condensed"}  # not diagonal


def rotation(seed):
    q = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))[0]
    return q * np.linalg.det(q)


@pytest.mark.parametrize("panel", ["trapezoid", "kite", "quad", "hexagon", "pentagon"])
@pytest.mark.parametrize("rule", sorted(set(RULES) - MATRICES - {"circumcenter"}))
def test_shares_do_not_depend_on_place_size_or_first_corner(panel, rule):
    x = np.array(PANELS[panel], float)
    if rule in QUADS_ONLY and len(x) != 4:
        return
    before = shares(x, rule)
    moved = 1e-3 * (np.c_[x, np.zeros(len(x))] @ rotation(7).T) + [0.2, 0.1, -0.3]
    np.testing.assert_allclose(shares(moved, rule), before, atol=1e-9)
    turned = shares(np.roll(x, 1, axis=0), rule)
    np.testing.assert_allclose(np.roll(turned[:-1], -1), before[:-1], atol=1e-9)


def test_inertia_exact_with_a_center_elsewhere():
    """A parallelogram whose given center is not its middle keeps its center of mass."""
    s = one(SQUARE, "inertia_exact", centers={0: [0.4, 0.55, 0]})
    m = s.mass.diagonal()
    np.testing.assert_allclose(m @ s.nodes / m.sum(), [0.5, 0.5, 0], atol=1e-14)
    assert m.sum() == pytest.approx(RHO * T, rel=1e-14)


# ---------------------------------------------------------------------------- rotation


# Inertia about an edge of length 1 of a parallelogram of height h, over m h^2; exact 1/3. Far
# corners are at h, the center at h/2: two corners' shares + center/4.
ABOUT_AN_EDGE = {
    "panel": 2 / 5 + 1 / 5 / 4,
    "centroid": 2 / 6 + 1 / 3 / 4,
    **dict.fromkeys(("equi_inertial", "equi_inertial_acute"), 1 / 4 + 1 / 36 + 4 / 9 / 4),
    **dict.fromkeys(("circumcenter", "mixed_voronoi"), 2 / 8 + 1 / 2 / 4),  # of rhombi
    "inertia_exact": 2 / 12 + 2 / 3 / 4,
    **dict.fromkeys(sorted(MATRICES), 1 / 3),
}


def errors_about_edges(vertices, rule):
    """Relative errors; the consistent matrix is exact, distances being linear over triangles."""
    found, exact = (
        [rotational_inertia(s, a, b) for a, b in s.pattern.edges.tolist()]
        for s in (one(vertices, rule), one(vertices, "consistent"))
    )
    return np.array(found) / exact - 1.0


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("panel", ["square", "rhombus", "rectangle", "parallelogram", "oblique"])
def test_rotational_inertia(panel, rule):
    if rule in ("circumcenter", "mixed_voronoi") and panel not in ("square", "rhombus"):
        return
    found = errors_about_edges(PANELS[panel], rule)
    error = 3.0 * ABOUT_AN_EDGE[rule] - 1.0
    np.testing.assert_allclose(found, error, rtol=1e-12, atol=1e-12)


def test_mixed_voronoi_on_the_2_to_1_rectangle():
    """Center 13/32, corners 19/128: about an edge 51/128, 25/128 too much.

    The triangles on the long edges are obtuse at the center (1/2, 1/4, 1/4); those on the short
    edges give it (1 + (H/W)^2)/4 = 5/16. Each is a quarter of the panel.
    """
    found = shares(RECTANGLE, "mixed_voronoi")
    np.testing.assert_allclose(found, [19 / 128] * 4 + [13 / 32], rtol=1e-13)
    error = errors_about_edges(RECTANGLE, "mixed_voronoi")
    np.testing.assert_allclose(error, 25 / 128, rtol=1e-12)


@pytest.mark.parametrize("panel", sorted(PANELS))
@pytest.mark.parametrize("scheme", ["n5b8", "n4b5"])
def test_consistent_is_exact_about_every_axis_in_the_panel(panel, scheme):
    """Its second moments are the integrals over the triangles."""
    s = one(PANELS[panel], "consistent", scheme=scheme)
    exact = exact_second_moments(s)
    np.testing.assert_allclose(second_moments(s), exact, atol=1e-14 * np.trace(exact))


def test_mass_center_and_inertia_of_a_structure():
    """A square plate of side 2 and mass 2.4: m a^2 / 12 about its axes, m a^2 / 6 about its normal.

    The consistent rule has them exactly; all rules have the mass and, by symmetry, the center.
    """
    pattern = fd.Pattern([[1, 1, 3], [3, 1, 3], [3, 3, 3], [1, 3, 3]], [[0, 1, 2, 3]])
    sheet = fd.Sheet(1e6, 0.25, 0.01, 60.0)
    exact = np.diag([0.8, 0.8, 1.6])
    for rule in MASS_RULES:
        plate = fd.discretize(pattern, sheet, mass=rule, preset="plate")
        assert plate.total_mass == pytest.approx(2.4)
        np.testing.assert_allclose(plate.center_of_mass, [2.0, 2.0, 3.0], rtol=1e-14)
        if rule in MATRICES | {"inertia_exact"}:
            np.testing.assert_allclose(plate.inertia, exact, atol=1e-13)
        elif rule == "panel":  # a fifth in each corner and in the center
            np.testing.assert_allclose(plate.inertia, 2.4 * exact, atol=1e-13)
        with pytest.raises(ValueError, match="read-only"):
            plate.inertia[0, 0] = 0.0
    shell = fd.shell(pattern, sheet, divisions=8, mass="consistent")
    np.testing.assert_allclose(shell.inertia, exact, atol=1e-13)


@pytest.mark.parametrize("rule", ["mixed_voronoi", "consistent", "panel"])
def test_a_spinning_structure_has_the_energy_of_its_inertia(rule):
    """Kinetic energy of a rigid turn is w I w / 2, with every rule."""
    s = fd.discretize(
        fd.patterns.miura(a=1.0, b=1.3), fd.Sheet(1e6, 0.25, 0.01, 60.0), mass=rule, preset="plate"
    )
    spin = np.array([0.3, -0.5, 0.7])
    velocity = np.cross(spin, s.nodes - s.center_of_mass)
    energy = 0.5 * float((velocity * (s.mass @ velocity)).sum())
    assert energy == pytest.approx(0.5 * spin @ s.inertia @ spin, rel=1e-12)
