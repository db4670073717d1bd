"""Structures and cases that the tests of modes share."""

from __future__ import annotations

import numpy as np

import foldyn as fd

SHEET = fd.Sheet(1e6, 0.25, 0.01, density=1.0)
PATTERNS = {
    "miura": lambda: fd.patterns.miura(cells=(2, 2), a=1, b=1, panel_angle=60, dihedral=60),
    "kresling": lambda: fd.patterns.kresling(sides=6, radius=1, height=0.9, twist=30, storeys=3),
    "eggbox": lambda: fd.patterns.eggbox(cells=(2, 2), a=1, b=1.3, panel_angle=75, dihedral=60),
}
TOP, BOTTOM = list(range(7)), list(range(56, 63))


def body(pattern, scheme="n5b8", mass="mixed_voronoi", **model):
    """A structure of the sheet of the paper's case studies."""
    return fd.discretize(
        PATTERNS[pattern](), SHEET, scheme=scheme, mass=mass, **model, preset="herkal"
    )


def miura(cells=(2, 2), dihedral=60, **model):
    pattern = fd.patterns.miura(cells=cells, a=1, b=1, panel_angle=60, dihedral=dihedral)
    return fd.discretize(pattern, SHEET, **model, preset="herkal")


def paper_specimen(mass="circumcenter", rest="stress_free", supports=(), loads=()):
    """The specimen of section 7 of the design; its bottom row stands on a smooth plate."""
    pattern = fd.patterns.miura(
        cells=(4, 3), a=0.025, b=0.025, panel_angle=60, dihedral=39.2024618564
    )
    sheet = fd.Sheet(1219e6, 0.2, 0.24e-3, 667.0, 2.7)
    law = fd.EnhancedLinear(75, 285, rest=rest)
    s = fd.discretize(pattern, sheet, mass=mass, fold_law=law, preset="herkal")
    held = [fd.Fix(BOTTOM, "x"), fd.Fix([59], "y"), fd.Fix([57, 59, 61], "z")]
    return fd.Case(s, [*held, *supports], loads)


def hinged_panel(mass, stiffness):
    """One panel of a simple fold held, the other one turning about the crease on its spring."""
    pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=120)
    laws = {"fold_law": "linear", "bend_law": "linear"}
    s = fd.discretize(
        pattern, SHEET, mass=mass, crease_stiffness=stiffness, **laws, preset="herkal"
    )
    turning = [4, 5, 7]
    held = [node for node in range(len(s.nodes)) if node not in turning]
    return fd.Case(s, [fd.Fix(held, "xyz")]), turning


def flat(matrix):
    return np.asarray(matrix.toarray() if hasattr(matrix, "toarray") else matrix)
