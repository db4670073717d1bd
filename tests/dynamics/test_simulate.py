"""`simulate` on folded sheets: reference motion, reactions, restarts, failures, bad input."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from measured import apart
from moving_sheets import CELL_HELD, FOLD_HELD, HEAVY, IMPLICIT, LINEAR, SHEET, case2, cell, fold
from oscillators import duffing_law, oscillator, released
from scipy import integrate

import foldyn as fd
from foldyn import errors

GOLDEN = Path(__file__).resolve().parents[3] / "shared" / "golden"


def test_motion_of_the_golden_miura():
    """RK4 on MERLIN2's forces, 2000 steps: the stored motion to 1e-6 (found: 4e-10)."""
    file = GOLDEN / "rk4_miura11_L1_N5B8.npz"
    if not file.is_file():
        pytest.skip("needs ../shared")
    golden = np.load(file)
    sheet = fd.Sheet(1e6, 0.25, float(golden["thickness"]), float(golden["rho"]))
    s = cell(sheet=sheet, mass="circumcenter", calibration="merlin2")
    np.testing.assert_allclose(s.pattern.vertices, golden["nodes"][:9], atol=1e-12)
    np.testing.assert_allclose(s.mass.diagonal(), golden["nodal_mass"], rtol=1e-12)
    supports = [fd.Fix([int(k // 3)], "xyz"[k % 3]) for k in golden["fixed_dofs"] - 1]
    forces = golden["load"].reshape(-1, 3)
    pulse = fd.Pulse(float(golden["t_load_off"]))
    pushed = np.flatnonzero(forces.any(axis=1))
    loads = [fd.Force([int(n)], tuple(forces[n]), pulse) for n in pushed]
    case = fd.Case(s, supports, loads, fd.Rayleigh(float(golden["alpha"])))
    dt, steps, every = float(golden["dt"]), int(golden["n_steps"]), int(golden["store_every"])
    motion = fd.simulate(case, steps * dt, method="rk4", dt=dt, every_steps=every)
    for name, stored in (("displacement", "Uhis"), ("velocity", "Vhis")):
        ours = motion[name].values[1:].reshape(steps // every, -1)  # theirs starts at sample 1
        theirs = golden[stored].T
        assert np.linalg.norm(ours - theirs) < 1e-6 * np.linalg.norm(theirs)


@pytest.mark.matrix
def test_energy_of_case_2():
    """Balance below 1e-6 of the energies over 10 s at half the critical step (found: 2e-8)."""
    motion = fd.simulate(case2(mass="circumcenter"), 10.0, method="rk4", interval=0.01)
    assert motion.attrs["dt"] == pytest.approx(0.01 / 27)
    assert motion.attrs["dt"] < 0.5 * motion.attrs["critical_step"]
    assert motion.attrs["energy_error"] < 1e-6
    assert motion.sizes["time"] == 1001
    names = ("kinetic", "strain_bars", "strain_folds", "strain_bends", "dissipated")
    balance = sum(motion[name] for name in names)
    np.testing.assert_allclose(balance, motion.work, atol=1e-6 * float(motion.work.max()))
    assert float(motion.work[-1]) > 1e-5


def test_consistent_mass_against_a_dense_solution():
    """The equation of motion with dense matrices, solved by SciPy."""
    case = case2(mass="consistent", alpha=0.3, beta=1e-4)
    s, free = case.structure, case.free_dofs
    dense = np.kron(s.mass.toarray(), np.eye(3))[np.ix_(free, free)]
    k0 = s.tangent(np.zeros_like(s.nodes)).toarray()[np.ix_(free, free)]
    ((vector, history),) = case.load_terms

    def rate(t, state):
        u, v = np.split(state, 2)
        full = np.zeros(s.nodes.size)
        full[free] = u
        force = np.ravel(vector) * history(t) - s.internal_force(full.reshape(-1, 3)).ravel()
        return np.append(v, np.linalg.solve(dense, force[free] - (0.3 * dense + 1e-4 * k0) @ v))

    given = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-18}
    wanted = integrate.solve_ivp(rate, (0.0, 5e-3), np.zeros(2 * len(free)), **given).y[:, -1]
    end = fd.simulate(case, 5e-3, method="rk4", dt=2.5e-5, every_steps=200).isel(time=-1)
    found = [end[name].values.ravel()[free] for name in ("displacement", "velocity")]
    assert apart(found, np.split(wanted, 2)) < 1e-6


def test_reactions_balance_the_forces():
    """Momentum is the integral of reactions + loads - alpha times momentum, along each axis."""
    case = case2(mass="consistent")
    motion = fd.simulate(case, 1.0, method="rk4")
    time = motion.time.values
    for k, axis in enumerate("xyz"):
        reaction = motion.reaction.values[:, (motion.support_axis == axis).values].sum(axis=1)
        load = 0.01 * fd.HalfSine(0.5)(time) * (k == 0)
        momentum = (case.structure.mass @ motion.velocity.values[:, :, k].T).sum(axis=0)
        force = reaction + load - 0.0628 * momentum
        impulse = integrate.cumulative_simpson(force, x=time, initial=0)
        np.testing.assert_allclose(impulse, momentum, atol=2e-4 * np.abs(momentum).max())


@pytest.mark.parametrize("method", ["rk4", *IMPLICIT])
def test_runs_are_bit_identical_whatever_is_sampled(method):
    """Sampling and the length of compiled stretches leave the states untouched."""
    options = {"method": method, "dt": 2.5e-4 if method == "rk4" else 2.5e-3}
    case = case2()
    dense, again = (fd.simulate(case, 0.5, **options) for _ in range(2))
    np.testing.assert_array_equal(again.displacement, dense.displacement)
    for every in (7, 100, 2000) if method == "rk4" else (7,):
        thin = fd.simulate(case, 0.5, every_steps=every, **options)
        np.testing.assert_array_equal(thin.displacement, dense.displacement[::every])
        np.testing.assert_array_equal(thin.work, dense.work[::every])
        np.testing.assert_allclose(thin.time, dense.time[::every], rtol=1e-14)


@pytest.mark.matrix
@pytest.mark.parametrize("mass", ["mixed_voronoi", "consistent"])
@pytest.mark.parametrize("method", ["rk4", *IMPLICIT])
def test_a_motion_goes_on_from_where_it_was_stored(method, mass):
    """Continued at `start` with the stored state, moving supports included.

    The generalized-alpha method also carries an acceleration of its own, which a state has not:
    there the difference falls with the square of the step.
    """
    pull = fd.Impose([6, 7, 8], "x", 1e-3, lambda t: np.sin(300.0 * t))
    supports = [*CELL_HELD, pull, fd.BaseMotion("z", fd.Harmonic(40.0), 1e-4)]
    case, found = fd.Case(cell(sheet=HEAVY, mass=mass, **LINEAR), supports), []
    for n in [2000] if method == "rk4" else [200, 400]:
        options = {"dt": 0.02 / n, "every_steps": n // 20}
        whole = fd.simulate(case, 0.02, method=method, **options)
        middle = fd.initial_state(whole, at=10)
        rest = fd.simulate(case, 0.01, method=method, initial=middle, start=0.01, **options)
        np.testing.assert_allclose(rest.time, whole.time[10:], rtol=1e-14)
        late = whole.isel(time=slice(10, None))
        found.append(max(apart(rest, late), apart(rest, late, "velocity")))
    if method == "generalized_alpha":
        moved = apart(rest, late)
        assert moved < 1e-3 and found[0] / found[1] > 3.0
    else:
        assert max(found) < (1e-11 if method == "rk4" else 1e-6)


@pytest.mark.filterwarnings("ignore:the energy balance")
def test_a_result_can_be_run_again_from_itself():
    """The recipe of docs/results.md, with an initial state and a history of the user's own."""
    v = np.zeros((13, 3))
    v[7, 0] = 0.01
    case = case2(lambda t: np.cos(3.0 * t))
    first = fd.simulate(case, 0.1, method="rk4", every_steps=5, initial=fd.State(velocity=v))
    assert first.attrs["started_from"] == "state"
    again = fd.simulate(
        fd.case_of(first), float(first.duration), method=first.method, dt=float(first.dt),
        every_steps=int(first.every_steps), initial=fd.initial_state(first, at=0),
    )  # fmt: skip
    np.testing.assert_allclose(again.displacement, first.displacement, rtol=0, atol=1e-16)


@pytest.mark.parametrize("method", ["rk4", "newmark"])
def test_progress_is_told(method):
    seen = []
    fd.simulate(case2(), 1.0, method=method, interval=0.1, progress=seen.append)
    times = [state.time for state in seen]
    assert times == sorted(times)
    assert times[-1] == pytest.approx(1.0) == seen[-1].duration


def test_the_progress_bar_tells_pace_and_energy_error(capsys):
    fd.simulate(case2(), 1.0, method="rk4", interval=0.01, progress=True)
    told = capsys.readouterr().err
    assert all(words in told for words in ("steps/s", "energy error", "/1 s"))


def test_step_above_the_critical_one_is_refused_and_explodes_when_forced():
    case = case2()
    critical = fd.critical_step(case)
    with pytest.raises(errors.InputError, match="above the critical step"):
        fd.simulate(case, 1.0, method="rk4", dt=1.05 * critical)
    with pytest.raises(errors.ComputationError) as caught:
        fd.simulate(case, 5.0, method="rk4", dt=1.3 * critical, force=True)
    kept = caught.value.partial
    assert 1 < kept.sizes["time"] < 5.0 / (1.3 * critical)
    assert all(np.isfinite(kept[name]).all() for name in ("displacement", "velocity", "kinetic"))


@pytest.mark.filterwarnings("ignore:the energy balance")
@pytest.mark.parametrize(
    ("method", "options"),
    [
        ("rk4", {"every_steps": 10}),
        *((method, {"dt": 2e-3}) for method in IMPLICIT),
        *((method, {"tolerance": 1e-4}) for method in IMPLICIT),
    ],
)
def test_panels_that_pass_through_each_other_stop_the_motion(method, options):
    """Linear folds do not lock: a fold that is driven shut passes through, and says so."""
    s = fold(fold_law="linear")
    v = np.zeros(s.nodes.shape)
    v[[0, 1], 0], v[[4, 5], 0] = 10.0, -10.0
    start = fd.State(velocity=v)
    with pytest.raises(errors.PenetrationError, match="panel passed through panel") as caught:
        fd.simulate(fd.Case(s), 2.0, method=method, initial=start, **options)
    folds, _ = s.dihedrals(caught.value.partial.displacement[-1])
    assert folds[0] > np.radians(300)


@pytest.mark.matrix
def test_stiffening_is_noticed_or_followed():
    """A bar that stiffens a thousandfold when stretched makes a safe explicit step unsafe."""
    case, fast = oscillator(duffing_law(1e3), 8.0), released(0.0, speed=20.0)
    with pytest.raises(errors.InstabilityError):
        fd.simulate(case, 40.0, method="rk4", dt=0.99 * fd.critical_step(case), initial=fast)
    motion = fd.simulate(case, 4.0, method="energy_momentum", dt=0.01, initial=fast)
    assert motion.attrs["energy_error"] < 1e-9
    assert float(np.abs(motion.velocity).max()) < 20.5


@pytest.mark.filterwarnings("ignore:the history of a load is a function")
@pytest.mark.parametrize(
    ("method", "options"),
    [
        *((method, {"interval": 0.01}) for method in ("rk4", *IMPLICIT)),
        *((method, {"dt": 0.01}) for method in IMPLICIT),
    ],
)
def test_what_goes_wrong_is_named_and_the_motion_until_then_kept(method, options):
    bad = case2(lambda t: np.where(t > 0.3, np.nan, 1.0))
    with pytest.raises(errors.InstabilityError, match="finite number at every time") as caught:
        fd.simulate(bad, 1.0, method=method, **options)
    assert 0.0 < float(caught.value.partial.time[-1]) <= 0.31

    def broken(t):
        if np.max(t) > 0.3:
            raise ArithmeticError("no load is known beyond 0.3 s")
        return np.ones_like(t)

    with pytest.raises((errors.InstabilityError, ArithmeticError), match=r"beyond 0\.3 s"):
        fd.simulate(case2(broken), 1.0, method=method, **options)

    def stop(state):
        if state.time > 0.2:
            raise KeyboardInterrupt

    with pytest.raises(errors.MotionInterrupted, match="interrupted at t =") as interrupted:
        fd.simulate(case2(), 10.0, method=method, progress=stop, **options)
    kept = interrupted.value.partial
    assert 0.2 < float(kept.time[-1]) < 9.0
    assert np.isfinite(kept.displacement).all()


def test_nodes_without_mass_or_stiffness_are_refused():
    pattern = fd.Pattern([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [3, 3, 0]], [[0, 1, 2, 3]])
    for method, mass in (("rk4", "mixed_voronoi"), ("newmark", "consistent")):
        s = fd.discretize(pattern, SHEET, mass=mass, preset="herkal")
        with pytest.raises(errors.InputError, match="node 4 is free but has no mass"):
            fd.simulate(fd.Case(s), 0.1, method=method)
        fd.simulate(fd.Case(s, [fd.Fix([4], "xyz")]), 0.1, method=method)
    s = fd.discretize(pattern, SHEET, preset="herkal")
    with pytest.raises(errors.InstabilityError, match="a mass or a stiffness may be missing"):
        fd.simulate(fd.Case(s, [], [fd.Force([4], (1.0, 0.0, 0.0))]), 0.1, method="newmark")


@pytest.mark.parametrize(
    ("method", "bend_law", "expected"),
    [
        *((method, "superlinear", 0.0312) for method in ("rk4", *IMPLICIT)),
        ("rk4", "linear", 0.0248),
    ],
)
def test_settles_in_the_static_equilibrium(method, bend_law, expected):
    """Case study 1 under a slow load with strong damping comes to rest where forces balance.

    The displacements of the loaded edge are those of an independent static solution
    (0.0312 m with superlinear bends, 0.0248 m with linear ones).
    """
    s = fold(mass="circumcenter", bend_law=bend_law)
    slow, push = (fd.Force([0, 1], (-1e-3, 0.0, 0.0), h) for h in (fd.Ramp(5.0), None))
    case = fd.Case(s, FOLD_HELD, [slow], fd.Rayleigh(3.0))
    end = fd.simulate(case, 25.0, method=method, interval=5.0).displacement.values[-1]
    np.testing.assert_allclose(end[[0, 1], 0], -expected, atol=5e-5)
    path = fd.trace(fd.Case(s, FOLD_HELD, [push])).displacement.values[-1]
    assert apart(end, path) < 1e-4


@pytest.mark.matrix
@pytest.mark.parametrize("method", ["rk4", *IMPLICIT])
def test_a_free_fold_comes_to_rest_at_its_new_angle(method):
    """Nothing holds it: the dihedral of the crease becomes the rest angle and no energy stays."""
    s = fold(
        bend_law="linear", fold_law="linear" if method == "rk4" else fd.EnhancedLinear(90, 270)
    )
    go = fd.Actuate([0], 200.0, fd.Ramp(duration=3.0, smooth=True))
    motion = fd.simulate(
        fd.Case(s, loads=[go], damping=fd.Rayleigh(alpha=6.0)), 12.0, method=method
    )
    folds, _ = s.dihedrals(motion.displacement[-1])
    assert np.degrees(folds[0]) == pytest.approx(200.0, abs=0.05)
    assert float(motion.strain_folds[-1]) < 1e-5 * float(motion.work[-1])
    assert motion.attrs["energy_error"] < (1e-8 if method == "energy_momentum" else 1e-2)
    assert method == "rk4" or motion.attrs["steps"] < 3000


def test_small_vibrations_have_the_frequency_of_the_mode_without_a_secant():
    """In the default model."""
    case = fd.Case(fd.discretize(fd.patterns.miura(dihedral=60), SHEET, preset="plate"), CELL_HELD)
    mode = fd.modes(case, 1)
    assert mode.attrs["soft_hinges"] == 0
    assert fd.critical_step(case) > 4e-4  # s
    shape, period = mode.shape.values[0], 1.0 / float(mode.frequency[0])
    start = fd.State(1e-4 * shape / np.abs(shape).max())
    motion = fd.simulate(
        case, period, method="newmark", dt=period / 400, interval=period, initial=start
    )
    np.testing.assert_allclose(motion.displacement[-1], start.displacement, atol=2e-7)


# ------------------------------------------------------------------ input
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        *(({"duration": given}, "duration") for given in (0.0, -1.0, float("nan"), "10")),
        ({"dt": 0.0}, "dt"),
        ({"dt": 2.0, "force": True}, "longer than the duration"),
        *(({"interval": given}, "interval") for given in (0.0, 2.0, True)),
        *(({"every_steps": given}, "every_steps") for given in (0, 0.5, True, 10**6)),
        ({"every_steps": 2, "interval": 0.1}, "either every_steps or interval"),
        ({"dt": 1e-4, "interval": 1.5e-4}, "whole number of steps"),
        ({"method": "euler"}, "rk4"),
        ({"method": ["rk4"]}, "method"),
        ({"duration": 1e7, "every_steps": 1}, "GiB"),
        ({"force": "no"}, "force"),
        ({"progress": "yes"}, "progress"),
        ({"start": float("nan")}, "start = nan"),
        ({"initial": fd.State(np.zeros((4, 3)))}, "initial"),
        ({"initial": fd.State(velocity=np.ones((13, 3)))}, "supported"),
        ({"initial": {"velocity": 0}}, "give a State"),
        ({"initial": np.zeros((13, 3))}, "give a State"),
        ({"initial": "rest"}, "give a State"),
        ({"tolerance": 1e-6}, "rk4 has fixed steps"),
        ({"method": "dormand_prince", "tolerance": 0.0}, "tolerance = 0.0"),
        ({"method": "dormand_prince", "tolerance": "fine"}, "tolerance"),
        ({"method": "dormand_prince", "dt": 10.0}, "longer than the duration"),
        ({"method": "dormand_prince", "interval": 9.0}, "longer than the duration"),
        ({"method": "dormand_prince", "every_steps": 0}, "at least 1"),
        ({"method": "newmark", "tolerance": -1.0}, "tolerance = -1"),
        ({"method": "generalized_alpha", "spectral_radius": 1.2}, "at most 1"),
        ({"method": "generalized_alpha", "spectral_radius": "half"}, "must be a number"),
        ({"method": "newmark", "spectral_radius": 0.8}, "newmark has none"),
        ({"spectral_radius": 0.8}, "rk4 has none"),
    ],
)
def test_bad_arguments_are_refused(arguments, message):
    with pytest.raises(errors.InputError, match=message):
        fd.simulate(case2(), **{"duration": 1.0, "method": "rk4"} | arguments)


def test_damping_that_costs_many_explicit_steps_is_told_with_a_remedy():
    stiff = case2(beta=1e-2)
    with pytest.warns(errors.FoldynWarning, match=r"(?s)times smaller.*generalized_alpha"):
        fd.simulate(stiff, 1e-3, method="rk4")
    follows = stiff.altered(damping=fd.StrainDamping(1e-2))
    said = "the damping of strain rates makes the critical step"
    with pytest.warns(errors.FoldynWarning, match=said):
        fd.simulate(follows, 1e-3, method="rk4")
    motion = fd.simulate(follows, 1.0, method="generalized_alpha", interval=0.1)  # without a word
    assert motion.attrs["steps"] < 2000


def test_the_mass_cannot_be_changed_behind_the_structure():
    with pytest.raises(ValueError, match="read-only"):
        cell().mass.data[:] *= 2.0


def test_a_shifted_pattern_moves_the_same():
    """Far from the origin no digits are lost: hinges see positions from their mean."""
    near = cell()
    far = fd.Pattern(near.pattern.vertices + np.array([1e3, -2e3, 5e2]), near.pattern.faces)
    u = 0.01 * np.random.default_rng(0).standard_normal((13, 3))
    shifted = fd.discretize(far, SHEET, preset="herkal").internal_force(u)
    assert apart(shifted, near.internal_force(u)) < 1e-9
