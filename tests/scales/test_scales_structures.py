"""Patterns, structures, their mass and what is read of them do not depend on the units."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from units import ONE, drawn, fold, in_units, largest_difference, miura, sheet, shell

import foldyn as fd
from foldyn import checks, signals
from foldyn.cases import resolve_nodes
from foldyn.linear.character import character
from foldyn.structures.mass import MASS_RULES

SCALES = [drawn(seed, base) for seed, base in itertools.product(range(3), (4.0, 10.0))]
PATTERNS = {
    "fold": lambda a: fd.patterns.simple_fold(a, 1.2 * a, 60),
    "miura": lambda a: fd.patterns.miura((2, 1), a, 1.1 * a, 60, 50),
    "eggbox": lambda a: fd.patterns.eggbox((1, 2), a, 1.3 * a, 75, 60),
    "kresling": lambda a: fd.patterns.kresling(5, a, 0.9 * a, 30, 2),
    "polygons": lambda a: fd.Pattern(
        a * np.array([[0, 0, 0], [1, 0, 0], [1.4, 0.9, 0], [0.5, 1.5, 0], [-0.4, 0.9, 0],
                      [2.2, 0.1, 0.5], [2.5, 0.8, 0.4]]),
        [[0, 1, 2, 3, 4], [1, 5, 6, 2]],
    ),
}  # fmt: skip


def close(found, exact, unit=1.0):
    """Whether numbers with a unit are those of the structure in m, kg and s."""
    exact = np.asarray(exact)
    gap = np.abs(np.asarray(found) / unit - exact).max(initial=0.0)
    return gap <= 1e-11 * np.abs(exact).max(initial=0.0)


@pytest.mark.parametrize("name", PATTERNS)
def test_patterns(name):
    one = PATTERNS[name](1.0)
    for by in SCALES:
        other = PATTERNS[name](by.length)
        assert other.assignments == one.assignments and other.faces == one.faces
        assert close(other.vertices, one.vertices, by.length)
        assert close(other.face_areas, one.face_areas, by.length**2)
        assert close(other.dihedrals, one.dihedrals)
        assert np.abs(other.face_planarity - one.face_planarity).max() < 1e-14
        assert close(other.size, one.size, by.length)


def test_panels_that_have_collapsed_are_refused_and_thin_ones_are_not():
    for by in (ONE, *SCALES):
        for width, sound in ((1e-8, True), (1e-12, False)):
            corners = by.length * np.array([[0, 0, 0], [1, 0, 0], [0.5, width, 0]])
            if sound:
                fd.Pattern(corners, [[0, 1, 2]])
            else:
                with pytest.raises(fd.errors.InputError, match="no area"):
                    fd.Pattern(corners, [[0, 1, 2]])


@pytest.mark.parametrize("scheme", ["n5b8", "n4b5"])
@pytest.mark.parametrize("name", PATTERNS)
def test_structures(name, scheme):
    one = fd.discretize(PATTERNS[name](1.0), sheet(ONE), scheme=scheme)
    for by in SCALES:
        s = fd.discretize(PATTERNS[name](by.length), sheet(by), scheme=scheme)
        assert np.array_equal(s.bars, one.bars) and np.array_equal(s.bends, one.bends)
        assert close(s.nodes, one.nodes, by.length)
        assert close(s.bar_area, one.bar_area, by.length**2)
        assert close(s.fold_stiffness, one.fold_stiffness, by.energy)
        assert close(s.bend_stiffness, one.bend_stiffness, by.energy)
        u = 0.02 * np.random.default_rng(1).standard_normal(one.nodes.shape)
        assert close(s.energy(u * by.length), one.energy(u), by.energy)
        assert close(s.internal_force(u * by.length), one.internal_force(u), by.force)


@pytest.mark.parametrize(
    ("name", "rule"),
    [
        *((name, rule) for name in ("miura", "eggbox") for rule in sorted(MASS_RULES)),
        *(("polygons", rule) for rule in ("mixed_voronoi", "inertia_exact")),
    ],
)
def test_mass_rules(name, rule):
    def mass(by):
        return fd.discretize(PATTERNS[name](by.length), sheet(by), mass=rule).mass.toarray()

    for by in SCALES:
        assert close(mass(by), mass(ONE), by.mass)


def test_selections_of_nodes():
    def chosen(text, by):
        s = miura(by)
        return resolve_nodes(s, text, "nodes").tolist()

    high = float(miura(ONE).nodes[:, 2].max())
    for by in SCALES:
        for text in ("xmin", "ymax or z>0", "zmax"):
            assert chosen(text, by) == chosen(text, ONE)
        assert chosen(f"z > {0.5 * high * by.length!r}", by) == chosen(f"z > {0.5 * high}", ONE)


def test_checkers_of_gradients_take_steps_of_the_size_of_the_state():
    for by in (ONE, *SCALES):
        s = miura(by)
        u = 0.02 * by.length * np.random.default_rng(2).standard_normal(s.nodes.shape)
        assert checks.gradient_error(s.energy, s.internal_force, u) < 1e-6
        assert checks.tangent_error(s.internal_force, s.tangent, u) < 1e-6
        rest = np.zeros_like(u)
        stiff = fd.discretize(s.pattern, s.sheet, bend_law="linear")
        size = 0.01 * by.length
        error = checks.tangent_error(stiff.internal_force, stiff.tangent, rest, size=size)
        assert error < 1e-6


def test_shells():
    one = shell(ONE)
    u = 0.01 * np.random.default_rng(3).standard_normal(one.nodes.shape)
    x = 0.1 * np.random.default_rng(4).standard_normal(one.rotations)
    for by in SCALES:
        s = shell(by)
        assert close(s.mass.toarray(), one.mass.toarray(), by.mass)
        assert close(s.energy(u * by.length, x), one.energy(u, x), by.energy)
        for found, exact, unit in zip(
            s.forces(u * by.length, x), one.forces(u, x), (by.force, by.energy), strict=True
        ):
            assert close(found, exact, unit)
        assert close(s.balanced(u * by.length), one.balanced(u))


def test_signals():
    """Peaks and damping of a decaying record and of a response, in any unit of time and value."""
    t = 0.06 * np.arange(100)
    x = np.exp(-0.3 * t) * np.sin(9.0 * t)
    f = np.linspace(0.5, 3.0, 200)
    h = 1.0 / (81.0 - (2 * np.pi * f) ** 2 + 2j * np.pi * f * 0.6)

    def told(by):
        decay = signals.log_decrement(x * by.length, 0.06 * by.time)
        modes = signals.matrix_pencil(x * by.length, 0.06 * by.time)
        peaks = signals.find_peaks(f / by.time, h * by.time**2 / by.mass)
        circle = signals.circle_fit(f / by.time, h * by.time**2 / by.mass)
        power = signals.half_power(f / by.time, h * by.time**2 / by.mass)
        numbers = [decay.damping_ratio, *np.atleast_1d(modes.damping_ratio)]
        numbers += [circle.damping_ratio, circle.natural_frequency * by.time, power.damping_ratio]
        return np.array([*numbers, *(np.atleast_1d(peaks.frequency) * by.time)])

    one = told(ONE)
    for by in SCALES:
        assert np.abs(told(by) / one - 1.0).max() < 1e-6


def test_names_of_modes():
    def names(by):
        case = fd.Case(miura(by, bend_law="linear"), [fd.Fix([0, 1, 2], "xyz")])
        found = fd.modes(case, 5)
        return character(found, "x")["name"].values.tolist()

    for by in SCALES:
        assert names(by) == names(ONE)


def test_the_helper_sees_a_unit_that_is_left_out():
    """What these tests compare by does depend on the numbers."""
    by = drawn(0)

    def found(by):
        return fd.modes(fd.Case(fold(by, bend_law="linear"), [fd.Fix([4, 5], "xyz")]), 3)

    one, other = in_units(found(ONE), ONE), found(by)
    assert largest_difference(one, in_units(other, by))[0] < 1e-6
    for unit in ("mass", "time"):
        wrong = dataclasses.replace(by, **{unit: 1.001 * getattr(by, unit)})
        assert largest_difference(one, in_units(other, wrong))[0] > 1e-4
