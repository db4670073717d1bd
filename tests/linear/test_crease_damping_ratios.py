"""Damping ratios of modes with damped creases beside the shell's, over four decades of stiffness.

With tau = c / k a mode of omega has the ratio s tau omega / 2, s the share of the creases in its
strain energy.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import foldyn as fd
from foldyn.algebra.extrapolation import convergence
from foldyn.linear import linearize
from pairwise import in_pairs

SHEET = fd.Sheet(youngs_modulus=1e6, poissons_ratio=0.25, thickness=0.01, density=1.0)
PATTERNS = {
    "fold": fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=120),
    "cell": fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=120),
}
CALIBRATED = 0.0639  # N m/rad per m, of creases of this sheet
TAU = 1e-3  # s
MESHES = 4, 8, 16


def first_mode(kind, pattern, k, held=True, rigid=None, **options):
    """Damping ratio of the first elastic mode, and the share of the creases in its energy.

    kind : preset, "superelements", or the divisions of a shell.
    """
    options = {"crease_stiffness": k, "fold_law": "linear", "rigid": rigid, **options}
    if isinstance(kind, int):
        s = fd.shell(PATTERNS[pattern], SHEET, divisions=kind, mass="consistent", **options)
    elif kind == "superelements":
        s = fd.superelements(PATTERNS[pattern], SHEET, **options)
    else:
        s = fd.discretize(PATTERNS[pattern], SHEET, preset=kind, **options)
    supports = [fd.Fix(list(s.pattern.faces[0]))] if held else []
    case = fd.Case(s, supports, damping=fd.CreaseDamping(TAU * k))
    modes = fd.modes(case, count=1 if held else 7)
    ratio, frequency = float(modes.damping_ratio[-1]), float(modes.frequency[-1])
    return ratio, ratio / (TAU * np.pi * frequency)


@cache
def of_shell(*arguments):
    """The same of a shell, as its meshes converge."""
    return convergence([first_mode(n, *arguments) for n in MESHES], MESHES).limit


@pytest.mark.matrix
@pytest.mark.parametrize("times", [0.01, 1.0, 100.0])
@pytest.mark.parametrize("pattern", PATTERNS)
def test_between_rigid_panels(pattern, times):
    """Any stiffness: the creases have all of the energy; herkal's mass is another one."""
    k = times * CALIBRATED
    wanted, _ = of_shell(pattern, k, True, "all")
    for kind in ("plate", "n5b8e"):
        ratio, share = first_mode(kind, pattern, k, rigid="all")
        assert share == pytest.approx(1.0, abs=2e-3)
        assert ratio == pytest.approx(wanted, rel=1e-3)
    _, share = first_mode("herkal", pattern, k, rigid="all", bend_law="linear")
    assert share == pytest.approx(1.0, abs=2e-3)


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("pattern", "held", "times"), in_pairs(PATTERNS, [True, False], [0.01, 0.1])
)
def test_where_creases_have_most_of_the_energy(pattern, held, times):
    wanted, share = of_shell(pattern, times * CALIBRATED, held)
    assert share > 0.945
    for kind in ("plate", "n5b8e"):
        ratio, _ = first_mode(kind, pattern, times * CALIBRATED, held)
        assert ratio == pytest.approx(wanted, rel=0.01)


@pytest.mark.matrix
@pytest.mark.parametrize("times", [0.1, 1.0, 10.0, 1000.0])
@pytest.mark.parametrize("held", [True, False], ids=["held", "free"])
def test_with_the_inertia_of_panels_that_bend(held, times):
    wanted, share = of_shell("fold", times * CALIBRATED, held)
    assert (share < 0.19) == (times >= 10.0)
    ratio, _ = first_mode("superelements", "fold", times * CALIBRATED, held)
    assert ratio == pytest.approx(wanted, rel=1e-3 if times <= 10.0 else 6e-3)


OF_FINE_SHELL = {
    (True, 1.0): (1.861e-3, 0.806),
    (True, 10.0): (1.830e-3, 1.547),
    (True, 100.0): (5.071e-4, 1.965),
    (True, 1000.0): (6.397e-5, 2.042),
    (False, 1.0): (3.800e-3, 1.838),
    (False, 10.0): (3.550e-4, 2.207),
    (False, 100.0): (6.806e-5, 2.276),
    (False, 1000.0): (7.772e-6, 2.287),
}
"""Ratio and frequency (Hz) of `first_mode(n, "cell", times * CALIBRATED, held)` for n of 16, 32 and
64, extrapolated as a geometric series."""


@pytest.mark.parametrize(("held", "times"), OF_FINE_SHELL)
def test_creases_that_turn_unevenly(held, times):
    """Of a cell, whatever the stiffness: as those of superelements do."""
    wanted, frequency = OF_FINE_SHELL[held, times]
    ratio, share = first_mode("superelements", "cell", times * CALIBRATED, held)
    near = 0.012 if times <= 100.0 else 0.04
    assert ratio == pytest.approx(wanted, rel=near)
    assert ratio / (share * TAU * np.pi) == pytest.approx(frequency, rel=6e-3)
    without, _ = first_mode("n5b8e", "cell", times * CALIBRATED, held)
    assert abs(without / wanted - 1.0) > 3.0 * abs(ratio / wanted - 1.0)


@pytest.mark.parametrize("times", [1e-2, 1.0, 1e2, 1e4])
@pytest.mark.parametrize("rigid", [None, [0], "all"])
@pytest.mark.filterwarnings("ignore:crease 0 is")
def test_a_moment_opens_a_crease_by_its_stiffness(times, rigid):
    """Whatever its panels do; the turn of the crease is the one that its damper resists."""
    pattern, k = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=90), times * CALIBRATED
    options = {"fold_law": "linear", "crease_stiffness": k, "rigid": rigid}
    s = fd.discretize(pattern, SHEET, preset="n5b8e", **options)
    linear = linearize(fd.Case(s, [fd.Fix([0, 1, 2, 3])], damping=fd.CreaseDamping(1.0)))
    own = linear.damping.toarray()
    turn = own[own.diagonal().argmax()] / np.sqrt(own.diagonal().max())  # L = 1
    opened = turn @ np.linalg.solve(linear.stiffness.toarray(), turn)
    assert opened == pytest.approx(1.0 / k, rel=1e-6)


@pytest.mark.parametrize("times", [1.0, 10.0, 100.0])
@pytest.mark.parametrize("held", [True, False], ids=["held", "free"])
@pytest.mark.parametrize(("kind", "most"), [("plate", 0.1), ("n5b8e", 0.24)])
def test_what_panels_miss_counts_by_their_share(kind, most, held, times):
    wanted, share = of_shell("fold", times * CALIBRATED, held)
    ratio, _ = first_mode(kind, "fold", times * CALIBRATED, held)
    assert abs(ratio / wanted - 1.0) < most * (1.0 - share)
