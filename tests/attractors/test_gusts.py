"""A gust drives as a force does; histories that are no drive are refused by name."""

import numpy as np
import pytest
from two_bars import SIZE, X, duffing

import foldyn as fd
from foldyn.attractors.drive import at_level, drive_frequency
from foldyn.errors import InputError

S = fd.discretize(
    fd.patterns.simple_fold(a=0.2, b=0.3, dihedral=150), fd.Sheet(1e8, 0.3, 2e-3, 500.0),
    preset="herkal", bend_law="linear", crease_stiffness=1.0,
)  # fmt: skip
HELD = [fd.Fix([2, 3, 4, 5])]
RISE = fd.Quantity("m", "rise", function=lambda u, v, t: u[0, 2])
RATE = 20.0  # 1/s, of the drag that makes motions settle


def gusty(frequency, push=0.0):
    history = fd.Harmonic(frequency, 30.0)
    air = fd.Air(added_mass=False, velocity=(0.0, 0.0, 4.0), history=history)
    loads = [fd.Force([0], (0, 0, push), history=history)] if push else []
    return fd.Case(S, HELD, loads, fd.Rayleigh(RATE), air=air)


def swing(case, frequency):
    motion = fd.simulate(case, 3.0 / frequency, method="rk4", interval=1.0 / frequency / 64)
    return 0.5 * np.ptp(motion.displacement.values[-65:, 0, 2])


@pytest.mark.matrix
def test_steps_of_the_frequency_and_of_the_size_take_a_gust_along():
    options = {"sweep": "up", "settle": 2, "record": 4}
    found = fd.bifurcation_diagram(gusty(2.0, push=0.2), RISE, frequencies=[2.0, 3.0], **options)
    assert found.amplitude.values[0, 1] == pytest.approx(swing(gusty(3.0, 0.2), 3.0), rel=1e-2)
    assert (found.periods == 1).all()
    alone = fd.bifurcation_diagram(gusty(2.0), RISE, amplitudes=[1.0, 1.5], **options)
    stronger = at_level(gusty(2.0), 1.5)
    assert stronger.air == fd.Air(
        added_mass=False, velocity=(0.0, 0.0, 6.0), history=fd.Harmonic(2.0, 30.0)
    )
    assert alone.amplitude.values[0, 1] == pytest.approx(swing(stronger, 2.0), rel=1e-2)
    assert alone.amplitude.values[0, 1] > 1.5 * alone.amplitude.values[0, 0]


@pytest.mark.matrix
def test_a_gust_glides_and_sets_the_period():
    case = gusty(2.0)
    found = fd.swept_sine(case, RISE, frequencies=(2.0, 2.2), duration=5.0, sweep="up", settle=2)
    middle = float(found.frequency[0, 6])
    assert found.amplitude.values[0, 6] == pytest.approx(swing(gusty(middle), middle), rel=0.02)
    still = [fd.State(np.zeros_like(S.nodes))] * 2
    ends = fd.basins(case, lambda k: still[int(k)], grid={"k": [0, 1]}, duration=1.5, record=4)
    assert ends.basin.values.tolist() == [0, 0]
    assert ends.attrs["period"] == pytest.approx(0.5)
    section = fd.poincare_section(fd.simulate(case, 2.5, method="rk4", interval=0.0125), after=1.5)
    assert section.sizes["time"] == 3 and np.ptp(section.displacement.values[:, 0, 2]) < 1e-6


def test_wind_drives_by_added_mass_too_and_still_air_does_not():
    case = gusty(2.0)
    air = fd.Air(added_mass=True, drag=False, velocity=(0, 0, 1.0), history=fd.Harmonic(2.0))
    assert drive_frequency(case) == 2.0
    assert drive_frequency(case.altered(air=air)) == 2.0
    still = fd.Air(history=fd.Harmonic(2.0))
    assert drive_frequency(case.altered(air=still)) == 0.0


@pytest.mark.parametrize("search", [fd.bifurcation_diagram, fd.swept_sine])
def test_other_histories_are_refused_by_their_place(search):
    case = duffing(1.0, 0.2, 0.1)
    slow = fd.Force([1], (0, 0, 0.1 * SIZE), history=fd.Ramp(1.0))
    options = {"duration": 500.0} if search is fd.swept_sine else {}
    for other, place in (
        (case.altered(loads=[*case.loads, slow]), r"loads\[1\].history: is of the kind 'ramp'"),
        (
            gusty(2.0).altered(air=fd.Air(velocity=(1, 0, 0), history=fd.Ramp(1.0))),
            "air.history: is of the kind 'ramp'",
        ),
    ):
        measure = X if other.structure is case.structure else RISE
        with pytest.raises(InputError, match=place):
            search(other, measure, frequencies=[0.1, 0.2], **options)


def test_a_wind_that_jumps_in_a_motion_is_refused_by_its_place():
    air = fd.Air(velocity=(0.0, 0.0, 1.0), history=fd.Step(0.1))
    with pytest.raises(InputError, match=r"air: the wind .* jumps at t = 0\.1 s"):
        fd.simulate(gusty(2.0).altered(air=air), 0.2, method="rk4")
