"""Vibrations about a state in contact: the tangent of the potential holds what touches."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError
from foldyn.linear.excitation import drive_of
from foldyn.linear.linearized import linearize
from foldyn.linear.time_domain import Integration, Rig
from foldyn.mechanics.contact.term import ContactTerm

PAPER = fd.Sheet(1.2e9, 0.2, 0.3e-3, 690.0)
GAP = 0.14e-3  # m, of the feet: less than half the sheet's thickness, where contact begins


def tent(mass: str = "mixed_voronoi", damping=(), **contact) -> fd.Case:
    """A fold that stands on a floor, its ridge pressed down."""
    pattern = fd.patterns.simple_fold(a=0.04, b=0.04, dihedral=70)
    sheet = fd.discretize(pattern, PAPER, fold_law="linear", bend_law="linear", mass=mass)
    floor = fd.Plane((0, 0, sheet.nodes[:, 2].min() - GAP), (0, 0, 1))
    own = fd.Contact(**({"planes": [floor], "panels": False} | contact))
    load = fd.Force([2, 3], (0, 0, -2e-3))
    return fd.Case(sheet, [fd.Fix([2, 3], "xy")], [load], damping or fd.Rayleigh(), contact=own)


def test_sheets_apart_vibrate_as_without_contact():
    far = fd.Plane((0, 0, -1.0), (0, 0, 1))
    case = tent(planes=[far]).altered(loads=[])
    for damping in (fd.Rayleigh(1.0, 1e-4), fd.ModalDamping(0.01)):
        one = case.altered(damping=damping)
        other = one.altered(contact=None)
        np.testing.assert_array_equal(fd.modes(one, 5).frequency, fd.modes(other, 5).frequency)
        a, b = (
            fd.frf(each, fd.Force([2], (0, 0, 1)), frequencies=[3.0, 30.0]) for each in (one, other)
        )
        np.testing.assert_array_equal(a.receptance, b.receptance)


@pytest.mark.matrix
@pytest.mark.parametrize("mass", ["mixed_voronoi", "consistent"])
def test_a_small_motion_is_the_sum_of_the_modes(mass):
    """In time, from the state with a small velocity: the difference falls with its square."""
    case = tent(mass)
    found = fd.modes(case, int((~case.fixed).sum()), state="equilibrium")
    omega = 2.0 * np.pi * found.frequency.values
    u, shape, errors = found.displacement.values, found.shape.values, []
    for speed in (2e-4, 1e-4):
        v = np.zeros_like(u)
        v[2:4, 2] = speed
        motion = fd.simulate(
            case, 0.5 / found.frequency.values[0], method="dormand_prince", initial=fd.State(u, v),
            tolerance=1e-9, every_steps=20,
        )  # fmt: skip
        share = np.einsum("kni,ni->k", shape, case.mass @ v)  # of unit modal mass
        t = float(motion.time.values[-1] - motion.time.values[0])
        wanted = np.tensordot(share * np.sin(omega * t) / omega, shape, 1)
        off = motion.displacement.values[-1] - u - wanted
        errors.append(np.abs(off[2:4, 2]).max() / np.abs(wanted).max())
    assert errors[1] < 0.03
    assert errors[1] < 0.7 * errors[0]


def test_a_base_that_moves_leaves_the_floor_behind():
    """So slowly that nothing swings, the sheet stays where the floor holds it."""
    case = tent(damping=fd.Rayleigh(0.1)).altered(
        supports=[fd.Fix([2, 3], "xy"), fd.BaseMotion("x", fd.Harmonic(1.0), 1e-6)]
    )
    point = linearize(case, "equilibrium")
    contact = case.body.find(ContactTerm)
    assert contact is not None
    along = np.tile([0.0, 0.0, 1.0], len(case.structure.nodes))
    wanted = (contact.tangent(point.displacement.ravel()) @ along)[point.free]
    np.testing.assert_allclose(point.ground[:, 2], wanted, atol=1e-12 * np.abs(wanted).max())
    assert np.abs(wanted).max() > 1.0
    assert np.abs(point.ground[:, 0]).max() < 1e-9  # it stands there without friction


def test_friction_is_refused():
    with pytest.raises(InputError, match=r"contact.friction: contacts stick or slide"):
        fd.modes(tent(panels=True, friction=0.2), 3)


def test_planes_that_swing_stand_still_in_motions_about_a_state():
    """Histories play no part: a floor stays where it is in the state."""
    floor = fd.Plane((0, 0, -1.0), (0, 0, 1), motion=(0, 0, 2e-4), history=fd.Harmonic(5.0, 90.0))
    case = tent(planes=[floor]).altered(loads=[], supports=[fd.Fix([0, 1, 2, 3])])
    drive = fd.Force([4], (0, 0, 1e-6))
    rig = Rig(case, fd.State(), 0.5, drive_of(case, drive, 1.0), Integration())
    (_, history), *_ = rig.driven(fd.Harmonic(1.0)).obstacle_terms
    assert history(np.array([0.0, 0.3, 7.0])).tolist() == [0.5, 0.5, 0.5]
