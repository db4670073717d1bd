"""Energy landscapes of bistable structures."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from sheets import compression
from trusses import APEX, VonMises, snapped

import foldyn as fd
from foldyn.errors import InputError
from foldyn.statics import energy_landscape, landscape, trace

TRUSS = VonMises()


def test_truss():
    """Upright, flat (the top of the barrier) and hanging; closed forms in tests/statics/trusses."""
    case, h = TRUSS.case(), TRUSS.h
    found = landscape(snapped(case, past=2.1, first_step=0.5, steps=60), case)
    assert [state.stable for state in found.states] == [True, False, True]
    np.testing.assert_allclose([s.stroke for s in found.states], [0.0, h, 2 * h], atol=1e-10)
    for start, end in ((0, 1), (1, 0)):
        assert found.barrier(start, end) == pytest.approx(TRUSS.energy(h), rel=1e-9)
    np.testing.assert_allclose(found.negative_stiffness, [TRUSS.limit_at], rtol=1e-8)
    np.testing.assert_allclose(found.energy, TRUSS.energy(found.stroke), atol=1e-12)
    np.testing.assert_allclose(found.force, TRUSS.load(found.stroke), atol=1e-8 * TRUSS.limit)
    assert found.stable[1].displacement[APEX, 2] == pytest.approx(-2 * h, rel=1e-9)


def storey():
    """It snaps from 1.2 m to 0.51 m."""
    pattern = fd.patterns.kresling(sides=6, radius=1.0, height=1.2, twist=40)
    s = fd.discretize(pattern, fd.Sheet(1e6, 0.3, 0.01), fold_law="linear", preset="herkal")
    return s, fd.Fix(list(range(6)), "xyz"), list(range(6, 12))


@pytest.fixture(scope="module")
def kresling():
    s, low, top = storey()
    by_motion = trace(fd.Case(s, [low, fd.Impose(top, "z", -0.8)]), "displacement", steps=40)
    by_force = trace(
        fd.Case(s, [low], [fd.Force(top, (0, 0, -1.0))]), "arc_length", first_step=0.5, steps=300,
        until=lambda u, factor: u[6, 2] < -0.8,
    )  # fmt: skip
    return landscape(by_motion), landscape(by_force)


@pytest.mark.matrix
def test_kresling_by_force_and_by_displacement(kresling):
    """The two ways see one landscape; the force is that on all six nodes."""
    one, other = kresling
    assert len(one.states) == len(other.states) == 3
    for a, b in zip(one.states, other.states, strict=True):
        assert a.stroke == pytest.approx(b.stroke, rel=1e-8)
        assert a.energy == pytest.approx(b.energy, rel=1e-8, abs=1e-12)
        np.testing.assert_allclose(a.displacement, b.displacement, atol=1e-8)
    np.testing.assert_allclose(one.negative_stiffness, other.negative_stiffness, rtol=1e-7)
    assert [state.stable for state in one.states] == [True, False, True]


@pytest.mark.filterwarnings("ignore:the path loses stability")
def test_bifurcations_say_nothing_of_the_slope(monkeypatch):
    """The tangent is singular there, so that the response may point anywhere."""
    plain = energy_landscape.station_of

    def station_of(*given):
        station = plain(*given)
        singular = station.point.kind == "bifurcation"
        return station._replace(response=-station.response) if singular else station

    monkeypatch.setattr(energy_landscape, "station_of", station_of)
    steep = VonMises(h=2.0)
    case = steep.case(free="xz")
    path = snapped(case, first_step=100.0, steps=60)
    assert (path.point == "bifurcation").sum() == 2
    found = landscape(path, case)
    np.testing.assert_allclose(found.negative_stiffness, [steep.limit_at], rtol=1e-8)


def test_barrier_is_the_work_of_the_force(kresling):
    found, _ = kresling
    top = found.states[1]
    work = CubicSpline(found.stroke, found.force).integrate(0.0, top.stroke)
    assert work == pytest.approx(found.barrier(), rel=1e-4)
    assert found.barrier(1, 0) == pytest.approx(top.energy - found.states[2].energy)
    assert found.barrier(1, 0) > 10.0 * found.states[2].energy  # the second state is nearly free


def test_states_stay_when_let_go(kresling):
    """Each state without force is an equilibrium of the structure with its supports alone."""
    s, low, _ = storey()
    case = fd.Case(s, [low])
    for state in kresling[0].stable:
        path = trace(case, load_factors=[0.0], initial=fd.State(state.displacement))
        assert np.abs(path.displacement.values[0] - state.displacement).max() < 1e-7
        assert path.negative_eigenvalues.values.tolist() == [0]


def test_constant_loads_belong_to_the_energy():
    """With a dead load on the apex the states are those of the force beside it, P(v) = P0."""
    push = fd.Force([APEX], (0, 0, -1.0))
    case = TRUSS.case().altered(loads=[push, push])
    found = landscape(snapped(case, past=2.1, first_step=0.2, steps=80, constant=[0]), case)
    strokes = np.array([state.stroke for state in found.states])
    np.testing.assert_allclose(TRUSS.load(strokes), 1.0, rtol=1e-9)
    total = TRUSS.energy(strokes) - strokes
    np.testing.assert_allclose([s.energy for s in found.states], total - total[0], atol=1e-12)
    assert found.barrier() < TRUSS.energy(TRUSS.h)


def test_refuses_what_has_no_landscape():
    both = trace(compression(weight=True), "displacement", steps=3)  # its weight grows, too
    with pytest.raises(InputError, match="forces and moved supports together"):
        landscape(both)
    found = landscape(trace(compression(), "displacement", steps=3))
    assert len(found.states) == 1 and found.negative_stiffness == ()
    with pytest.raises(InputError, match="1 stable states, there is no 1"):
        found.barrier()
