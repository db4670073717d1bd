"""Boards that touch: points that ride on a mesh, and contact between them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import foldyn as fd
from foldyn.checks import gradient_error, tangent_error
from foldyn.jit.context import Context
from foldyn.mechanics.contact.boards import (
    add_back,
    curvature,
    jacobian,
    put_points,
    put_rates,
    ride_on,
    step_jacobian,
)
from named_models import named
from strips import strip

T = 0.1
SHEET = fd.Sheet(1e8, 0.3, T, 500.0)
RNG = np.random.default_rng(7)


# ------------------------------------------------------------------ points that ride
NODES = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 0], [2, 0, 0.3], [2, 1, 0.3]], float
)
TRIANGLES = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [1, 5, 6], [1, 6, 2]])
RIDE, PANEL, NODE = ride_on(
    NODES, TRIANGLES, np.array([0] * 4 + [1] * 2), NODES[TRIANGLES] + [0.02, 0.01, -0.05]
)
HELD = Context(RIDE)
U, V = 0.1 * RNG.standard_normal((2, *NODES.shape))
PUSH = RNG.standard_normal(RIDE.rest.shape)


def points(u):
    out = np.empty_like(RIDE.rest)
    put_points(HELD, u, out)
    return out


def test_points_are_those_of_each_panel_and_the_nodes():
    assert PANEL.tolist() == [0] * 5 + [1] * 4 + [-1] * 7
    assert NODE.tolist() == [0, 1, 2, 3, 4, 1, 2, 5, 6, *range(7)]
    assert np.abs(points(np.zeros_like(U))).max() < 1e-15


def test_points_move_rigidly_with_the_mesh():
    turn = Rotation.from_rotvec([0.3, 0.5, 1.0]).as_matrix()
    moved = points(NODES @ turn.T + [1.0, 2.0, 3.0] - NODES)
    np.testing.assert_allclose(RIDE.rest + moved, RIDE.rest @ turn.T + [1.0, 2.0, 3.0], atol=1e-14)


@pytest.mark.matrix
def test_derivatives_of_points_are_those_of_differences():
    motion, h = jacobian(RIDE, U, U.size), 1e-6
    differences = (points(U + h * V) - points(U - h * V)) / (2 * h)
    np.testing.assert_allclose(motion @ V.ravel(), differences.ravel(), atol=1e-9)
    rates, force = np.empty_like(RIDE.rest), np.zeros_like(U)
    put_rates(HELD, U, V, rates)
    add_back(HELD, U, PUSH, force)
    np.testing.assert_allclose(rates.ravel(), motion @ V.ravel(), atol=1e-14)
    np.testing.assert_allclose(force.ravel(), motion.T @ PUSH.ravel(), atol=1e-14)
    near = [jacobian(RIDE, U + way * V, U.size).T @ PUSH.ravel() / (2 * h) for way in (h, -h)]
    bent = curvature(RIDE, U, PUSH, U.size) @ V.ravel()
    np.testing.assert_allclose(bent, near[0] - near[1], atol=1e-8)


def test_a_step_moves_points_by_its_matrix_and_turns_them_about_its_middle():
    end = U + 3.0 * V
    step = step_jacobian(RIDE, U, end, U.size)
    moved = points(end) - points(U)
    np.testing.assert_allclose(step @ (end - U).ravel(), moved.ravel(), atol=1e-14)
    turn = np.array([0.3, -0.2, 0.5])
    around = np.cross(turn, NODES + 0.5 * (U + end))
    mean = RIDE.rest + 0.5 * (points(U) + points(end))
    np.testing.assert_allclose(step @ around.ravel(), np.cross(turn, mean).ravel(), atol=1e-14)
    differences = [
        abs(step_jacobian(RIDE, U - h * V, U + h * V, U.size) - jacobian(RIDE, U, U.size)).max()
        for h in (1e-2, 1e-3)
    ]
    assert differences[0] / differences[1] == pytest.approx(100.0, rel=0.05)


# ------------------------------------------------------------------ boards
def case_of(pattern, planes=(), thickness=None, **options):
    structure = fd.discretize(pattern, SHEET, **named(options))
    return fd.Case(structure, contact=fd.Contact(thickness, planes=planes))


def nearest(case):
    """Least distance over the one at which boards begin to touch, at rest."""
    return case.contact_term.nearest(np.zeros(case.body.size))[:2]


@pytest.mark.parametrize("angle", [0.0, 60.0, 120.0, 170.0])
@pytest.mark.parametrize("boards", [2, 4])
def test_boards_do_not_touch_with_their_sides(boards, angle):
    """Middles meet at the crease where boards lie flat, and go apart as they fold."""
    energy, share = nearest(case_of(fd.thicken(strip(boards, fold_angle=angle), T)))
    assert energy == 0.0
    assert share > 1.0
    shell = fd.shell(fd.thicken(strip(boards, fold_angle=angle), T), SHEET, divisions=8)
    energy, share = nearest(fd.Case(shell, contact=fd.Contact()))
    assert energy == 0.0
    assert share > 1.0


def test_boards_touch_where_their_faces_do():
    """At a dihedral a of the boards the center of one is t + w/2 sin a above the other's middle."""
    for opening in (1.0, 0.1):
        pattern = fd.thicken(strip(2, fold_angle=180.0 - opening), T)
        energy, share = nearest(case_of(pattern))
        assert energy == 0.0
        assert share == pytest.approx(1.0 + 0.5 * np.sin(np.radians(opening)) / T, rel=1e-3)
        assert nearest(case_of(pattern, thickness=1.1 * share * T))[0] > 0.0


def test_boards_hinged_in_their_middles_meet_as_sheets_do():
    begin = 180.0 - np.degrees(2.0 * T)
    for angle, meet in ((begin - 0.1, False), (begin + 0.1, True)):
        energies = []
        for pattern in (
            strip(2, fold_angle=angle),
            fd.thicken(strip(2, fold_angle=angle), T, offsets=0.0),
        ):
            energies.append(nearest(case_of(pattern))[0])
        assert energies[0] == pytest.approx(energies[1], rel=1e-6)
        assert (energies[0] > 0.0) is meet


def pressed():
    """Three boards, folded and too thick, between planes that are too near; states of them."""
    pattern = fd.thicken(strip(3, fold_angle=179.5), T)
    height = case_of(pattern).contact_term.tables
    height = height.rest[height.surface, 2] + case_of(pattern).structure.nodes[:, 2].mean()
    floor = fd.Plane((0, 0, height.min() - 0.4 * T), (0, 0, 1))
    lid = fd.Plane((0, 0, height.max() + 0.4 * T), (0, 0, -1))
    return case_of(pattern, [floor, lid], 1.2 * T), case_of(pattern, thickness=1.2 * T)


def test_forces_are_the_gradient_and_tangents_their_derivative():
    case, free = pressed()
    contact = case.contact_term
    for seed in range(3):
        q = 1e-3 * np.random.default_rng(seed).standard_normal(case.body.size)
        assert contact.contact(q)[0] > 0.0
        assert np.abs(contact.plane_forces(q)[:, 2]).min() > 0.0

        def force(q):
            return contact.contact(q)[1].ravel()

        assert gradient_error(lambda q: contact.contact(q)[0], force, at=q, size=1e-6) < 1e-6
        assert tangent_error(force, contact.tangent, at=q, size=1e-7) < 1e-6
        matrix = contact.tangent(q)
        assert abs(matrix - matrix.T).max() < 1e-14 * abs(matrix).max()
        own = free.contact_term.contact(q)[1]
        x, size = case.structure.nodes + q.reshape(-1, 3), np.abs(own).max()
        assert np.abs(own.sum(axis=0)).max() < 1e-14 * size
        assert np.abs(np.cross(x, own).sum(axis=0)).max() < 1e-13 * size


def test_what_moves_planes_is_the_derivative():
    case, _ = pressed()
    contact, q = case.contact_term, 1e-3 * RNG.standard_normal(case.body.size)
    motion, h = RNG.standard_normal((2, 3)), 1e-7
    column, row, own = contact.plane_borders(q, motion)

    def at(way):
        moved = contact.displaced(way * motion)
        return moved.contact(q)[1].ravel(), (moved.plane_forces(q) * motion).sum()

    ahead, back = at(h), at(-h)
    scale = np.abs(column).max()
    np.testing.assert_allclose(column, (ahead[0] - back[0]) / (2 * h), atol=1e-6 * scale)
    np.testing.assert_allclose(row, column, atol=1e-12 * scale)
    assert own == pytest.approx((ahead[1] - back[1]) / (2 * h), rel=1e-5)


def test_a_straight_step_is_cut_where_a_curved_path_meets():
    """The free board turns by 175 degrees of the 180 of a step that crosses the other one."""
    case = case_of(fd.thicken(strip(2, fold_angle=90.0), T))
    contact, x = case.contact_term, case.structure.nodes
    arm = np.flatnonzero(x[:, 2] > 0.5 * T + 1e-9)
    step = np.zeros_like(x)
    step[arm] = np.array([-2.5, 0.0, -2.5]) * (x[arm, 2:] - 0.5 * T)
    none = np.zeros((0, 3))
    share = contact.clear(np.zeros(x.size), step.ravel(), none)
    assert 0.0 < share < 1.0
    moved = fd.Case(case.structure, contact=case.contact).contact_term
    energy, near, _ = moved.nearest(share * step.ravel())
    assert np.isfinite(energy)
    assert near > 0.01


def renumbered(pattern, vertices):
    """The same with vertex i at place vertices[i]."""
    places = np.empty_like(pattern.vertices)
    places[vertices] = pattern.vertices
    creases = {
        tuple(sorted(vertices[list(pair)].tolist())): letter
        for pair, letter in zip(pattern.creases.tolist(), pattern.assignments, strict=True)
    }
    return fd.Pattern(places, [vertices[list(f)].tolist() for f in pattern.faces], creases)


def test_copies_have_the_same_contact():
    thin = strip(3, fold_angle=179.5)
    case = case_of(fd.thicken(thin, T), thickness=1.2 * T)
    q = 1e-3 * RNG.standard_normal(case.structure.nodes.shape)
    energy, force = case.contact_term.contact(q)
    assert energy > 0.0
    axis = np.array([1.0, -0.5, 0.7]) / np.sqrt(1.74)
    turn = Rotation.from_rotvec(np.radians(80.0) * axis).as_matrix()
    order = np.random.default_rng(3).permutation(len(thin.vertices))
    other = renumbered(thin, order)
    whole = np.concatenate([order, np.arange(len(order), len(q))])
    copies = [
        (fd.thicken(thin, T).rotated(80.0, axis), turn, np.arange(len(q))),
        (fd.thicken(thin, T).mirrored("y"), np.diag([1.0, -1.0, 1.0]), np.arange(len(q))),
        (fd.thicken(other, T), np.eye(3), whole),
    ]  # fmt: skip
    for pattern, matrix, place in copies:
        own = case_of(pattern, thickness=1.2 * T)
        moved = np.empty_like(q)
        moved[place] = q @ matrix.T
        found = own.contact_term.contact(moved)
        assert found[0] == pytest.approx(energy, rel=1e-9)
        np.testing.assert_allclose(
            found[1][place], force @ matrix.T, atol=1e-9 * np.abs(force).max()
        )
