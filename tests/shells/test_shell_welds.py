"""Shells with welds: a sheet does not feel the lines drawn on it."""

import numpy as np
import pytest

import foldyn as fd
from foldyn import checks
from foldyn.errors import InputError
from sheets_with_facets import (
    FREE_BEAM,
    LENGTH,
    STEEL,
    cut_across,
    elastic,
    half_pipe,
    triangulated,
    uncut,
    with_lines,
)

CUTS = {
    "across": (cut_across([0.5]), 8),
    "near an end": (cut_across([0.07]), 12),
    "ten times": (cut_across(np.linspace(0.1, 0.9, 9)), 8),
    "diagonal": (with_lines([(0, 0), (1, 1)]), 16),
    "along": (with_lines([(0, 0.5), (1, 0.5)]), 12),
    "oblique": (with_lines([(0.35, 0), (0.55, 1)]), 8),
    "triangles": (triangulated(20, seed=2), 8),
}


@pytest.fixture(scope="module")
def whole():
    return elastic(fd.shell(uncut(), STEEL, divisions=16, mass="consistent"))


def test_uncut_strip_is_a_beam(whole):
    assert whole[0] == pytest.approx(FREE_BEAM, rel=0.005)


@pytest.mark.parametrize("name", CUTS)
def test_facets_anywhere_leave_frequencies(name, whole):
    pattern, divisions = CUTS[name]
    lines = fd.welded(pattern, join=False)
    cut = elastic(fd.shell(lines, STEEL, divisions=divisions, mass="consistent"))
    assert cut[0] == pytest.approx(whole[0], rel=0.005)
    rough = name == "triangles"  # some of them narrow: 0.5 % with 16 divisions
    np.testing.assert_allclose(cut[:3], whole[:3], rtol=0.012 if rough else 0.005)


def test_hinges_do_not(whole):
    made = fd.shell(cut_across([0.5]), STEEL, divisions=8, mass="consistent")
    assert elastic(made)[0] < 0.8 * whole[0]


@pytest.mark.matrix
def test_large_bending_of_a_cantilever():
    """A tip force that lifts the strip by an eighth of its length, as without lines."""
    tips = {}
    for pattern, divisions in ((uncut(), 8), (fd.welded(cut_across([0.3, 0.6])), 4)):
        n = len(pattern.vertices) // 2
        made = fd.shell(pattern, STEEL, divisions=divisions, clamped=[(0, n)])
        force = fd.Force([n - 1, 2 * n - 1], (0.0, 0.0, 4.0))
        moved = fd.trace(fd.Case(made, [fd.Fix([0, n])], [force])).displacement.values[-1]
        tips[divisions] = moved[n - 1]
    assert tips[8][2] > LENGTH / 9
    np.testing.assert_allclose(tips[4][[0, 2]], tips[8][[0, 2]], rtol=0.005)


def test_energy_force_and_tangent():
    made = fd.shell(fd.welded(half_pipe(4)), STEEL, divisions=2)
    body, rng = made.body, np.random.default_rng(1)
    q = 1e-3 * rng.standard_normal(body.size)
    assert checks.gradient_error(lambda z: body.energies(z).sum(), body.internal, at=q) < 1e-6
    assert checks.tangent_error(body.internal, body.tangent, at=q) < 1e-6


@pytest.mark.matrix
def test_a_curved_sheet_of_facets():
    """Facets of a pipe converge to it, whatever their number, and need not lie in one plane."""
    coarse, fine = (
        elastic(fd.shell(fd.welded(half_pipe(n)), STEEL, divisions=d, mass="consistent"))
        for n, d in ((6, 6), (12, 6))
    )
    np.testing.assert_allclose(coarse[:2], fine[:2], rtol=0.02)
    hinged = elastic(fd.shell(half_pipe(6), STEEL, divisions=6, mass="consistent"))
    assert hinged[0] < 0.6 * fine[0]


def test_rigid_panels_at_a_weld():
    pattern = fd.welded(cut_across([0.5]))
    for make in (fd.shell, fd.discretize):
        with pytest.raises(InputError, match="rigid: panel 1 is welded to another at"):
            make(pattern, STEEL, rigid=[1])
