"""Motions of boards that touch each other and planes."""

from __future__ import annotations

import numpy as np
import pytest
from measured import drift, momenta

import foldyn as fd
from foldyn.mechanics.contact.term import ContactTerm
from pairwise import beyond
from strips import overlap, section, strip

T = 0.1
SOFT = fd.Sheet(1e6, 0.3, T, 2.0)
G = 9.81


def slammed() -> tuple[fd.Case, fd.State]:
    """Two free boards, folded by 150 degrees, of which one falls onto the other as they drift."""
    pattern = fd.thicken(strip(2, fold_angle=150.0), T)
    case = fd.Case(
        fd.discretize(pattern, SOFT, crease_stiffness=0.5, preset="plate"), contact=fd.Contact()
    )
    above = case.structure.nodes[:, 2] - 0.5 * T
    velocity = np.zeros_like(case.structure.nodes)
    velocity[:, 2] = -5.0 * np.maximum(above, 0.0)
    velocity[:, 0] = 0.3
    return case, fd.State(velocity=velocity)


def nearest(case: fd.Case, motion) -> float:
    contact: ContactTerm = case.contact_term
    states = motion.displacement.to_numpy()
    return min(contact.nearest(case.body.dofs(u))[1] for u in states)


def deepest(case: fd.Case, motion) -> float:
    """How deep (m) the sections of two boards reach into each other, at most."""
    pattern, x = case.structure.pattern, case.structure.nodes
    return max(
        overlap(*(section(pattern, k, x + u) for k in (0, 1)))
        for u in motion.displacement.to_numpy()
    )


SLAMS = [
    ("dormand_prince", None, 2e-4, 1e-8),
    ("rk4", None, 3e-2, 1e-5),
    ("central_difference", None, 1e-2, 1e-12),
    ("newmark", 5e-4, 3e-2, 3e-3),
    ("generalized_alpha", 5e-4, 0.2, 3e-3),
    ("energy_momentum", 1e-3, 1e-10, 1e-10),
]


@pytest.mark.filterwarnings("ignore:the energy balance")
@pytest.mark.parametrize(("method", "dt", "balance", "turn"), beyond(SLAMS, 2))
def test_boards_rebound_and_keep_energy_and_momenta(method, dt, balance, turn):
    case, initial = slammed()
    motion = fd.simulate(case, 0.4, method=method, dt=dt, interval=0.01, initial=initial)
    assert float(motion.contact.max()) > 0.0
    assert 0.9 < nearest(case, motion) < 1.0
    assert deepest(case, motion) < 0.06 * T
    assert motion.attrs["energy_error"] < balance
    linear, angular = map(drift, momenta(case.structure, motion))
    assert linear < 1e-11
    assert angular < turn


@pytest.mark.matrix
def test_nothing_is_lost_but_by_friction_while_a_plane_lifts_boards():
    """Work of the plane and of friction, of the boards on each other and on it, balance exactly."""
    case, initial = slammed()
    up = fd.Plane((0, 0, -1.1 * T), (0, 0, 1), motion=(0, 0, 0.2 * T), history=fd.Ramp(0.2))
    case = case.altered(contact=fd.Contact(friction=0.3, planes=[up]))
    motion = fd.simulate(
        case, 0.3, method="energy_momentum", dt=1e-3, interval=0.01, initial=initial
    )
    assert float(motion.dissipated[-1]) > 0.0
    assert float(motion.work[-1]) > 0.0
    assert motion.attrs["energy_error"] < 1e-10


def test_without_contact_boards_pass_through_each_other():
    case, initial = slammed()
    case = case.altered(contact=None)
    motion = fd.simulate(case, 0.4, method="dormand_prince", interval=0.01, initial=initial)
    assert deepest(case, motion) > 0.3 * T


@pytest.mark.matrix
def test_a_thick_miura_bounces_between_planes():
    """All its vertices are hinged in the middle; it loses nothing."""
    pattern = fd.thicken(fd.patterns.miura(cells=(2, 2)), 0.01, offsets=0.0)
    s = fd.discretize(
        pattern, fd.Sheet(1e7, 0.3, 0.01, 500.0), crease_stiffness=1.0, preset="plate"
    )
    z = s.nodes[:, 2]
    floor = fd.Plane((0, 0, z.min() - 0.006), (0, 0, 1))
    lid = fd.Plane((0, 0, z.max() + 0.03), (0, 0, -1))
    case = fd.Case(s, contact=fd.Contact(planes=[floor, lid]))
    down = fd.State(velocity=np.full(s.nodes.shape, (0.0, 0.0, -2.0)))
    motion = fd.simulate(case, 0.1, method="dormand_prince", interval=1e-3, initial=down)
    assert np.abs(motion.plane_force.to_numpy()[:, :, 2]).max(axis=0).min() > 0.0
    assert motion.attrs["energy_error"] < 2e-5


@pytest.mark.matrix
@pytest.mark.parametrize("method", ["dormand_prince", "newmark", *beyond(["energy_momentum"])])
def test_boards_come_to_rest_on_the_floor(method):
    """With their weight on it, their middles half a thickness less what that compresses above."""
    s = fd.discretize(fd.thicken(strip(2), T), fd.Sheet(1e7, 0.3, T, 100.0), preset="plate")
    floor = fd.Plane((0, 0, -0.52 * T), (0, 0, 1))
    contact = fd.Contact(planes=[floor])
    case = fd.Case(s, [], [fd.Gravity((0, 0, -G))], fd.Rayleigh(alpha=30.0), contact=contact)
    motion = fd.simulate(case, 1.0, method=method, interval=0.1)
    force = motion.plane_force.to_numpy()[-1, 0]
    np.testing.assert_allclose(force, [0.0, 0.0, case.total_mass * G], rtol=1e-3, atol=1e-6)
    term = case.contact_term
    places = term.tables.rest + term.points(motion.displacement.to_numpy()[-1])
    height = places[term.tables.meeting, 2] + s.nodes[:, 2].mean() + 0.52 * T
    assert (height > 0.45 * T).all()
    assert (height < 0.5 * T).all()


@pytest.mark.matrix
@pytest.mark.parametrize(("angle", "alpha"), [(20.0, 0.0), (10.0, 50.0)])
def test_a_board_slides_on_a_slope_and_sticks_on_a_gentle_one(angle, alpha):
    """It slides as g (sin a - mu cos a) says, and stays where it has come to rest."""
    board = fd.discretize(fd.thicken(strip(2), T), fd.Sheet(1e8, 0.3, T, 100.0), preset="plate")
    a = np.radians(angle)
    contact = fd.Contact(friction=0.3, planes=[fd.Plane((0, 0, -0.4965 * T), (0, 0, 1))])
    pull = fd.Gravity((G * np.sin(a), 0.0, -G * np.cos(a)))
    case = fd.Case(board, [], [pull], fd.Rayleigh(alpha), contact=contact)
    motion = fd.simulate(case, 0.3, method="newmark", dt=1e-3, interval=0.1)
    way = motion.displacement.values[:, :, 0].mean(axis=1)
    if angle > 16.7:
        wanted = 0.5 * G * (np.sin(a) - 0.3 * np.cos(a)) * 0.3**2
        assert way[-1] == pytest.approx(wanted, rel=0.05)
    else:
        assert abs(way[-1] - way[-2]) < 1e-5
