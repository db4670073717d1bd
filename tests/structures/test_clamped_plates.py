"""Clamped edges of panels as plates, the scheme n5b8e: beside textbooks and the shell."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

import foldyn as fd
from foldyn.structures.condensed_panel import panel_mass
from foldyn.structures.panel_plate import outline
from named_models import named
from pairwise import beyond

SHEET = fd.Sheet(1e6, 0.3, 0.01, density=100.0)
MIURA = fd.patterns.miura(cells=(1, 1), panel_angle=60, dihedral=80)
FORMS = {
    "square": ([[0, 0], [1, 0], [1, 1], [0, 1]], (0, 3), [1, 2]),
    "wide": ([[0, 0], [0.5, 0], [0.5, 1], [0, 1]], (0, 3), [1, 2]),
    "skew": ([[0, 0], [1, 0.5], [1, 1.5], [0, 1]], (0, 3), [1, 2]),
    "triangle": ([[0, 0], [1, 0.5], [0, 1]], (0, 2), [1]),
}


def plate(form: str) -> tuple[fd.Pattern, tuple[int, int], list[int]]:
    """A panel, the edge at which it is clamped, and its other corners."""
    corners, edge, tips = FORMS[form]
    return fd.Pattern(np.c_[corners, np.zeros(len(corners))], [range(len(corners))]), edge, tips


def clamped(pattern=MIURA, edges="xmin", sheet=SHEET, **options):
    return fd.discretize(pattern, sheet, preset="n5b8e", clamped=edges, **options)


def extrapolated(found):
    """Of meshes with 8 and 12 divisions, by their order 2."""
    coarse, fine = (np.asarray(found(n)) for n in (8, 12))
    return fine + (fine - coarse) * 64 / (144 - 64)


@pytest.mark.matrix
@pytest.mark.parametrize("form", FORMS)
def test_a_clamped_panel_bends_as_the_shell(form):
    pattern, edge, tips = plate(form)
    load = [fd.Force(tips, (0, 0, 1e-6 / len(tips)))]

    def deflection(s):
        path = fd.trace(fd.Case(s, [fd.Fix(list(edge))], load))
        return path.displacement.values[-1][tips, 2].mean()

    shell = extrapolated(
        lambda n: deflection(fd.shell(pattern, SHEET, divisions=n, clamped=[edge]))
    )
    assert deflection(clamped(pattern, [edge])) == pytest.approx(float(shell), rel=3e-3)


@pytest.mark.parametrize(
    ("dihedral", "thickness"), beyond(product([60, 110, 150], [1e-3, 3e-4]), 6)
)
def test_a_clamped_miura_sheet_vibrates_as_the_shell(dihedral, thickness):
    """Creases that end at the clamp are straight in the model, and bend a little in the shell."""
    pattern = fd.patterns.miura(cells=(2, 2), a=0.04, b=0.04, panel_angle=60, dihedral=dihedral)
    sheet, held = fd.Sheet(2e11, 0.3, thickness, density=7850.0), [fd.Fix("xmin")]

    def frequencies(n):
        shell = fd.shell(
            pattern, sheet, divisions=n, mass="consistent", clamped="xmin", vertex_radius=thickness
        )
        return fd.modes(fd.Case(shell, held), 4).frequency.values

    found = fd.modes(fd.Case(clamped(pattern, sheet=sheet), held), 4).frequency.values
    np.testing.assert_allclose(found, extrapolated(frequencies), rtol=0.035)


@pytest.mark.matrix
def test_a_clamped_bilayer_curls_as_the_shell():
    """The clamp keeps both from curling across it."""
    vertices = [[0.1 * i, 0.1 * j, 0.0] for i in range(5) for j in (0, 1)]
    strip = fd.Pattern(vertices, [[2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1] for i in range(4)])
    thin, load = fd.Sheet(1e9, 0.3, 4e-4), fd.Temperature(1.0, curvature=0.05)
    options = {"fold_law": "linear", "crease_stiffness": 1e3, "clamped": "xmin"}
    plates = fd.discretize(strip, thin, preset="n5b8e", **options)
    found, wanted = (
        fd.trace(fd.Case(s, [fd.Fix("xmin")], [load]), load_factors=[1.0]).displacement[-1, 8, 2]
        for s in (plates, fd.shell(strip, thin, divisions=8, **options))
    )
    assert float(found) == pytest.approx(float(wanted), rel=0.01)


@pytest.mark.matrix
def test_a_panel_is_level_at_its_clamped_edge():
    """Its mass follows a cantilever: 33/140 at the tip of a beam; shifts have all of it."""
    x = np.array([[0, 0, 0], [4, 0, 0], [4, 1, 0], [0, 1.0, 0]])
    held, turned = (
        panel_mass(outline(x, x.mean(axis=0), c, c, clamped=c), 0.0)
        for c in ([False, False, False, True], [False] * 4)
    )
    tip = np.array([0, 1.0, 1.0, 0, 5 / 16])  # s^2 (3 - s) / 2
    assert tip @ held @ tip == pytest.approx(33 / 140, rel=3e-3)
    np.testing.assert_allclose([m.sum() for m in (held, turned)], 1.0, rtol=1e-12)
    across = np.append(x[:, 1], 0.5)
    assert across @ held @ across == pytest.approx(1 / 3, rel=1e-12)
    s, free = clamped(), fd.discretize(MIURA, SHEET, preset="n5b8e")
    assert s.total_mass == pytest.approx(free.total_mass, rel=1e-12)
    assert abs(s.mass - free.mass).max() > 1e-3 * s.total_mass


def test_rigid_panels_turn_at_a_clamped_edge_as_those_of_the_default():
    options = {"rigid": "all", "mass": "consistent", "membrane": "bars"}
    found, expected = (
        fd.modes(fd.Case(s, [fd.Fix("xmin")]), 2).frequency.values
        for s in (clamped(**options), fd.discretize(MIURA, SHEET, clamped="xmin", **named(options)))
    )
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    assert not clamped(rigid="all").surface.clamped


@pytest.mark.matrix
def test_explicit_and_implicit_motions_are_alike():
    load = fd.Force([6, 7, 8], (0, 0, 5e-3), fd.HalfSine(0.2))
    case = fd.Case(clamped(), [fd.Fix("xmin")], [load], fd.Rayleigh(0.1))
    ends = []
    for method in ("central_difference", "generalized_alpha", "energy_momentum"):
        motion = fd.simulate(case, 0.5, method=method, interval=0.05)
        stored = sum(motion[k] for k in motion if k == "kinetic" or k.startswith("strain"))
        gap = stored + motion.dissipated - motion.work
        assert float(np.abs(gap).max()) < 2e-3 * float(np.abs(motion.work).max())
        ends.append(motion.displacement.values)
    for end in ends[1:]:
        np.testing.assert_allclose(end, ends[0], atol=5e-3 * np.abs(ends[0]).max())
