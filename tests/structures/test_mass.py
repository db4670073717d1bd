"""Mass rules: exact totals and momenta, and every rule by hand numbers."""

from __future__ import annotations

import numpy as np
import pytest
from mass_samples import (
    HEXAGON,
    OBLIQUE,
    PANELS,
    QUADS_ONLY,
    RHO,
    RHOMBUS,
    RULES,
    SHEET,
    SQUARE,
    TRAPEZOID,
    T,
    one,
    shares,
)

import foldyn as fd
from foldyn.errors import InputError
from foldyn.patterns import GENERATORS
from foldyn.structures.mass import _circumcentric_shares
from pairwise import in_pairs


@pytest.mark.parametrize(
    ("name", "scheme", "rule"), in_pairs(sorted(GENERATORS), ["n5b8", "n4b5"], RULES)
)
def test_every_rule_on_every_pattern(name, scheme, rule):
    pattern = GENERATORS[name]()
    s = fd.discretize(pattern, SHEET, scheme=scheme, mass=rule)
    quads = scheme == "n5b8" and {len(face) for face in pattern.faces} == {4}
    if rule in QUADS_ONLY and not quads:
        with pytest.raises(InputError, match=rf"{rule}.*mixed_voronoi"):
            _ = s.mass
        return
    try:
        m = s.mass.toarray()
    except InputError as error:
        assert rule == "circumcenter"  # some triangles of these patterns are obtuse
        assert "mixed_voronoi" in str(error)  # noqa: PT017
        return
    assert s.mass is s.mass  # computed once
    check(s, m)


def check(s, m):
    total = RHO * T * s.pattern.face_areas.sum()
    n = len(s.nodes)
    assert m.shape == (n, n)
    assert m.sum() == pytest.approx(total, rel=1e-14)
    np.testing.assert_array_equal(m, m.T)
    assert np.linalg.eigvalsh(m).min() >= -1e-16 * total
    if s.options.mass == "condensed":  # corners may tip against the load that lifts the center
        assert np.linalg.eigvalsh(m).min() > 1e-3 * total / n
    else:  # every node that a panel uses has a mass of its own
        assert (m.sum(axis=1) > 1e-3 * total / n).all()
    # linear momentum of a uniform velocity, and no coupling that a shift could feel
    velocity = np.tile([0.3, -1.0, 2.0], (n, 1))
    np.testing.assert_allclose((m @ velocity).sum(axis=0), total * velocity[0], rtol=1e-13)
    assert (m.diagonal() > 0).all()
    if s.options.mass not in ("bubble", "condensed"):  # whose corners move apart in a bulge
        assert (m >= 0).all()


@pytest.mark.parametrize(
    ("panel", "scheme", "rule"),
    in_pairs(sorted(PANELS), ["n5b8", "n4b5"], sorted(set(RULES) - QUADS_ONLY - {"circumcenter"})),
)
def test_safe_rules_on_single_panels(panel, scheme, rule):
    s = one(PANELS[panel], rule, scheme=scheme)
    check(s, s.mass.toarray())


def test_mass_needs_a_density():
    s = fd.discretize(fd.patterns.miura(), fd.Sheet(1e6, 0.25, 0.01), preset="plate")
    assert s.energy(np.zeros_like(s.nodes)) == 0.0  # statics does without
    with pytest.raises(InputError, match="density is missing"):
        _ = s.mass


# ---------------------------------------------------------------------------- rules by hand


def test_panel_rule():
    for shape, scheme, part in (
        (TRAPEZOID, "n5b8", 1 / 5), (TRAPEZOID, "n4b5", 1 / 4), (HEXAGON, "n5b8", 1 / 7)
    ):  # fmt: skip
        np.testing.assert_allclose(shares(shape, "panel", scheme=scheme), part, rtol=1e-14)
    two = fd.discretize(
        fd.patterns.simple_fold(1.0, 1.0), SHEET, mass="panel", preset="plate"
    ).mass.diagonal()
    np.testing.assert_allclose(two, RHO * T * np.array([1, 1, 2, 2, 1, 1, 1, 1]) / 5, rtol=1e-14)


def test_centroid_rule():
    np.testing.assert_allclose(shares(RHOMBUS, "centroid"), [1 / 6] * 4 + [1 / 3], rtol=1e-13)
    np.testing.assert_allclose(
        shares(SQUARE, "centroid", scheme="n4b5"), [1 / 3, 1 / 6, 1 / 3, 1 / 6], rtol=1e-13
    )
    # trapezoid 2 over 1, height 1 (area 3/2), center at (1, 2/3): triangles 2/3, 1/3, 1/6, 1/3
    found = shares([[0, 0], [2, 0], [1.5, 1], [0.5, 1]], "centroid")
    expected = np.array([1, 1, 0.5, 0.5, 1.5]) / 3 / 1.5
    np.testing.assert_allclose(found, expected, rtol=1e-13)


@pytest.mark.parametrize("angle", [90, 80, 60, 30, 5])
@pytest.mark.parametrize("rule", ["circumcenter", "mixed_voronoi"])
def test_bisectors_on_any_rhombus_however_turned(angle, rule):
    """Right-angled triangles: half at the center, an eighth at each corner."""
    rng = np.random.default_rng(0)
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    flat = 1e-3 * np.array([[0, 0, 0], [1, 0, 0], [1 + c, s, 0], [c, s, 0]])
    for _ in range(10):
        q = np.linalg.qr(rng.standard_normal((3, 3)))[0]
        found = shares(flat @ q.T + rng.uniform(-1, 1, 3), rule)
        np.testing.assert_allclose(found, [1 / 8] * 4 + [1 / 2], rtol=1e-9)


def test_circumcenter_of_a_triangle_by_areas():
    """Acute triangle: the area nearest to each corner, sampled."""
    triangle = np.array([[0, 0], [1.3, 0], [0.4, 1]])
    found = shares(triangle, "circumcenter")
    w = np.random.default_rng(1).dirichlet(np.ones(3), 200_000)
    nearest = np.linalg.norm((w @ triangle)[:, None] - triangle, axis=2).argmin(axis=1)
    np.testing.assert_allclose(found, np.bincount(nearest) / len(w), atol=5e-3)
    assert found.sum() == pytest.approx(1.0, rel=1e-14)


def test_circumcenter_refuses_obtuse_triangles():
    with pytest.raises(InputError, match=r"panel 0 .*mixed_voronoi"):
        _ = one(OBLIQUE, "circumcenter").mass
    # what it would have given: -1.63 of the panel at two corners (design, trap 5)
    s = one(OBLIQUE, "centroid")
    by_corner = _circumcentric_shares(s.surface)[0] * s.surface.triangle_area[:, None]
    total = np.bincount(s.triangles.ravel(), by_corner.ravel()) / s.surface.triangle_area.sum()
    assert total.sum() == pytest.approx(1.0, rel=1e-12)
    assert total.min() == pytest.approx(-1.63, abs=0.005)
    assert (shares(OBLIQUE, "mixed_voronoi") > 0).all()
    with pytest.raises(InputError, match="circumcenter"):
        _ = fd.discretize(
            fd.patterns.miura(a=1.0, b=4.0), SHEET, mass="circumcenter", preset="plate"
        ).mass


def apex(degrees):
    """Isosceles triangle with legs of 1 and this angle at corner 0."""
    half = np.radians(degrees) / 2
    return [[0, 0], [np.sin(half), -np.cos(half)], [-np.sin(half), -np.cos(half)]][::-1]


def test_circumcenter_refuses_negative_shares_only():
    """Beyond 90 degrees the bisectors still share out; beyond 120 the acute corners owe."""
    base = (2 * np.sin(np.radians(50))) ** 2 / np.tan(np.radians(100)) + 1 / np.tan(np.radians(40))
    expected = base / (8 * np.sin(np.radians(100)) / 2)
    found = sorted(shares(apex(100), "circumcenter"))
    np.testing.assert_allclose(found[:2], expected, rtol=1e-12)
    np.testing.assert_allclose(sorted(shares(apex(120), "circumcenter")), [0, 0, 1], atol=1e-9)
    _ = one(apex(119.99), "circumcenter").mass
    with pytest.raises(InputError, match="mixed_voronoi"):
        _ = one(apex(120.01), "circumcenter").mass
    # the safe rule leaves the bisectors at the first obtuse angle
    np.testing.assert_allclose(shares(apex(100), "mixed_voronoi"), [0.25, 0.25, 0.5], rtol=1e-14)


@pytest.mark.parametrize("seed", range(10))
def test_mixed_voronoi_is_the_circumcenter_rule_without_obtuse_angles(seed):
    rng = np.random.default_rng(seed)
    while True:
        x = rng.uniform(0, 1, (3, 2))
        side = np.sort(((x - np.roll(x, 1, axis=0)) ** 2).sum(axis=1))
        if side[2] < side[0] + side[1]:
            break
    np.testing.assert_allclose(
        shares(x, "mixed_voronoi"), shares(x, "circumcenter"), rtol=1e-12, atol=1e-14
    )


def test_consistent_element():
    m = one([[0, 0], [1, 0], [0, 1]], "consistent").mass.toarray()
    expected = RHO * T * 0.5 / 12 * np.array([[2, 1, 1], [1, 2, 1], [1, 1, 2]])
    np.testing.assert_allclose(m, expected, rtol=1e-14)


# ---------------------------------------------------------------------------- equi-inertial


HEAVY, LIGHT, HUB = 1 / 4, 1 / 36, 4 / 9


def test_equi_inertial_shares_and_orientation():
    """RHOMBUS has its obtuse corners at 1 and 3, ends of the shorter diagonal."""
    turned = np.roll(RHOMBUS, 1, axis=0)
    for shape, rule, first, second in (
        (RHOMBUS, "equi_inertial", LIGHT, HEAVY), (RHOMBUS, "equi_inertial_acute", HEAVY, LIGHT),
        (turned, "equi_inertial", HEAVY, LIGHT),
    ):  # fmt: skip
        found = shares(shape, rule)
        np.testing.assert_allclose(found, [first, second, first, second, HUB], rtol=1e-13)


@pytest.mark.matrix
def test_equi_inertial_tie_goes_to_corners_0_and_2():
    """Diagonals that differ by less than 1e-9 are equal; by more, the shorter one is heavy."""
    for angle in np.linspace(0, 1, 7):  # also where rounding makes one diagonal longer
        q = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        square = np.array(SQUARE) @ q
        for rule, first, second in (
            ("equi_inertial", HEAVY, LIGHT), ("equi_inertial_acute", LIGHT, HEAVY)
        ):  # fmt: skip
            np.testing.assert_allclose(shares(square, rule)[:2], [first, second], rtol=1e-13)
    for longer, first in ((-1e-12, HEAVY), (1e-12, HEAVY), (1e-6, LIGHT)):
        square = np.array(SQUARE, float)
        square[2] += longer
        assert shares(square, "equi_inertial")[0] == pytest.approx(first, rel=1e-9)


def test_equi_inertial_second_moments():
    """On the 60 degree rhombus 1/3 (with the paper's rounded 0.028: 0.336) and 3 times exact."""
    s = one(RHOMBUS, "equi_inertial")
    along = np.array([np.sqrt(3), 1, 0]) / 2  # the longer diagonal
    across = np.array([-along[1], along[0], 0])
    arms, mass = s.nodes - s.nodes[4], s.mass.diagonal()
    # half diagonals p = sqrt(3)/2 and q = 1/2; the rhombus has p^2/6, q^2/6
    for axis, exact, times in ((along, 3 / 4 / 6, 1 / 3), (across, 1 / 4 / 6, 3)):
        found = mass @ (arms @ axis) ** 2 / mass.sum()
        assert found == pytest.approx(exact * times, rel=1e-12)
