"""Explicit methods: edge angles (n5b8e) and rotations (shells) have an inertia of their own."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from measured import apart, balance, drift, energy
from moving_sheets import EXPLICIT
from scipy import linalg

import foldyn as fd
from foldyn.dynamics.driver import prepare
from foldyn.dynamics.stability import hidden_inertia
from foldyn.linear.linearized import linearize
from pairwise import beyond

MIURA = fd.patterns.miura(cells=(1, 2), a=0.05, b=0.05, panel_angle=60, dihedral=90)
WIDER = fd.patterns.miura(cells=(2, 2), a=0.05, b=0.05, panel_angle=60, dihedral=90)
PAPER = fd.Sheet(2e9, 0.3, 3e-4, 700.0)
HELD = [fd.Fix("xmin")]
KINDS = {
    "condensed": {},
    "inertia_exact": {"mass": "inertia_exact"},
    "bars": {"membrane": "bars"},
    "stiff creases": {"crease_stiffness": 50.0},
    "a rigid panel": {"rigid": [1]},
    "locking": {"fold_law": fd.EnhancedLinear(80, 120)},
    "shell": None,
}


@pytest.fixture(autouse=True)
def _unwarned():
    """Of creases as stiff as these."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fd.errors.ModelRangeWarning)
        yield


def structure(kind, pattern=MIURA):
    options = KINDS[kind]
    if options is None:
        return fd.shell(pattern, PAPER, divisions=2, mass="consistent")
    return fd.discretize(pattern, PAPER, preset="n5b8e", **options)


def struck(made, speed=0.05):
    """Velocities that grow with the distance from the held end."""
    x = made.structure.nodes
    velocity = np.zeros(x.shape)
    velocity[:, 2] = speed * (np.ptp(x[:, 0]) ** -1 * (x[:, 0] - x[:, 0].min())) ** 2
    velocity[made.fixed] = 0.0
    return fd.State(np.zeros(x.shape), velocity)


def frequencies(made, inertia):
    """Frequencies (rad/s) of nodes and hidden dofs together; nodes alone without an inertia."""
    found = linearize(made)
    stiffness, mass = found.stiffness.toarray(), found.mass.toarray()
    hidden = np.flatnonzero(~mass.any(axis=0))
    if inertia is None:
        own = np.delete(np.arange(len(mass)), hidden)
        across = stiffness[np.ix_(hidden, own)]
        give = across.T @ np.linalg.solve(stiffness[np.ix_(hidden, hidden)], across)
        stiffness, mass = stiffness[np.ix_(own, own)] - give, mass[np.ix_(own, own)]
    else:
        mass[hidden, hidden] = inertia
    return np.sqrt(linalg.eigh(stiffness, mass, eigvals_only=True))


@pytest.mark.parametrize("kind", KINDS)
def test_frequencies_hardly_change_nor_does_the_step(kind):
    """The first ten by 0.002 %, the last one and with it the step by an eighth at most."""
    made = fd.Case(structure(kind, WIDER), HELD)
    by_folds = made.altered(structure=made.structure.for_explicit)
    bare, own = frequencies(made, None), frequencies(by_folds, hidden_inertia(by_folds))
    assert np.abs(own[:10] / bare[:10] - 1.0).max() < 2e-5
    assert 1.0 - 1e-9 < own[-1] / bare[-1] < 1.14
    assert fd.dynamics.largest_frequency(made) == pytest.approx(own[-1], rel=1e-3)


@pytest.mark.parametrize("kind", KINDS)
def test_dofs_of_explicit_methods_are_those_of_the_same_model(kind):
    """In balance the same energies and forces; elsewhere forces are the energy's gradient."""
    made = structure(kind)
    one, other, size = made.body, made.for_explicit.body, made.nodes.size
    rng = np.random.default_rng(0)
    u = 1e-4 * rng.normal(size=made.nodes.shape)
    q, z = one.dofs(u), other.dofs(u)
    np.testing.assert_allclose(other.energies(z), one.energies(q), rtol=1e-9, atol=1e-18)
    force = one.internal(q)
    np.testing.assert_allclose(other.internal(z)[:size], force[:size], atol=1e-9 * abs(force).max())
    step = 1e-7 * rng.normal(size=z.size)
    tangent = other.tangent(z) @ step
    change = 0.5 * (other.internal(z + step) - other.internal(z - step))
    np.testing.assert_allclose(tangent, change, atol=1e-6 * abs(change).max())
    z[size:] += 1e-5 * rng.normal(size=z.size - size)
    change = 0.5 * (other.energies(z + step).sum() - other.energies(z - step).sum())
    assert change == pytest.approx(other.internal(z) @ step, rel=1e-6)


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("kind", "method"),
    [("condensed", method) for method in EXPLICIT]
    + [("shell", "central_difference"), ("inertia_exact", "rk4")]
    + beyond([(kind, "rk4") for kind in ("bars", "a rigid panel", "shell")], 1),
)
def test_a_smooth_motion_is_that_without_inertia(kind, method):
    """By generalized_alpha; the energies include those of rotations, and balance."""
    load = fd.Force("xmax", (0, 0, 2e-4), fd.HalfSine(0.05))
    made = fd.Case(structure(kind), HELD, [load], damping=fd.Rayleigh(alpha=3.0))
    close = {"tolerance": 1e-8} if method == "dormand_prince" else {}
    found = fd.simulate(made, 0.06, method=method, interval=0.005, **close)
    wanted = fd.simulate(made, 0.06, method="generalized_alpha", dt=2e-5, interval=0.005)
    assert apart(found, wanted) < 1e-4
    assert balance(found) < 1e-5
    for name in ("kinetic", "work", "dissipated"):
        assert apart(found[name].values, wanted[name].values) < 2e-4


@pytest.mark.matrix
@pytest.mark.parametrize("kind", ["condensed", "inertia_exact", "shell"])
def test_a_free_sheet_keeps_its_momenta_and_its_energy(kind):
    made = fd.Case(structure(kind))
    rng = np.random.default_rng(1)
    begin = fd.State(np.zeros(made.fixed.shape), 0.05 * rng.normal(size=made.fixed.shape))
    close = fd.critical_step(made) / 12.0
    motion = fd.simulate(made, 2e-3, method="rk4", dt=close, initial=begin)
    x, v = made.structure.nodes + motion.displacement.values, motion.velocity.values
    p = np.einsum("nm,tma->tna", made.mass.toarray(), v)
    linear, angular = p.sum(axis=1), np.cross(x, p).sum(axis=1)
    assert np.abs(linear - linear[0]).max() < 1e-11 * np.abs(p).sum()
    assert np.abs(angular - angular[0]).max() < 1e-6 * np.abs(np.cross(x, p)).sum()
    central = fd.simulate(made, 2e-3, method="central_difference", dt=close, initial=begin)
    assert drift(energy(motion)) < 1e-3
    assert drift(energy(central)) < 1e-2


def test_kinetic_energy_includes_rotations_that_follow_the_nodes():
    made = fd.Case(structure("condensed"), HELD)
    begin = struck(made)
    motion = prepare(made, 0.01, "rk4", initial=begin)
    body, packed, state = motion.case.body, motion.packed, motion.state
    size = made.structure.nodes.size
    speed = packed.numbering.outward(state.v[: len(packed.numbering.order)])
    assert np.array_equal(speed, begin.velocity)
    rate, apart_by = state.v.ravel()[size : body.size], 1e-6
    ends = [body.dofs(sign * apart_by * begin.velocity)[size:] for sign in (-1.0, 1.0)]
    np.testing.assert_allclose(
        rate, np.subtract(*ends[::-1]) / (2.0 * apart_by), rtol=1e-5, atol=1e-7
    )
    own = 0.5 * (hidden_inertia(motion.case) * rate**2).sum()
    nodal = 0.5 * np.vdot(begin.velocity, made.mass @ begin.velocity)
    found = float(fd.simulate(made, 1e-4, method="rk4", initial=begin).kinetic[0])
    assert own > 0.0
    assert found == pytest.approx(own + nodal, rel=1e-12)


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore:creases are damped")
@pytest.mark.parametrize("method", EXPLICIT)
def test_a_motion_goes_on_from_a_checkpoint_bit_for_bit(method, tmp_path):
    made = fd.Case(structure("condensed"), HELD, damping=fd.CreaseDamping(1e-4))
    given = {"method": method, "interval": 1e-4, "initial": struck(made)}
    whole = fd.simulate(made, 4e-3, **given)

    def stop(progress):
        if progress.time > 2e-3:
            raise KeyboardInterrupt

    file = tmp_path / "run.nc"
    with pytest.raises(fd.errors.MotionInterrupted):
        fd.simulate(made, 4e-3, **given, store=file, checkpoint=1e-6, progress=stop)
    again = fd.simulate(made, 4e-3, **given, store=file, checkpoint=1e-6, resume=True)
    assert np.array_equal(again.displacement.values, whole.displacement.values)
    assert np.array_equal(again.kinetic.values, whole.kinetic.values)


def test_inertia_is_that_of_a_copy():
    """Turned and larger: rounding errors and eigenvalues found otherwise do not show."""
    made = fd.Case(structure("condensed").for_explicit, HELD)
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    larger = fd.Pattern(3.0 * MIURA.vertices @ turn.T, MIURA.faces)
    sheet = fd.Sheet(2e9, 0.3, 9e-4, 700.0)
    other = fd.discretize(larger, sheet, preset="n5b8e").for_explicit
    held = fd.Case(other, [fd.Fix(np.flatnonzero(made.fixed.all(axis=1)).tolist())])
    np.testing.assert_allclose(hidden_inertia(held), 27.0 * hidden_inertia(made), rtol=1e-9)


@pytest.mark.matrix
@pytest.mark.parametrize("method", EXPLICIT)
def test_a_motion_goes_on_from_the_last_sample_of_another(method):
    """With dofs that samples do not hold; not so the next implicit one, which balances them."""
    load = fd.Force("xmax", (0, 0, 2e-4), fd.HalfSine(0.05))
    made = fd.Case(structure("condensed"), HELD, [load], fd.CreaseDamping(1e-3))
    given = {"method": method, "interval": 2e-3}
    whole = fd.simulate(made, 8e-3, **given)
    half = fd.simulate(made, 4e-3, **given)
    state = fd.initial_state(half)
    rest = fd.simulate(made, 4e-3, **given, initial=state, start=4e-3)
    close = 1e-6 if method == "dormand_prince" else 1e-11
    assert apart(rest.displacement.values[-1], whole.displacement.values[-1]) < close
    assert np.array_equal(fd.initial_state(rest, 0).continuation.values, state.continuation.values)
    other = fd.simulate(made, 4e-3, method="newmark", interval=2e-3, initial=state, start=4e-3)
    assert apart(other.displacement.values[-1], whole.displacement.values[-1]) < 0.05
