"""Starts that contact cannot undo are refused, by name and before contact itself is compiled."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from contact_sheets import SHEET, strip
from foldyn.errors import FoldynWarning, InputError
from foldyn.mechanics.contact.term import ContactTerm

T = SHEET.thickness
DOWN = fd.Force([0, 1], (0, 0, -1e-3))


def through_each_other(depth: float) -> fd.Pattern:
    """An upright panel, 20 mm wide, whose lower edge is some depth below a flat one."""
    flat = [[x, y, 0.0] for x, y in ((-0.05, -0.05), (0.05, -0.05), (0.05, 0.05), (-0.05, 0.05))]
    upright = [[0.004, y, z - depth] for y, z in ((0, 0), (0.02, 0), (0.02, 0.04), (0, 0.04))]
    return fd.Pattern([*flat, *upright], [(0, 1, 2, 3), (4, 5, 6, 7)])


MODELS = {
    "bars and hinges": lambda pattern: fd.discretize(
        pattern, SHEET, fold_law="linear", preset="plate"
    ),
    "shell": lambda pattern: fd.shell(pattern, SHEET, divisions=2, fold_law="linear"),
}
ANALYSES = {
    "motion": lambda case, initial: fd.simulate(case, 1e-3, method="auto", initial=initial),
    "path": lambda case, initial: fd.trace(case, "newton", steps=1, initial=initial),
}


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("analysis", ANALYSES)
@pytest.mark.parametrize("depth", [1e-9, 0.02])  # 20 mm: no vertex, no edge is near the other panel
def test_panels_that_cross_are_refused_before_contact_is_looked_at(
    model, analysis, depth, monkeypatch
):
    s = MODELS[model](through_each_other(depth))
    case = fd.Case(s, [fd.Fix([2, 3])], [DOWN], contact=fd.Contact())
    monkeypatch.setattr(ContactTerm, "contact", None)  # contact's kernels are not called
    with pytest.raises(InputError, match=r"contact: at the start .* through each other: 0 and 1;"):
        ANALYSES[analysis](case, None)


@pytest.mark.parametrize("analysis", ANALYSES)
def test_so_are_displacements_that_make_them_cross(analysis, monkeypatch):
    s = MODELS["bars and hinges"](through_each_other(-0.01))
    case = fd.Case(s, [fd.Fix([2, 3])], [DOWN], contact=fd.Contact())
    u = np.zeros_like(s.nodes)
    u[s.nodes[:, 2] > 0.0, 2] = -0.02
    monkeypatch.setattr(ContactTerm, "contact", None)
    with pytest.raises(InputError, match="through each other: 0 and 1;"):
        ANALYSES[analysis](case, fd.State(displacement=u))


@pytest.mark.parametrize("gap", [0.0, 1e-4, 0.3])
def test_panels_that_meet_are_named(gap):
    """Two layers some part of their thickness apart; they cross nowhere."""
    low = [[0, 0, 0], [0.04, 0, 0], [0.04, 0.04, 0], [0, 0.04, 0]]
    high = [[x + 0.01, y + 0.01, gap * T] for x, y, _ in low]
    s = MODELS["bars and hinges"](fd.Pattern([*low, *high], [(0, 1, 2, 3), (4, 5, 6, 7)]))
    told = pytest.raises(InputError, match=r"at the start panels meet, or fold onto .* \(0 and 1")
    if gap == 0.3:
        told = pytest.warns(
            FoldynWarning, match=r"than the sheet is thick \(0 and 1\); they will be"
        )
    with told:
        fd.simulate(fd.Case(s, contact=fd.Contact()), 1e-6, method="rk4")


@pytest.mark.parametrize(
    ("height", "message"),
    [
        (-1e-3, r"node 0 is 0.001 m behind it at the start"),
        (0.0, r"node 0 is 0 m behind it"),
        (1e-12, r"node 0 is 1e-12 m from it, with 0.00012 m of the sheet between"),
    ],
)
def test_nodes_in_or_behind_a_plane_are_refused(height, message, monkeypatch):
    monkeypatch.setattr(ContactTerm, "contact", None)
    plane = fd.Plane((0, 0, -height), (0, 0, 1))
    case = fd.Case(strip(), contact=fd.Contact(panels=False, planes=[plane]))
    with pytest.raises(InputError, match=rf"contact.planes\[0\]: {message}"):
        fd.simulate(case, 1e-6, method="rk4")
