"""Motions with directions held, links and rigid panels.

The incline and the compound pendulum are closed forms of any textbook of mechanics; a structure on
oblique supports is one on supports along the axes, turned, whatever is asked of it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import foldyn as fd
from foldyn.dynamics import METHODS
from foldyn.errors import InputError

SHEET = fd.Sheet(1e6, 0.25, 0.01, density=1.0)
G = 9.81


def turned(angles=(25.0, 40.0)) -> np.ndarray:
    """A rotation (3, 3) about two axes, degrees."""
    a, b = np.radians(angles)
    about_y = np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]])
    about_z = np.array([[np.cos(b), -np.sin(b), 0], [np.sin(b), np.cos(b), 0], [0, 0, 1]])
    return about_y @ about_z


def reactions(motion, nodes) -> np.ndarray:
    """Forces of the supports (time, n, 3)."""
    out = np.zeros((motion.sizes["time"], nodes, 3))
    axis = ["xyz".index(name) for name in motion.support_axis.values]
    out[:, motion.support_node.values, axis] = motion.reaction.values
    return out


def fixed_step(method) -> dict:
    return {"dt": 0.01} if METHODS[method].implicit else {}


FLAT = fd.Pattern([[0, 0, 0], [1, 0, 0], [0.3, 0.8, 0.4]], [[0, 1, 2]], [])


@pytest.mark.parametrize(
    ("model", "method"),
    [
        *(("bars", method) for method in METHODS),
        ("shell", "newmark"),
        ("rigid shell", "rk4"),
        ("rigid shell", "generalized_alpha"),
    ],
)
def test_a_sheet_slides_down_an_incline(model, method) -> None:
    """u = g sin(a) t^2 / 2 down the slope; it presses on the plane with m g cos(a)."""
    slope = np.radians(25.0)
    normal = np.array([np.sin(slope), 0.0, np.cos(slope)])
    down = np.array([np.cos(slope), 0.0, -np.sin(slope)])
    make = {
        "bars": lambda: fd.discretize(FLAT, SHEET, preset="herkal"),
        "shell": lambda: fd.shell(FLAT, SHEET, divisions=2),
        "rigid shell": lambda: fd.shell(FLAT, SHEET, divisions=2, rigid="all"),
    }
    sheet = make[model]()
    held = range(3) if model.startswith("rigid") else range(len(sheet.nodes))
    supports = [fd.Fix(list(held), direction=7.0 * normal)]
    case = fd.Case(sheet, supports, [fd.Gravity((0.0, 0.0, -G))])
    motion = fd.simulate(case, 0.5, method, every=0.1, **fixed_step(method))
    t = motion.time.values[:, None, None]
    exact = 0.5 * G * np.sin(slope) * t**2 * down
    np.testing.assert_allclose(motion.displacement - exact, 0.0, atol=2e-12)
    np.testing.assert_allclose(motion.velocity - G * np.sin(slope) * t * down, 0.0, atol=2e-11)
    pressed = reactions(motion, len(sheet.nodes)).sum(axis=1)
    expected = np.tile(sheet.total_mass * G * np.cos(slope) * normal, (len(pressed), 1))
    np.testing.assert_allclose(pressed, expected, rtol=1e-8)
    assert motion.energy_error < 1e-9


def fold_on_rollers(mass, turn=None, moved=False, damping=None):
    """A simple fold with a fixed and a sliding edge; turned, the latter is held in a direction."""
    pattern = fd.patterns.simple_fold()
    direction, sideways = np.eye(3)[2], np.eye(3)[0]
    if turn is not None:
        pattern = fd.Pattern(pattern.vertices @ turn.T, pattern.faces, pattern.assignments)
        direction, sideways = turn @ direction, turn @ sideways
    s = fd.discretize(
        pattern, SHEET, mass=mass, bend_law="linear", fold_law="linear", preset="herkal"
    )
    force = fd.Force([0, 1], -1e-3 * sideways, fd.Pulse(0.7))
    lift = fd.Ramp(1.0)
    if turn is None:
        supports = [fd.Fix([4, 5]), fd.Fix([0], "z")]
        supports += [fd.Impose([1], "z", 0.02, lift) if moved else fd.Fix([1], "z")]
    else:
        supports = [fd.Fix([4, 5]), fd.Fix([0], direction=direction)]
        way = {"direction": 3.0 * direction}
        supports += [fd.Impose([1], value=0.02, history=lift, **way) if moved else
                     fd.Fix([1], **way)]  # fmt: skip
    return fd.Case(s, supports, [force], damping or fd.Rayleigh(0.1, 1e-4))


@pytest.mark.parametrize("method", ["rk4", "generalized_alpha"])
def test_a_base_carries_rollers_along(method) -> None:
    """Along the normal of their plane by what the base moves that way, in any frame."""
    turn, times = turned((30.0, 0.0)), np.linspace(0.0, 1.0, 201)
    along = fd.Table(times, np.sin(np.pi * times) ** 4, smooth=True)
    plain = fold_on_rollers("consistent")
    oblique = fold_on_rollers("consistent", turn)
    bases = [fd.BaseMotion("x", along, 0.03), fd.BaseMotion("z", along, 0.05)]
    moved = turn.T @ (0.03, 0.0, 0.05)
    own = [fd.BaseMotion("x", along, moved[0]), fd.BaseMotion("z", along, moved[2])]
    one, other = (
        fd.simulate(fd.Case(case.structure, [*case.supports, *more]), 1.0, method, every=0.1,
                    **fixed_step(method))
        for case, more in ((plain, own), (oblique, bases))
    )  # fmt: skip
    np.testing.assert_allclose(
        one.displacement.values @ turn.T, other.displacement.values, atol=1e-9
    )
    np.testing.assert_allclose(one.work, other.work, atol=1e-6 * np.abs(one.work.values).max())
    assert other.energy_error == pytest.approx(one.energy_error, rel=1e-2)
    assert other.energy_error < 5e-3


@pytest.mark.filterwarnings("ignore:vertices. the boundary edges:foldyn.errors.FoldynWarning")
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("mass", ["mixed_voronoi", "consistent"])
def test_two_sheets_that_are_linked_are_one(method, mass) -> None:
    """A strip of two panels, and the same cut in two and linked along the cut, but for the hinge.

    Both bend only about the line in common, where the whole one has no stiffness.
    """
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0.5], [2, 1, 0.5]])
    faces = [[0, 1, 2, 3], [1, 4, 5, 2]]
    whole = fd.Pattern(points, faces, "V")
    cut = fd.Pattern(np.vstack([points, points[1:3]]), [faces[0], [6, 4, 5, 7]], [])
    options = {"mass": mass, "bend_law": "linear"}
    one = fd.discretize(whole, SHEET, crease_stiffness=0.0, **options, preset="herkal")
    other = fd.discretize(cut, SHEET, **options, preset="herkal")
    load = [fd.Force([4, 5], (0.0, 1e-4, -1e-3), fd.Pulse(0.3))]
    supports = [fd.Fix([0, 1, 3])]
    a = fd.simulate(fd.Case(one, supports, load), 0.5, method, every=0.1, **fixed_step(method))
    linked = [*supports, fd.Link([1, 6]), fd.Link([2, 7])]
    b = fd.simulate(fd.Case(other, linked, load), 0.5, method, every=0.1, **fixed_step(method))
    u, v = a.displacement.values, b.displacement.values
    np.testing.assert_allclose(v[:, :6], u[:, :6], atol=1e-9 * np.abs(u).max())
    np.testing.assert_array_equal(v[:, 6:8], v[:, 1:3])
    assert b.energy_error < 1e-4


def test_links_conserve_momentum() -> None:
    """Two free sheets, linked at a corner: nothing but the link acts between them."""
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0.2], [2, 0, 0.2], [1, 1, 0.2]]
    pattern = fd.Pattern(points, [[0, 1, 2], [3, 4, 5]], [])
    s = fd.discretize(pattern, SHEET, preset="herkal")
    v = np.zeros_like(s.nodes)
    v[0], v[4] = (0.1, 0.2, 1.0), (0.3, 0.0, -0.5)
    case = fd.Case(s, [fd.Link([1, 3])])
    before = s.nodal_mass @ v
    for method in ("rk4", "energy_momentum"):
        motion = fd.simulate(case, 0.5, method, dt=1e-4, every=0.1, initial=fd.State(velocity=v))
        momentum = np.einsum("n,tni->ti", s.nodal_mass, motion.velocity.values)
        np.testing.assert_allclose(momentum, np.tile(before, (6, 1)), atol=1e-14)
        assert motion.sizes["support"] == 0


def test_a_node_without_mass_may_ride() -> None:
    """A point that others carry needs none; one that carries itself is refused as ever."""
    pattern = fd.patterns.simple_fold()
    s = fd.discretize(pattern, SHEET, mass="mixed_voronoi", preset="herkal")
    mass = s.nodal_mass.copy()
    mass[6] = 0.0
    bare = replace(s, node_mass=mass)
    held = [fd.Fix([4, 5]), fd.Fix([0, 1], "z")]
    with pytest.raises(InputError, match="node 6 is free but has no mass"):
        fd.simulate(fd.Case(bare, held), 0.1)
    load = [fd.Force([0, 1], (-1e-3, 0.0, 0.0), fd.HalfSine(0.1))]
    case = fd.Case(bare, [*held, fd.Link([6], to=[0, 1, 2])], load)
    motion = fd.simulate(case, 0.2, every=0.1)
    implicit = fd.simulate(case, 0.2, "newmark", dt=1e-4, every=0.1)
    np.testing.assert_allclose(implicit.displacement, motion.displacement, atol=3e-7)
    assert motion.energy_error < 1e-4
