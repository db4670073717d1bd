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
from pairwise import beyond

SCALES = [drawn(seed, base) for seed, base in itertools.product(range(3), (4.0, 10.0))]
PATTERNS = {
    "fold": lambda a: fd.patterns.simple_fold(a, 1.2 * a, dihedral=60),
    "miura": lambda a: fd.patterns.miura((2, 1), a, b=1.1 * a, panel_angle=60, dihedral=50),
    "eggbox": lambda a: fd.patterns.eggbox((1, 2), a, b=1.3 * a, panel_angle=75, dihedral=60),
    "kresling": lambda a: fd.patterns.kresling(5, a, height=0.9 * a, twist=30, storeys=2),
    "polygons": lambda a: fd.Pattern(
        a * np.array([[0, 0, 0], [1, 0, 0], [1.4, 0.9, 0], [0.5, 1.5, 0], [-0.4, 0.9, 0],
                      [2.2, 0.1, 0.5], [2.5, 0.8, 0.4]]),
        [[0, 1, 2, 3, 4], [1, 5, 6, 2]],
    ),
}  # fmt: skip


def hold(told, near=1e-11):
    """Hold numbers without dimension, each kind for itself, to those in m, kg and s."""
    one = told(ONE)
    for by in SCALES:
        for found, exact in zip(told(by), one, strict=True):
            found, exact = np.asarray(found, float), np.asarray(exact, float)
            gap = np.abs(found - exact).max(initial=0.0)
            assert gap <= near * np.abs(exact).max(initial=0.0)


def noise(like, size, seed):
    return size * np.random.default_rng(seed).standard_normal(np.shape(like))


@pytest.mark.parametrize("name", PATTERNS)
def test_patterns(name):
    def told(by):
        p = PATTERNS[name](by.length)
        lengths = p.vertices / by.length, p.size / by.length, p.face_areas / by.length**2
        letters = [ord(letter) for letter in p.assignments]
        return *lengths, p.dihedrals, 1.0 + p.face_planarity, letters, np.concatenate(p.faces)

    hold(told)


@pytest.mark.parametrize(("width", "sound"), [(1e-8, True), (1e-12, False)])
def test_panels_that_have_collapsed_are_refused_and_thin_ones_are_not(width, sound):
    for by in (ONE, *SCALES):
        corners = by.length * np.array([[0, 0, 0], [1, 0, 0], [0.5, width, 0]])
        if sound:
            fd.Pattern(corners, [[0, 1, 2]])
        else:
            with pytest.raises(fd.errors.InputError, match="no area"):
                fd.Pattern(corners, [[0, 1, 2]])


@pytest.mark.parametrize(
    ("name", "scheme"),
    [*itertools.product(PATTERNS, ["n5b8"]), *beyond(itertools.product(PATTERNS, ["n4b5"]), 4)],
)
def test_structures(name, scheme):
    def told(by):
        s = fd.discretize(PATTERNS[name](by.length), sheet(by), scheme=scheme)
        u = noise(s.nodes, 0.02 * by.length, 1)
        stiffness = s.fold_stiffness / by.energy, s.bend_stiffness / by.energy
        forces = s.energy(u) / by.energy, s.internal_force(u) / by.force
        return s.bars, s.bends, s.nodes / by.length, s.bar_area / by.length**2, *stiffness, *forces

    hold(told)


@pytest.mark.parametrize(
    ("name", "rule"),
    [
        *itertools.product(["miura"], sorted(MASS_RULES)),
        *beyond(itertools.product(["eggbox"], sorted(MASS_RULES)), 5),
        *itertools.product(["polygons"], ("mixed_voronoi", "inertia_exact")),
    ],
)
def test_mass_rules(name, rule):
    def told(by):
        s = fd.discretize(PATTERNS[name](by.length), sheet(by), mass=rule, preset="plate")
        return [s.mass.toarray() / by.mass]

    hold(told)


@pytest.mark.matrix
def test_selections_of_nodes():
    high = float(miura(ONE).nodes[:, 2].max())

    def told(by):
        texts = "xmin", "ymax or z>0", "zmax", f"z > {0.5 * high * by.length!r}"
        return [resolve_nodes(miura(by), text, "nodes") for text in texts]

    hold(told)


def test_checkers_of_gradients_take_steps_of_the_size_of_the_state():
    for by in (ONE, *SCALES):
        s = miura(by)
        u = noise(s.nodes, 0.02 * by.length, 2)
        assert checks.gradient_error(s.energy, s.internal_force, at=u) < 1e-6
        assert checks.tangent_error(s.internal_force, s.tangent, at=u) < 1e-6
        stiff = fd.discretize(s.pattern, s.sheet, bend_law="linear")
        force, tangent, size = stiff.internal_force, stiff.tangent, 0.01 * by.length
        assert checks.tangent_error(force, tangent, at=np.zeros_like(u), size=size) < 1e-6


def test_shells():
    def told(by):
        s = shell(by)
        u, x = noise(s.nodes, 0.01 * by.length, 3), noise(np.zeros(s.rotations), 0.1, 4)
        pushed, turned = s.forces(u, x)
        forces = pushed / by.force, turned / by.energy
        return s.mass.toarray() / by.mass, s.energy(u, x) / by.energy, *forces, s.balanced(u)

    hold(told)


def test_signals():
    """Peaks and damping of a decaying record and of a response, in any unit of time and value."""
    t = 0.06 * np.arange(100)
    x = np.exp(-0.3 * t) * np.sin(9.0 * t)
    f = np.linspace(0.5, 3.0, 200)
    h = 1.0 / (81.0 - (2 * np.pi * f) ** 2 + 2j * np.pi * f * 0.6)

    def told(by):
        record = x * by.length, 0.06 * by.time
        response = f / by.time, h * by.time**2 / by.mass
        circle = signals.circle_fit(*response)
        frequencies = circle.natural_frequency, *signals.find_peaks(*response).frequency
        found = signals.log_decrement(*record), circle, signals.half_power(*response)
        ratios = [one.damping_ratio for one in found]
        ratios += np.atleast_1d(signals.matrix_pencil(*record).damping_ratio).tolist()
        return [*ratios, *(by.time * one for one in frequencies)]

    hold(told, 1e-6)


@pytest.mark.matrix
def test_names_of_modes():
    def names(by):
        case = fd.Case(miura(by, bend_law="linear"), [fd.Fix([0, 1, 2], "xyz")])
        return character(fd.modes(case, 5), "x")["name"].values.tolist()

    assert [names(by) for by in SCALES] == [names(ONE)] * len(SCALES)


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
