"""`simulate` on folded sheets: reference motion, conservation, order, failures, bad input."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy import integrate

import foldyn as fd
from foldyn.checks import observed_order
from foldyn.errors import (
    ComputationError,
    FoldynWarning,
    InputError,
    InstabilityError,
    MotionInterrupted,
    PenetrationError,
)

GOLDEN = Path(__file__).resolve().parents[3] / "shared" / "golden"
SHEET = fd.Sheet(1e6, 0.25, 0.01, 1.0)
SUPPORTS = (fd.Fix([0, 1, 2], "x"), fd.Fix([0, 2, 6, 8], "z"), fd.Fix([1], "y"))


def miura(**options) -> fd.Structure:
    pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=60)
    return fd.discretize(pattern, SHEET, **options, preset="herkal")


def case2(history=None, alpha: float = 0.0628, beta: float = 0.0, **options) -> fd.Case:
    """Case study 2 of Herkal et al. (supports, pulse and damping: our assumptions)."""
    history = fd.HalfSine(duration=0.5) if history is None else history
    load = fd.Force([7], (0.01, 0.0, 0.0), history)
    return fd.Case(miura(**options), SUPPORTS, [load], fd.Rayleigh(alpha, beta))


def test_motion_of_the_golden_miura():
    """RK4 on MERLIN2's forces, 2000 steps: the stored motion to 1e-6 (found: 4e-10)."""
    file = GOLDEN / "rk4_miura11_L1_N5B8.npz"
    if not file.is_file():
        pytest.skip("needs ../shared")
    golden = np.load(file)
    pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=60)
    np.testing.assert_allclose(pattern.vertices, golden["nodes"][:9], atol=1e-12)
    sheet = fd.Sheet(1e6, 0.25, float(golden["thickness"]), float(golden["rho"]))
    structure = fd.discretize(
        pattern, sheet, mass="circumcenter", calibration="merlin2", preset="herkal"
    )
    np.testing.assert_allclose(structure.mass.diagonal(), golden["nodal_mass"], rtol=1e-12)
    supports = [fd.Fix([int(k // 3)], "xyz"[k % 3]) for k in golden["fixed_dofs"] - 1]
    forces = golden["load"].reshape(-1, 3)
    pulse = fd.Pulse(float(golden["t_load_off"]))
    loads = [
        fd.Force([int(n)], tuple(forces[n]), pulse) for n in np.flatnonzero(forces.any(axis=1))
    ]
    case = fd.Case(structure, supports, loads, fd.Rayleigh(float(golden["alpha"])))
    dt, steps, every = float(golden["dt"]), int(golden["n_steps"]), int(golden["store_every"])
    motion = fd.simulate(case, steps * dt, dt=dt, every=every)
    for name, stored in (("displacement", "Uhis"), ("velocity", "Vhis")):
        ours = motion[name].to_numpy()[1:].reshape(steps // every, -1)  # theirs starts at sample 1
        theirs = golden[stored].T
        assert np.linalg.norm(ours - theirs) < 1e-6 * np.linalg.norm(theirs)


def test_energy_of_case_2():
    """Balance below 1e-6 of the energies over 10 s at half the critical step (found: 2e-8)."""
    motion = fd.simulate(case2(mass="circumcenter"), 10.0, every=0.01)
    assert motion.attrs["dt"] == pytest.approx(0.01 / 27)
    assert motion.attrs["dt"] < 0.5 * motion.attrs["critical_step"]
    assert motion.attrs["energy_error"] < 1e-6
    assert motion.sizes["time"] == 1001
    balance = sum(
        motion[name]
        for name in ("kinetic", "strain_bars", "strain_folds", "strain_bends", "dissipated")
    )
    scale = float(motion.work.max())
    np.testing.assert_allclose(balance, motion.work, atol=1e-6 * scale)
    assert float(motion.work[-1]) > 1e-5


def test_order_on_a_miura_with_smooth_laws():
    """Linear folds and bends, a smooth load: the observed order is 4.0."""
    smooth = fd.Harmonic(frequency=0.7)
    case = case2(smooth, fold_law="linear", bend_law="linear", mass="circumcenter")
    # the fastest mode (3700 rad/s) is excited a little too: its phase must converge as well
    duration = 0.2
    reference = fd.simulate(case, duration, dt=duration / 64000, every=64000)
    steps = np.array([2000, 4000, 8000])
    errors = []
    for n in steps:
        motion = fd.simulate(case, duration, dt=duration / n, every=int(n))
        errors.append(float(np.linalg.norm(motion.displacement[-1] - reference.displacement[-1])))
    assert observed_order(duration / steps, errors) == pytest.approx(4.0, abs=0.1)


@pytest.mark.filterwarnings("ignore:the energy balance")
@pytest.mark.parametrize("mass", ["mixed_voronoi", "consistent"])
def test_free_flight_keeps_momentum(mass):
    """No supports, no loads: linear momentum to rounding, the center moves uniformly."""
    structure = miura(mass=mass)
    rng = np.random.default_rng(3)
    v = 0.1 * rng.standard_normal(structure.nodes.shape)
    case = fd.Case(structure)
    motion = fd.simulate(case, 0.5, every=50, initial=fd.State(velocity=v))
    total = structure.mass.sum()
    momentum = np.array([np.ones(len(v)) @ (structure.mass @ w) for w in motion.velocity.values])
    speed = np.abs(v).max() * total
    np.testing.assert_allclose(momentum, np.broadcast_to(momentum[0], momentum.shape),
                               atol=1e-12 * speed)  # fmt: skip
    middle = np.array(
        [np.ones(len(v)) @ (structure.mass @ u) / total for u in motion.displacement.values]
    )
    np.testing.assert_allclose(
        middle, motion.time.to_numpy()[:, None] * momentum[0] / total, atol=1e-12
    )


def test_consistent_mass_against_a_dense_solution():
    """One step of RK4 with the consistent matrix equals RK4 written with dense algebra."""
    case = case2(mass="consistent", alpha=0.3, beta=1e-4)
    s, free = case.structure, case.free_dofs
    dense = np.kron(s.mass.toarray(), np.eye(3))[np.ix_(free, free)]
    k0 = s.tangent(np.zeros_like(s.nodes)).toarray()[np.ix_(free, free)]
    damping = 0.3 * dense + 1e-4 * k0
    ((vector, history),) = case.load_terms

    def rate(t, u, v):
        full = np.zeros(s.nodes.size)
        full[free] = u
        force = s.internal_force(full.reshape(-1, 3)).ravel()[free]
        load = np.asarray(vector).ravel()[free] * history(t)
        return np.linalg.solve(dense, load - force - damping @ v)

    dt, steps = 1e-4, 50
    u, v = np.zeros(len(free)), np.zeros(len(free))
    for n in range(steps):
        t = n * dt
        a1 = rate(t, u, v)
        a2 = rate(t + dt / 2, u + dt / 2 * v, v + dt / 2 * a1)
        a3 = rate(t + dt / 2, u + dt / 2 * (v + dt / 2 * a1), v + dt / 2 * a2)
        a4 = rate(t + dt, u + dt * (v + dt / 2 * a2), v + dt * a3)
        u = u + dt * v + dt**2 / 6 * (a1 + a2 + a3)
        v = v + dt / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
    motion = fd.simulate(case, steps * dt, dt=dt, every=steps)
    ours = motion.displacement.to_numpy()[-1].ravel()[free]
    np.testing.assert_allclose(ours, u, rtol=0, atol=1e-10 * np.abs(u).max())


def test_reactions_balance_the_forces():
    """Momentum is the integral of reactions + loads - alpha times momentum, along each axis."""
    case = case2(mass="consistent")
    motion = fd.simulate(case, 1.0)
    s, time = case.structure, motion.time.to_numpy()
    for k, axis in enumerate("xyz"):
        at = (motion.support_axis == axis).to_numpy()
        reaction = motion.reaction.to_numpy()[:, at].sum(axis=1)
        load = 0.01 * fd.HalfSine(0.5)(time) * (k == 0)
        momentum = (s.mass @ motion.velocity.to_numpy()[:, :, k].T).sum(axis=0)
        force = reaction + load - 0.0628 * momentum
        impulse = integrate.cumulative_simpson(force, x=time, initial=0)
        np.testing.assert_allclose(impulse, momentum, atol=2e-4 * np.abs(momentum).max())


def test_runs_are_bit_identical():
    case = case2()
    first, second = (fd.simulate(case, 1.0, every=0.01) for _ in range(2))
    np.testing.assert_array_equal(first.displacement, second.displacement)


def test_stretches_do_not_change_the_motion():
    """Sampling and the length of compiled stretches leave the states untouched."""
    case = case2()
    dt = 2.5e-4
    dense = fd.simulate(case, 0.5, dt=dt, every=1)
    for every in (7, 1000, 2000):
        sparse = fd.simulate(case, 0.5, dt=dt, every=every)
        assert sparse.sizes["time"] == 2000 // every + 1
        np.testing.assert_array_equal(sparse.displacement, dense.displacement[::every])
        np.testing.assert_array_equal(sparse.work, dense.work[::every])
        np.testing.assert_allclose(sparse.time, dense.time[::every], rtol=1e-14)


@pytest.mark.filterwarnings("ignore:the energy balance")
def test_continued_from_a_stored_state():
    """A motion without load, cut in two, is the motion in one go."""
    structure = miura()
    v = np.zeros(structure.nodes.shape)
    v[7, 0] = 0.05
    case = fd.Case(structure, SUPPORTS)
    whole = fd.simulate(case, 0.4, dt=2e-4, every=500, initial=fd.State(velocity=v))
    half = fd.simulate(case, 0.2, dt=2e-4, every=500, initial=fd.State(velocity=v))
    rest = fd.simulate(case, 0.2, dt=2e-4, every=500, initial=fd.initial_state(half))
    np.testing.assert_array_equal(rest.displacement[-1], whole.displacement[-1])


def test_progress_is_told():
    seen = []
    fd.simulate(case2(), 1.0, every=0.1, progress=seen.append)
    times = [state.time for state in seen]
    assert times == sorted(times)
    assert times[-1] == pytest.approx(1.0)
    assert seen[-1].duration == pytest.approx(1.0)


def test_step_above_the_critical_one_is_refused_and_explodes_when_forced():
    case = case2()
    critical = fd.critical_step(case)
    with pytest.raises(InputError, match="above the critical step"):
        fd.simulate(case, 1.0, dt=1.05 * critical)
    with pytest.raises(ComputationError) as caught:
        fd.simulate(case, 5.0, dt=1.3 * critical, force=True)
    kept = caught.value.partial
    assert 1 < kept.sizes["time"] < 5.0 / (1.3 * critical)
    assert all(np.isfinite(kept[name]).all() for name in ("displacement", "velocity", "kinetic"))


def test_nan_in_a_history_stops_with_the_motion_until_then():
    case = case2(lambda t: np.where(t > 0.3, np.nan, 1.0))
    with pytest.raises(InstabilityError, match="finite number at every time") as caught:
        fd.simulate(case, 1.0, every=0.01)
    last = float(caught.value.partial.time[-1])
    assert 0.0 < last <= 0.31


@pytest.mark.filterwarnings("ignore:the energy balance")
def test_panels_that_pass_through_each_other_stop_the_motion():
    """Linear folds do not lock: a fold that is driven shut passes through, and says so."""
    pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60)
    structure = fd.discretize(pattern, SHEET, fold_law="linear", preset="herkal")
    v = np.zeros(structure.nodes.shape)
    v[[0, 1], 0], v[[4, 5], 0] = 10.0, -10.0
    with pytest.raises(PenetrationError, match="panel passed through panel") as caught:
        fd.simulate(fd.Case(structure), 2.0, every=10, initial=fd.State(velocity=v))
    folds, _ = structure.dihedrals(caught.value.partial.displacement[-1])
    assert folds[0] > np.radians(300)


def test_stiffening_is_noticed_during_the_motion():
    """A bar that stiffens a thousandfold when stretched makes a safe step unsafe."""
    from oscillators import duffing_law, oscillator, released

    case = oscillator(duffing_law(1e3), 8.0)
    fast = released(0.0, speed=20.0)
    critical = fd.critical_step(case)
    with pytest.raises(InstabilityError):
        fd.simulate(case, 40.0, dt=0.99 * critical, initial=fast)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"duration": 0.0}, "duration"),
        ({"duration": -1.0}, "duration"),
        ({"duration": float("nan")}, "duration"),
        ({"duration": "10"}, "duration"),
        ({"duration": 1.0, "dt": 0.0}, "dt"),
        ({"duration": 1.0, "dt": 2.0, "force": True}, "longer than the duration"),
        ({"duration": 1.0, "every": 0}, "every"),
        ({"duration": 1.0, "every": 2.0}, "every"),
        ({"duration": 1.0, "every": True}, "every"),
        ({"duration": 1.0, "dt": 1e-4, "every": 1.5e-4}, "whole number of steps"),
        ({"duration": 1.0, "method": "euler"}, "rk4"),
        ({"duration": 1e7, "every": 1}, "GiB"),
        ({"duration": 1.0, "initial": fd.State(np.zeros((4, 3)))}, "initial"),
        ({"duration": 1.0, "initial": fd.State(velocity=np.ones((13, 3)))}, "supported"),
    ],
)
def test_bad_arguments_are_refused(arguments, message):
    with pytest.raises(InputError, match=message):
        fd.simulate(case2(), **arguments)


def test_a_free_node_without_mass_is_refused():
    pattern = fd.Pattern([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [3, 3, 0]], [[0, 1, 2, 3]])
    structure = fd.discretize(pattern, SHEET, preset="herkal")
    with pytest.raises(InputError, match="node 4 is free but has no mass"):
        fd.simulate(fd.Case(structure), 0.1)
    fd.simulate(fd.Case(structure, [fd.Fix([4], "xyz")]), 0.1)


@pytest.mark.parametrize(("bend_law", "expected"), [("superlinear", 0.0312), ("linear", 0.0248)])
def test_settles_in_the_static_equilibrium(bend_law, expected):
    """Case study 1 under a slow load with strong damping comes to rest where forces balance.

    The displacements of the loaded edge are those of an independent static solution
    (0.0312 m with superlinear bends, 0.0248 m with linear ones).
    """
    pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60)
    s = fd.discretize(pattern, SHEET, mass="circumcenter", bend_law=bend_law, preset="herkal")
    load = fd.Force([0, 1], (-1e-3, 0.0, 0.0), fd.Ramp(5.0))
    case = fd.Case(s, [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "z")], [load], fd.Rayleigh(3.0))
    end = fd.simulate(case, 25.0, every=5.0).displacement.to_numpy()[-1]
    np.testing.assert_allclose(end[[0, 1], 0], -expected, atol=5e-5)
    force = s.internal_force(end).ravel()[case.free_dofs]
    load_vector = np.zeros(s.nodes.shape)
    load_vector[[0, 1], 0] = -1e-3
    residual = force - load_vector.ravel()[case.free_dofs]
    assert np.abs(residual).max() < 1e-4 * 1e-3


def test_an_interrupt_keeps_the_motion_until_then():
    def stop(state):
        if state.time > 0.5:
            raise KeyboardInterrupt

    with pytest.raises(MotionInterrupted, match="interrupted at t =") as caught:
        fd.simulate(case2(), 10.0, every=0.01, progress=stop)
    kept = caught.value.partial
    assert 0.2 < float(kept.time[-1]) < 9.0
    assert np.isfinite(kept.displacement).all()


def test_stiffness_damping_that_shrinks_the_step_is_told():
    with pytest.warns(FoldynWarning, match="times smaller"):
        fd.simulate(case2(beta=1e-2), 1e-3)


@pytest.mark.filterwarnings("ignore:the energy balance")
def test_a_result_can_be_run_again_from_itself():
    """The recipe of docs/results.md, with an initial state and a history of the user's own."""
    case = case2(lambda t: np.cos(3.0 * t))
    v = np.zeros(case.structure.nodes.shape)
    v[7, 0] = 0.01
    first = fd.simulate(case, 0.1, every=5, initial=fd.State(velocity=v))
    assert first.attrs["started_from"] == "state"
    again = fd.simulate(
        fd.case_of(first),
        float(first.duration),
        method=first.method,
        dt=float(first.dt),
        every=int(first.every),
        initial=fd.initial_state(first, at=0),
    )
    np.testing.assert_allclose(again.displacement, first.displacement, rtol=0, atol=1e-16)


@pytest.mark.parametrize("initial", [{"velocity": 0}, np.zeros((13, 3)), "rest"])
def test_an_initial_state_of_another_kind_is_refused(initial):
    with pytest.raises(InputError, match="give a State"):
        fd.simulate(case2(), 0.1, initial=initial)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"force": "no"}, "force"),
        ({"progress": "yes"}, "progress"),
        ({"method": ["rk4"]}, "method"),
    ],
)
def test_arguments_of_other_kinds_are_refused(arguments, message):
    with pytest.raises(InputError, match=message):
        fd.simulate(case2(), 0.1, **arguments)


def test_the_mass_cannot_be_changed_behind_the_structure():
    with pytest.raises(ValueError, match="read-only"):
        miura().mass.data[:] *= 2.0


def test_a_shifted_pattern_moves_the_same():
    """Far from the origin no digits are lost: hinges see positions from their mean."""
    pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=60)
    far = fd.Pattern(pattern.vertices + np.array([1e3, -2e3, 5e2]), pattern.faces)
    u = 0.01 * np.random.default_rng(0).standard_normal((13, 3))
    near, shifted = (
        fd.discretize(p, SHEET, preset="herkal").internal_force(u) for p in (pattern, far)
    )
    np.testing.assert_allclose(shifted, near, rtol=0, atol=1e-9 * np.abs(near).max())


def test_the_progress_bar_tells_pace_and_energy_error(capsys):
    fd.simulate(case2(), 1.0, every=0.01, progress=True)
    told = capsys.readouterr().err
    assert "steps/s" in told
    assert "energy error" in told
    assert "/1 s" in told
