"""Periodic motions of what touches: against shooting, simulated motions, and motions without."""

from itertools import pairwise

import numpy as np
import pytest
from duffing import NODE, oscillator

import foldyn as fd
from foldyn.attractors.drive import at_frequency, at_level, drive_frequency
from foldyn.errors import FoldynWarning, InputError
from foldyn.periodic.equation import Equation
from foldyn.periodic.orbit import Orbit

F = 0.2


def bouncing(force=F, **plane):
    """The oscillator above a plane, which it meets 0.05 below rest."""
    ground = fd.Plane((0, 0, -0.2), (0, 0, 1), **plane)
    touching = fd.Contact(0.3, stiffness=3.0, panels=False, planes=[ground])
    return oscillator(force, F, alpha=0.6).altered(contact=touching)


def height(motion):
    return motion.displacement.values[:, NODE, 2]


@pytest.fixture(scope="module")
def found():
    with pytest.warns(FoldynWarning, match="harmonics = 5: twice as many would change"):
        few = fd.periodic_motion(bouncing(), harmonics=5)
    with pytest.warns(FoldynWarning, match="harmonics = 9: twice as many would change"):
        more = fd.periodic_motion(bouncing(), harmonics=9, guess=few)
    return few, more, fd.periodic_motion(bouncing(), harmonics=17, guess=more)


def test_what_does_not_reach_the_plane_does_not_feel_it():
    near = fd.periodic_motion(bouncing(0.05), harmonics=5)
    free = fd.periodic_motion(bouncing(0.05).altered(contact=None), harmonics=5)
    assert height(free).min() > -0.05
    assert height(near) == pytest.approx(height(free), abs=1e-13)
    assert near.floquet.values == pytest.approx(free.floquet.values, abs=1e-12)


@pytest.mark.matrix
def test_harmonics_converge_to_what_shooting_finds(found):
    shot = fd.periodic_motion(bouncing(), method="shooting", steps=48, guess=found[-1])
    errors = [np.abs(height(one) - height(shot)).max() for one in found]
    assert height(shot).min() < -0.09  # deep in what touches, of which 0.05 is 0
    assert all(after < 0.25 * before for before, after in pairwise(errors))
    assert errors[-1] < 1e-4 * 0.094
    size = [abs(one.floquet.values[0]) for one in (found[-1], shot)]
    assert size[0] == pytest.approx(size[1], rel=2e-3)


@pytest.mark.matrix
def test_simulated_motion_settles_on_it(found):
    assert bool(found[-1].stable)
    run = fd.simulate(bouncing(), 16.0 / F, method="rk4", dt=1.0 / F / 512, every_steps=4)
    last = run.displacement.values[-129:-1, NODE, 2]
    assert last == pytest.approx(height(found[-1]), abs=2e-5)


@pytest.mark.matrix
def test_a_plane_that_swings_drives():
    swinging = bouncing(motion=(0, 0, 0.1), history=fd.Harmonic(F)).altered(loads=[])
    assert drive_frequency(swinging) == F
    assert at_level(swinging, 2.0).contact.planes[0].motion == (0.0, 0.0, 0.2)
    one = fd.periodic_motion(swinging, harmonics=12)
    start = fd.State(one.displacement.values[0], one.velocity.values[0])
    run = fd.simulate(
        swinging, 1.0 / F, method="rk4", dt=1.0 / F / 512, initial=start, every_steps=128
    )
    assert np.ptp(height(one)) > 0.02
    assert run.displacement.values[:, NODE, 2] == pytest.approx(
        height(one)[[0, 32, 64, 96, 0]], abs=1e-4 * np.ptp(height(one))
    )
    assert drive_frequency(at_frequency(swinging, 0.1)) == 0.1
    z = fd.Quantity("m", "height", function=lambda u, v, t: u[NODE, 2])
    steady = fd.bifurcation_diagram(
        swinging, z, frequencies=[F, 1.1 * F], sweep="up", settle=15, record=4
    )
    other = fd.periodic_motion(swinging, 1.1 * F, harmonics=12)
    swings = [0.5 * np.ptp(height(motion)) for motion in (one, other)]
    assert steady.amplitude.values[0] == pytest.approx(swings, rel=1e-3)


@pytest.mark.matrix
def test_free_motions_against_the_plane_keep_their_energy():
    spine = fd.backbone(bouncing(), amplitudes=(0.04, 0.1), harmonics=12)
    assert spine.frequency.values[-1] > 1.02 * spine.frequency.values[0]  # it hardens
    last = spine.isel(point=-1)
    start = fd.State(last.coefficient.values.sum(axis=0).real)
    free = bouncing().altered(loads=[], damping=fd.Rayleigh())
    period = 1.0 / float(last.frequency)
    run = fd.simulate(free, period, method="rk4", dt=period / 512, initial=start, every_steps=64)
    assert run.displacement.values[-1] == pytest.approx(start.displacement, abs=1e-4 * 0.1)


@pytest.mark.matrix
def test_panels_touch():
    pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=38)
    s = fd.discretize(pattern, fd.Sheet(1e5, 0.25, 0.1, 1.0), scheme="n4b5", bend_law="linear")
    push = fd.Force([0, 1], (0.25, 0, 0), history=fd.Harmonic(0.4))
    case = fd.Case(
        s, [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "yz")], [push], fd.Rayleigh(alpha=2.0),
        contact=fd.Contact(thickness=0.3, stiffness=3.0),
    )  # fmt: skip
    one = fd.periodic_motion(case, harmonics=12)
    without = fd.periodic_motion(case.altered(contact=None), harmonics=12)
    assert np.abs(one.displacement - without.displacement).max() > 1e-3
    start = fd.State(one.displacement.values[0], one.velocity.values[0])
    run = fd.simulate(case, 2.5, method="rk4", initial=start, interval=0.625)
    assert run.displacement.values[-1] == pytest.approx(one.displacement.values[0], abs=1e-5)


def test_a_start_behind_the_plane_is_refused():
    behind = fd.State(np.array([[0, 0, 0], [0, 0, 0], [0, 0, -0.3]]))
    with pytest.raises(InputError, match=r"contact.planes\[0\]: node 2 is 0.1 m behind it"):
        fd.periodic_motion(bouncing(), guess=behind)


def test_motions_through_the_plane_are_told():
    equation, through = Equation(bouncing(), "a test"), np.zeros((2, 1), complex)
    for swing, crosses in ((0.19, False), (0.21, True)):
        through[1] = swing
        assert Orbit(equation, through, 1.0).crosses() is crosses
