"""Imperfect patterns: a column's deflection beside its closed form, random fields, bad input."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError

CELLS, LENGTH, WIDTH, THICKNESS = 8, 1.0, 0.1, 0.004
SHEET = fd.Sheet(1e9, 0.0, THICKNESS)


def column():
    x = np.linspace(0.0, LENGTH, CELLS + 1)
    vertices = [(a, y, 0.0) for a in x for y in (0.0, WIDTH)]
    faces = [(2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1) for k in range(CELLS)]
    welds = [(2 * k, 2 * k + 1) for k in range(1, CELLS)]
    return fd.Pattern(vertices, faces, welds=welds)


def pressed(pattern, force):
    held = [fd.Fix([0, 1], "xz"), fd.Fix([2 * CELLS, 2 * CELLS + 1], "z"), fd.Fix([0], "y")]
    shell = fd.shell(pattern, SHEET, divisions=4)
    return fd.Case(shell, held, [fd.LineLoad("xmax", (-force / WIDTH, 0.0, 0.0))])


@pytest.mark.matrix
def test_an_imperfect_column_bends_from_the_start():
    """Deflection a/(1 - P/P_E) of an Euler column with the first sine wave of amplitude a."""
    euler = np.pi**2 * 1e9 * WIDTH * THICKNESS**3 / 12.0 / LENGTH**2
    perfect = column()
    buckling = fd.buckling(pressed(perfect, euler), 1)
    assert float(buckling.load_factor[0]) == pytest.approx(1.0, rel=0.01)
    a = 1e-3 * LENGTH
    made = fd.imperfect(perfect, a, shapes=buckling)
    rise = made.vertices[CELLS, 2]
    assert abs(rise) == pytest.approx(a, rel=1e-9)
    shell = pressed(made, 1.0).structure
    assert shell.energy(np.zeros_like(shell.nodes)) == 0.0  # free of stress
    path = fd.trace(pressed(made, euler), load_factors=[0.25, 0.5])
    for share, moved in zip((0.25, 0.5), path.displacement.sel(node=CELLS, axis="z"), strict=False):
        critical = float(buckling.load_factor[0])
        assert rise + float(moved) == pytest.approx(rise / (1.0 - share / critical), rel=0.01)


@pytest.mark.matrix
def test_random_fields_have_their_amplitude_and_length():
    pattern = fd.patterns.miura(cells=(6, 6), a=0.1, b=0.1, panel_angle=80, dihedral=175)
    rms, near, far = [], [], []
    for seed in range(60):
        moved = fd.imperfect(pattern, 1e-3, correlation=0.2, seed=seed).vertices - pattern.vertices
        height = moved[:, 2]
        rms.append((moved**2).sum(axis=1).mean())
        near.append(height[40] * height[41])
        far.append(height[0] * height[-1])
    assert np.sqrt(np.mean(rms)) == pytest.approx(1e-3, rel=0.1)
    apart = np.linalg.norm(pattern.vertices[40] - pattern.vertices[41])
    expected = 1e-6 * np.exp(-0.5 * (apart / 0.2) ** 2)
    assert np.mean(near) == pytest.approx(expected, rel=0.4)
    assert abs(np.mean(far)) < 0.4e-6
    one, other = (fd.imperfect(pattern, 1e-3, correlation=0.2, seed=4) for _ in range(2))
    np.testing.assert_array_equal(one.vertices, other.vertices)
    assert one.families.keys() == pattern.families.keys()


def test_shapes_add_up():
    pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60)
    one, two = np.zeros((2, len(pattern.vertices), 3))
    one[0, 2], two[1, 0] = 3.0, -2.0
    moved = fd.imperfect(pattern, [0.1, 0.2], shapes=[one, two]).vertices - pattern.vertices
    np.testing.assert_allclose(moved[0], [0.0, 0.0, 0.1], atol=1e-15)
    np.testing.assert_allclose(moved[1], [-0.2, 0.0, 0.0], atol=1e-15)


def test_what_is_refused():
    pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60)
    shape = np.ones((len(pattern.vertices), 3))
    for message, arguments in (
        ("shapes: give shapes, or the correlation", {"amplitude": 0.1}),
        ("give shapes, or", {"amplitude": 0.1, "shapes": shape, "correlation": 1.0}),
        ("one for each of 1 shapes", {"amplitude": [0.1, 0.2], "shapes": shape}),
        ("moves no vertex", {"amplitude": 0.1, "shapes": 0.0 * shape}),
        (r"displacements of the 6 vertices", {"amplitude": 0.1, "shapes": shape[:3]}),
        ("correlation = 0", {"amplitude": 0.1, "correlation": 0}),
        ("seed = -1", {"amplitude": 0.1, "correlation": 1.0, "seed": -1}),
    ):
        with pytest.raises(InputError, match=message):
            fd.imperfect(pattern, **arguments)
    structure = fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.01, 1.0))
    modes = fd.modes(fd.Case(structure, [fd.Fix([4, 5])]), 2)
    with pytest.raises(InputError, match=r"modes: 3 is not there; there are modes \[1, 2\]"):
        fd.imperfect(structure, 0.1, shapes=modes, modes=3)
    thick = fd.thicken(fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=180), 0.05)
    with pytest.raises(InputError, match=r"before fd\.thicken"):
        fd.imperfect(thick, 0.1, correlation=1.0)
