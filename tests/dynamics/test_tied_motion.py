"""Motions with directions held, links and rigid panels.

The incline is a closed form of any textbook of mechanics; a structure on oblique supports is one
on supports along the axes, turned, whatever is asked of it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measured import apart, momenta
from moving_sheets import LINEAR, SHEET, fold, steps_of
from scipy.spatial.transform import Rotation

import foldyn as fd
from foldyn.dynamics import METHODS
from foldyn.errors import InputError
from named_models import named

G = 9.81
FLAT = fd.Pattern([[0, 0, 0], [1, 0, 0], [0.3, 0.8, 0.4]], [[0, 1, 2]], [])
SLOPE = np.radians(25.0)
NORMAL, DOWN = (np.array([np.sin(a), 0.0, np.cos(a)]) for a in (SLOPE, SLOPE + np.pi / 2))


def simulated(case, duration, method):
    return fd.simulate(case, duration, method=method, interval=0.1, **steps_of(method, 0.01))


@pytest.mark.parametrize(
    ("sheet", "held", "methods"),
    [
        (fd.discretize(FLAT, SHEET, preset="herkal"), None, METHODS),
        (fd.shell(FLAT, SHEET, divisions=2), None, ["newmark"]),
        (fd.shell(FLAT, SHEET, divisions=2, rigid="all"), 3, ["rk4", "generalized_alpha"]),
    ],
    ids=["bars", "shell", "rigid shell"],
)
def test_a_sheet_slides_down_an_incline(sheet, held, methods) -> None:
    """u = g sin(a) t^2 / 2 down the slope; it presses on the plane with m g cos(a)."""
    nodes = len(sheet.nodes)
    supports = [fd.Fix(list(range(held or nodes)), direction=7.0 * NORMAL)]
    case = fd.Case(sheet, supports, [fd.Gravity((0.0, 0.0, -G))])
    for method in methods:
        motion = simulated(case, 0.5, method)
        t = motion.time.values[:, None, None]
        speed = G * np.sin(SLOPE) * t * DOWN
        np.testing.assert_allclose(motion.displacement - 0.5 * speed * t, 0.0, atol=2e-12)
        np.testing.assert_allclose(motion.velocity - speed, 0.0, atol=2e-11)
        reactions = np.zeros((len(t), nodes, 3))
        axis = ["xyz".index(name) for name in motion.support_axis.values]
        reactions[:, motion.support_node.values, axis] = motion.reaction.values
        pressed = np.tile(sheet.total_mass * G * np.cos(SLOPE) * NORMAL, (len(t), 1))
        np.testing.assert_allclose(reactions.sum(axis=1), pressed, rtol=1e-8)
        assert motion.energy_error < 1e-9


def fold_on_rollers(turn, *bases):
    """A simple fold with a fixed and a sliding edge, on a base that moves, all turned."""
    plain = fd.patterns.simple_fold()
    pattern = fd.Pattern(plain.vertices @ turn.T, plain.faces, plain.assignments)
    s = fd.discretize(pattern, SHEET, mass="consistent", **LINEAR, preset="herkal")
    force = fd.Force([0, 1], turn @ [-1e-3, 0.0, 0.0], fd.Pulse(0.7))
    rollers = [fd.Fix([0], direction=turn[:, 2]), fd.Fix([1], direction=3.0 * turn[:, 2])]
    return fd.Case(s, [fd.Fix([4, 5]), *rollers, *bases], [force], fd.Rayleigh(0.1, 1e-4))


@pytest.mark.parametrize("method", ["rk4", "generalized_alpha"])
def test_a_base_carries_rollers_along(method) -> None:
    """Along the normal of their plane by what the base moves that way, in any frame."""
    turn = Rotation.from_euler("y", 30.0, degrees=True).as_matrix()
    times = np.linspace(0.0, 1.0, 201)
    along = fd.Table(times, np.sin(np.pi * times) ** 4, smooth=True)
    way = np.array([0.03, 0.0, 0.05])
    one, other = (
        simulated(fold_on_rollers(t, *(fd.BaseMotion("xyz"[k], along, by[k]) for k in (0, 2))), 1.0,
                  method)
        for t, by in ((np.eye(3), turn.T @ way), (turn, way))
    )  # fmt: skip
    there = other.displacement.values
    np.testing.assert_allclose(one.displacement.values @ turn.T, there, atol=1e-9)
    assert apart(other, one, "work") < 1e-6
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
    options = {"mass": mass, "bend_law": "linear", "preset": "herkal"}
    load, supports = [fd.Force([4, 5], (0.0, 1e-4, -1e-3), fd.Pulse(0.3))], [fd.Fix([0, 1, 3])]
    one = fd.Case(
        fd.discretize(whole, SHEET, crease_stiffness=0.0, **named(options)), supports, load
    )
    linked = [*supports, fd.Link([1, 6]), fd.Link([2, 7])]
    other = fd.Case(fd.discretize(cut, SHEET, **named(options)), linked, load)
    u, v = (simulated(case, 0.5, method) for case in (one, other))
    assert v.energy_error < 1e-4
    u, v = u.displacement.values, v.displacement.values
    np.testing.assert_allclose(v[:, :6], u[:, :6], atol=1e-9 * np.abs(u).max())
    np.testing.assert_array_equal(v[:, 6:8], v[:, 1:3])


@pytest.mark.matrix
@pytest.mark.parametrize("method", ["rk4", "energy_momentum"])
def test_links_conserve_momentum(method) -> None:
    """Two free sheets, linked at a corner: nothing but the link acts between them."""
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0.2], [2, 0, 0.2], [1, 1, 0.2]]
    s = fd.discretize(fd.Pattern(points, [[0, 1, 2], [3, 4, 5]], []), SHEET, preset="herkal")
    v = np.zeros_like(s.nodes)
    v[0], v[4] = (0.1, 0.2, 1.0), (0.3, 0.0, -0.5)
    start = fd.State(velocity=v)
    case = fd.Case(s, [fd.Link([1, 3])])
    motion = fd.simulate(case, 0.5, method=method, dt=1e-4, interval=0.1, initial=start)
    before = np.tile(s.mass @ v, (6, 1, 1)).sum(axis=1)
    np.testing.assert_allclose(momenta(s, motion)[0], before, atol=1e-14)
    assert motion.sizes["support"] == 0


def test_a_node_without_mass_may_ride() -> None:
    """A point that others carry needs none; one that carries itself is refused as ever."""
    s = fold(mass="mixed_voronoi")
    mass = s.nodal_mass.copy()
    mass[6] = 0.0
    bare, held = replace(s, node_mass=mass), [fd.Fix([4, 5]), fd.Fix([0, 1], "z")]
    with pytest.raises(InputError, match="node 6 is free but has no mass"):
        fd.simulate(fd.Case(bare, held), 0.1, method="rk4")
    load = [fd.Force([0, 1], (-1e-3, 0.0, 0.0), fd.HalfSine(0.1))]
    case = fd.Case(bare, [*held, fd.Link([6], to=[0, 1, 2])], load)
    motion = fd.simulate(case, 0.2, method="rk4", interval=0.1)
    implicit = fd.simulate(case, 0.2, method="newmark", dt=1e-4, interval=0.1)
    np.testing.assert_allclose(implicit.displacement, motion.displacement, atol=3e-7)
    assert motion.energy_error < 1e-4


def test_a_rigid_shell_drifts_in_any_direction() -> None:
    """Rounded velocities of what panels tie together do not contradict them."""
    pattern = fd.patterns.miura(b=1.2, panel_angle=64, dihedral=110)
    shell = fd.shell(pattern, SHEET, divisions=2, rigid="all")
    drift = np.array([0.3, -0.7, 0.2])
    start = fd.State(velocity=np.tile(drift, (len(shell.nodes), 1)))
    motion = fd.simulate(
        fd.Case(shell), 0.1, method="newmark", dt=0.05, every_steps=1, initial=start
    )
    np.testing.assert_allclose(motion.displacement[-1] - 0.1 * drift, 0.0, atol=1e-11)
