"""Paths of boards that are pressed onto each other."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from named_models import named
from strips import strip

T, PUSH = 0.1, 100.0
SHEET = fd.Sheet(1e8, 0.3, T, 500.0)


def fold(angle: float = 150.0, model: str = "bars", **options) -> fd.Structure:
    """Two boards, the lower one flat."""
    pattern = fd.thicken(strip(2, fold_angle=angle), T)
    options = {"crease_stiffness": 5.0} | options
    if model == "shell":
        return fd.shell(pattern, SHEET, divisions=2, **options)
    return fd.discretize(pattern, SHEET, **named(options))


def lower(structure) -> np.ndarray:
    return np.unique(structure.triangles[structure.triangle_panel == 0])


def apart(case, u) -> np.ndarray:
    """Heights (m) of the corners of the upper board's middle over that of the lower one."""
    term = case.contact_term
    places = term.tables.rest + term.points(case.body.dofs(u))
    upper = np.unique(term.tables.triangles[term.tables.panel == 1])
    held = np.unique(term.tables.triangles[term.tables.panel == 0])
    return places[upper, 2] - places[held, 2].mean()


@pytest.mark.matrix
@pytest.mark.parametrize("model", ["bars", "shell"])
def test_a_fold_pressed_shut_carries_the_load_at_its_thickness(model):
    case, path = pressed_shut(model)
    u = path.displacement.to_numpy()[-1]
    height = apart(case, u)
    assert 0.97 * T < height.min() < height.max() < 1.01 * T
    assert path.reaction.to_numpy()[-1][2::3].sum() == pytest.approx(PUSH, rel=1e-9)
    if model == "bars":  # contact's tangent holds what touches: a soft mode is gone
        closed = fd.modes(case, 1, state=fd.State(u))
        open_ = fd.modes(case.altered(loads=()), 1)
        assert float(closed.frequency[0]) > 5.0 * float(open_.frequency[0])


def pressed_shut(model):
    """A fold under a load on its upper board, and its path."""
    s = fold(model=model)
    load = fd.Force([2, 5], (0.0, 0.0, -PUSH / 2))
    case = fd.Case(s, [fd.Fix(lower(s))], [load], contact=fd.Contact())
    return case, fd.trace(case, "newton", steps=10)


@pytest.mark.matrix
def test_a_plane_presses_a_fold_shut():
    """Soft while boards turn, and then as stiff as their faces; no less force on the support."""
    s = fold(170.0)
    term = fd.Case(s, contact=fd.Contact()).contact_term
    top = term.tables.rest[term.tables.surface, 2].max() + s.nodes[:, 2].mean()
    z = top + 0.51 * T
    lid = fd.Plane((0, 0, z), (0, 0, -1), motion=(0, 0, 1.4 * T - z))
    case = fd.Case(s, [fd.Fix(lower(s))], contact=fd.Contact(planes=[lid]))
    path = fd.trace(case, "displacement", steps=10)
    force = -path.plane_force.to_numpy()[:, 0, 2]
    assert (np.diff(force) > 0.0).all()
    assert force[-1] > 1000.0 * force[-2]
    assert path.reaction.to_numpy()[-1][2::3].sum() == pytest.approx(force[-1], rel=1e-9)


@pytest.mark.matrix
def test_an_accordion_that_is_driven_closed_does_not_push():
    """Faces touch at 180 degrees, in a stack of N t, and no earlier."""
    s = fd.discretize(fd.thicken(strip(4), T), SHEET, preset="plate")
    drive = fd.Actuate("all", fraction="100%")
    case = fd.Case(s, [fd.Fix([0, 1, 5])], [drive], contact=fd.Contact())
    path = fd.trace(case, "displacement", steps=10)
    assert float(path.contact.max()) == 0.0
    u = path.displacement.to_numpy()
    assert case.contact_term.nearest(case.body.dofs(u[-1]))[1] == pytest.approx(1.0, rel=1e-6)
    assert case.contact_term.nearest(case.body.dofs(u[-2]))[1] > 1.5


@pytest.mark.matrix
def test_boards_hinged_at_one_height_close_before_their_hinge_planes_do():
    """Their dihedral would jump from 0 to 360 degrees where faces meet: a guard stays before it."""
    s = fd.discretize(
        fd.thicken(strip(4, letters="VVV"), T), SHEET, fold_law="linear", preset="plate"
    )
    loads = [fd.Actuate([1], fold_angle=179.0), fd.CreaseMoment([1], -1000.0)]
    case = fd.Case(s, [fd.Fix([0, 1, 2, 5, 6, 7])], loads, contact=fd.Contact())
    path = fd.trace(case, "newton", steps=20)
    q = case.body.dofs(path.displacement.to_numpy()[-1])
    angle = s.body.angles(q).min()
    assert 0.0 < angle < 0.02 * 2.0 * T
    assert 1.0 < case.contact_term.nearest(q)[1] < 1.02


def test_panels_that_pass_through_each_other_are_refused():
    """A mountain that is hinged in the front face has no room for its boards."""
    pattern = fd.thicken(strip(2, fold_angle=60.0, letters="M"), T, offsets=T / 2)
    case = fd.Case(
        fd.discretize(pattern, SHEET, preset="plate"),
        [fd.Fix([0, 1, 3])],
        [fd.Force([2], (0.0, 0.0, 1.0))],
        contact=fd.Contact(),
    )
    with pytest.raises(fd.errors.InputError, match="panels pass through each other: 0 and 1"):
        fd.trace(case, "newton", steps=2)
