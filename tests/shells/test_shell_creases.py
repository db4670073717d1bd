"""Creases: exact moments about the moving fold, their stiffness, their rest, their order."""

from __future__ import annotations

import numpy as np
import pytest
from shell_lab import at_rest, dofs, equilibrium, split

import foldyn as fd
from foldyn.checks import observed_order
from foldyn.shells import shell

PAPER = fd.Sheet(1e6, 0.25, 0.01, density=1.0)
STIFF = fd.Sheet(1e12, 0.25, 0.01, density=1.0)
K = 0.7  # N m/rad per m
LENGTH = 1.3
REST = 120.0
THETA1, THETA2 = np.radians([60.0, 310.0])


def linear(theta, rest):
    return theta - rest, 0.5 * (theta - rest) ** 2


def superlinear(theta, rest):
    d = theta - rest
    return np.sign(d) * abs(d) ** (4 / 3), 3 / 7 * abs(d) ** (7 / 3)


def enhanced(theta, rest):
    """The law as published, for a rest angle between theta1 and theta2 (design, section 5)."""
    if theta < THETA1:
        p = np.pi / THETA1
        moment = THETA1 - rest + np.tan(0.5 * p * (theta - THETA1)) / (0.5 * p)
        energy = 0.5 * (rest - THETA1) ** 2 + (rest - THETA1) * (THETA1 - theta)
        return moment, energy - 4 / p**2 * np.log(np.cos(0.5 * p * (THETA1 - theta)))
    if theta > THETA2:
        p = np.pi / (2 * np.pi - THETA2)
        moment = THETA2 - rest + np.tan(0.5 * p * (theta - THETA2)) / (0.5 * p)
        energy = 0.5 * (THETA2 - rest) ** 2 + (THETA2 - rest) * (theta - THETA2)
        return moment, energy - 4 / p**2 * np.log(np.cos(0.5 * p * (theta - THETA2)))
    return linear(theta, rest)


def enhanced_from(rest, theta, stress_free):
    """The law for any rest angle: shifted from one between theta1 and theta2."""
    middle = np.pi
    moment, energy = enhanced(theta, middle)
    moment_0, energy_0 = enhanced(rest, middle)
    if stress_free:  # neither moment nor energy at rest
        return moment - moment_0, energy - energy_0 - moment_0 * (theta - rest)
    # moments differ by a constant, d = middle - rest
    return moment + (middle - rest), energy + (middle - rest) * theta


LAWS = {
    "linear": ("linear", linear),
    "superlinear": ("superlinear", superlinear),
    "enhanced as published": (fd.EnhancedLinear(60, 310, rest="as_published"), enhanced),
    "enhanced stress free": (fd.EnhancedLinear(60, 310, rest="stress_free"), enhanced),
}


def folded(theta):
    """Positions (6, 3) of a fold of two rectangles of LENGTH at the dihedral theta (rad)."""
    half = 0.5 * theta
    arm = np.array([np.sin(half), 0.0, np.cos(half)])  # opens upward: a valley below pi
    along = np.array([0.0, LENGTH, 0.0])
    left, right = arm * [-1, 1, 1], arm
    return np.array([left, left + along, 0 * along, along, right, right + along])


FACES = [[0, 2, 3, 1], [2, 4, 5, 3]]


def fold_of(sheet, law, rest=REST, start=REST, divisions=3, **options):
    pattern = fd.Pattern(folded(np.radians(start)), FACES)
    return shell(pattern, sheet, divisions=divisions, fold_law=law, crease_stiffness=K,
                 crease_rest=rest, **options)  # fmt: skip


def rigid_fold(s, start, theta):
    """Displacement of all nodes as the panels turn rigidly to the dihedral theta (rad)."""
    old, new = folded(start), folded(theta)
    u = np.empty_like(s.nodes)
    for n, x in enumerate(s.nodes):
        side = 0 if x[0] < 0 else 4
        arm = np.linalg.norm([x[0], x[2]])
        u[n] = arm * new[side] + [0, x[1], 0] - x
    assert u[:6] == pytest.approx(new - old, abs=1e-15)
    return u


# ------------------------------------------------------------------ rigid folding


@pytest.mark.parametrize("law", sorted(LAWS))
@pytest.mark.parametrize("degrees", [45, 59, 100, 120, 180, 240, 311, 315])
def test_rigid_folding_through_270_degrees(law, degrees):
    """Energy k L w(theta), and moment k L m(theta) on either panel about the crease."""
    given, formula = LAWS[law]
    s, theta, rest = fold_of(PAPER, given), np.radians(degrees), np.radians(REST)
    u, x = rigid_fold(s, rest, theta), np.zeros(s.rotations)
    moment, energy = formula(theta, rest)
    found = s.energies(u, x)
    assert found["strain_folds"] == pytest.approx(K * LENGTH * energy, rel=1e-12, abs=1e-24)
    assert found["strain_membrane"] + found["strain_bending"] < 1e-24
    force, couple = s.forces(u, x)
    # each rotation lets its sheet give way to the moment of its piece of the crease
    pieces = s.sides.piece_rotations.ravel()
    assert couple[pieces] == pytest.approx(
        np.full(6, -K * LENGTH / 3 * moment), rel=1e-11, abs=1e-13
    )
    others = np.setdiff1d(np.arange(s.rotations), pieces)
    assert np.abs(couple[others]).max() < 1e-14
    for side in (-1.0, 1.0):  # opening turns the right panel about +y
        panel = np.sign(s.nodes[:, 0]) == side
        about_y = np.cross((s.nodes + u)[panel], force[panel]).sum(axis=0)[1]
        assert side * about_y == pytest.approx(K * LENGTH * moment, rel=1e-9, abs=1e-11)


@pytest.mark.parametrize("rest", [40.0, 330.0])
@pytest.mark.parametrize("law", ["enhanced as published", "enhanced stress free"])
def test_rest_angles_beyond_the_linear_range(law, rest):
    s = fold_of(PAPER, LAWS[law][0], rest=rest)
    free = law == "enhanced stress free"
    start, values = np.radians(REST), []
    for degrees in (45, rest, 200, 320):
        theta = np.radians(degrees)
        moment, energy = enhanced_from(np.radians(rest), theta, free)
        u, x = rigid_fold(s, start, theta), np.zeros(s.rotations)
        couple = s.forces(u, x)[1][s.sides.piece_rotations.ravel()]
        assert couple == pytest.approx(np.full(6, -K * LENGTH / 3 * moment), rel=1e-10, abs=1e-13)
        values.append((s.energy(u, x), K * LENGTH * energy))
    found, expected = np.array(values).T
    assert found - found[1] == pytest.approx(expected - expected[1], rel=1e-10)  # from rest
    if free:
        assert abs(found[1]) < 1e-15


# ------------------------------------------------------------------ along the crease


def test_the_stiffness_of_a_crease_is_that_of_the_calibration():
    """1/kf = Ls/G + 1/(0.55 G (Lf/t)^(1/3)): 0.06387 N m/rad (design, section 5)."""
    s = shell(fd.patterns.simple_fold(1.0, 1.0, dihedral=60), PAPER, divisions=5)
    assert s.fold_stiffness == pytest.approx([0.06387], abs=5e-6)
    assert s.model.fold_stiffness == pytest.approx(np.full(5, s.fold_stiffness[0] / 5))
    bars = fd.discretize(fd.patterns.miura(a=1.0, b=1.4), PAPER, preset="herkal")
    sheet = shell(fd.patterns.miura(a=1.0, b=1.4), PAPER, divisions=4)
    assert sheet.fold_stiffness == pytest.approx(bars.fold_stiffness, rel=1e-13)
    whole = np.bincount(sheet.sides.piece_crease, sheet.model.fold_stiffness)
    assert whole == pytest.approx(bars.fold_stiffness, rel=1e-13)


def test_stiffness_and_rest_of_each_crease_go_to_that_crease():
    """Energy at rest sum k L (theta - rest)^2 / 2 with numbers that are all different."""
    pattern = fd.patterns.miura(cells=(2, 1), a=1.0, b=1.3, dihedral=100)
    count = len(pattern.creases)
    k, rest = 0.1 + np.arange(count), 150.0 + 3.0 * np.arange(count)
    s = shell(pattern, PAPER, divisions=2, fold_law="linear", crease_stiffness=k, crease_rest=rest)
    ends = pattern.vertices[pattern.creases]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    each = 0.5 * k * length * (pattern.dihedrals - np.radians(rest)) ** 2
    zero = np.zeros(s.rotations)
    assert s.energies(0 * s.nodes, zero)["strain_folds"] == pytest.approx(each.sum(), rel=1e-12)
    # one crease at a time, which also tells their order
    for crease in (0, count // 2, count - 1):
        alone = np.where(np.arange(count) == crease, k, 0.0)
        one = shell(
            pattern, PAPER, divisions=2, fold_law="linear", crease_stiffness=alone, crease_rest=rest
        )
        found = one.energies(0 * s.nodes, zero)["strain_folds"]
        assert found == pytest.approx(each[crease], rel=1e-12)


def test_panels_that_are_not_flat_rest_as_they_are():
    points = [[0, 0, 0], [1, 0, 0.2], [2, 0, 0], [0, 1, 0.3], [1, 1.1, 0], [2, 0.9, 0.4]]
    s = shell(fd.Pattern(points, [[0, 1, 4, 3], [1, 2, 5, 4]]), PAPER, divisions=4)
    assert np.ptp(s.piece_rest) > 0.01  # the dihedral changes along the crease
    assert s.energy(0 * s.nodes, np.zeros(s.rotations)) < 1e-25
    given = shell(s.pattern, PAPER, divisions=4, crease_rest=170)
    assert given.piece_rest == pytest.approx(np.full(4, np.radians(170)))


def test_bent_panels_and_crease_give_way_in_series():
    """A flat fold on two supports, a force on its crease: m / 2K + m / 3D with arms of 1, nu = 0.

    m is the moment per length at the crease, which falls to nothing at the supports.
    """
    sheet, force = fd.Sheet(1e6, 0.0, 0.01), 1e-6
    found, cells = [], np.array([4, 8, 16])
    for n in cells:
        s = fold_of(sheet, "linear", rest=180.0, start=180.0, divisions=int(n))
        ridge = np.flatnonzero(np.abs(s.nodes[:, 0]) < 1e-12)
        share = np.where(ridge < 6, 0.5, 1.0)  # its ends are vertices
        load = at_rest(s)
        load[dofs(ridge, "z")] = -force * share / share.sum()
        outer = np.flatnonzero(np.abs(s.nodes[:, 0]) > 1 - 1e-12)
        held = np.concatenate([dofs(outer, "z"), dofs([2], "xy"), dofs([3], "x")])
        q = equilibrium(s, at_rest(s), load, held, tolerance=1e-13)
        found.append(-split(s, q)[0][ridge, 2].mean() / force)
    moment = 0.5 / LENGTH
    exact = moment / (2.0 * K) + moment / (3.0 * sheet.bending_modulus)
    assert found[-1] == pytest.approx(exact, rel=5e-3)
    assert observed_order(1.0 / cells, np.array(found) - exact) == pytest.approx(2.0, abs=0.1)
