"""Implicit methods on folded sheets: order, convergence to RK4, solvers, damping at the start."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from oscillators import LENGTH, MASS, duffing_law, oscillator

import foldyn as fd
from foldyn.algebra import solvers
from foldyn.checks import observed_order
from foldyn.dynamics import METHODS
from foldyn.dynamics.implicit.matrix import StepMatrix, Weights
from foldyn.dynamics.system import pack
from foldyn.errors import FoldynWarning
from foldyn.studies import find_case

IMPLICIT = [name for name, method in METHODS.items() if method.implicit]
SHEET = fd.Sheet(1e6, 0.25, 0.01, 1.0)
SUPPORTS = (fd.Fix([0, 1, 2], "x"), fd.Fix([0, 2, 6, 8], "z"), fd.Fix([1], "y"))


def miura(**options) -> fd.Structure:
    pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=60)
    return fd.discretize(pattern, SHEET, **options, preset="herkal")


@pytest.mark.parametrize("mass", ["circumcenter", "consistent"])
@pytest.mark.parametrize("method", IMPLICIT)
def test_order_on_a_miura_with_smooth_laws(method, mass):
    """Linear folds and bends, a smooth load, both kinds of damping: the observed order is 2."""
    load = fd.Force([7], (0.01, 0.0, 0.0), fd.Harmonic(frequency=0.7))
    s = miura(fold_law="linear", bend_law="linear", mass=mass)
    case = fd.Case(s, SUPPORTS, [load], fd.Rayleigh(0.5, 1e-4))
    reference = fd.simulate(case, 1.0, dt=1.0 / 40000, every=40000).displacement[-1]
    steps, errors = np.array([50, 100, 200]), []
    for n in steps:
        motion = fd.simulate(case, 1.0, method, dt=1.0 / n, every=int(n))
        errors.append(float(np.linalg.norm(motion.displacement[-1] - reference)))
    assert errors[-1] < 1e-3 * float(np.linalg.norm(reference))
    assert observed_order(1.0 / steps, errors) == pytest.approx(2.0, abs=0.15)


@pytest.mark.parametrize("method", IMPLICIT)
def test_case_2_converges_to_the_motion_of_rk4(method):
    """As shipped: superlinear bends, locking folds, a half-sine pulse.

    Bends that pass through rest leave an error of dt^(7/3) in a step, less than what a method of
    order 2 errs by anyway: the observed order is 2.0.
    """
    case = fd.read_case(find_case("herkal/case2")).case("circumcenter")
    reference = fd.simulate(case, 2.0, dt=2.0 / 16000, every=400)
    peak = float(np.abs(reference.displacement).max())
    steps, errors = np.array([200, 400, 800]), []
    for n in steps:
        motion = fd.simulate(case, 2.0, method, dt=2.0 / n, every=int(n) // 40)
        errors.append(float(np.abs(motion.displacement - reference.displacement).max()) / peak)
    assert errors[0] < 0.01
    assert observed_order(2.0 / steps, errors) == pytest.approx(2.0, abs=0.1)
    adaptive = fd.simulate(case, 2.0, method, every=0.05)
    assert float(np.abs(adaptive.displacement - reference.displacement).max()) < 0.005 * peak
    assert adaptive.attrs["steps"] < 800


@pytest.mark.filterwarnings("ignore:damping. beta resists rotations")
@pytest.mark.parametrize("mass", ["circumcenter", "consistent"])
@pytest.mark.parametrize("method", IMPLICIT)
def test_band_and_sparse_matrix_give_the_same_motion(method, mass, monkeypatch):
    load = fd.Force([7], (0.01, 0.0, 0.0), fd.HalfSine(0.5))
    case = fd.Case(miura(mass=mass), SUPPORTS, [load], fd.Rayleigh(0.1, 1e-4))
    band = fd.simulate(case, 0.5, method, dt=5e-3)
    assert band.attrs["linear_solver"] == "banded"
    scale = float(np.abs(band.displacement).max())
    monkeypatch.setattr(solvers, "MOST_UNSYMMETRIC", 0.0)
    for name, backend in solvers.SOLVERS.items():
        if not backend.found():
            continue
        only = {name: backend._replace(band=0.0, worthwhile=0)}
        monkeypatch.setattr(solvers, "SOLVERS", only)
        sparse = fd.simulate(case, 0.5, method, dt=5e-3)
        symmetric = method != "energy_momentum"
        assert sparse.attrs["linear_solver"] == (name if symmetric else "superlu")
        apart = np.abs(sparse.displacement - band.displacement).max()
        assert float(apart) < 1e-6 * scale


@pytest.mark.parametrize("symmetric", [True, False])
@pytest.mark.parametrize("definite", [True, False])
def test_the_matrix_of_a_step_is_the_weighted_sum(symmetric, definite):
    """Against dense algebra; an indefinite one goes another way to the same solution."""
    s = miura(mass="consistent")
    case = fd.Case(s, SUPPORTS, damping=fd.Rayleigh(0.3, 2e-3))
    u = 1e-3 * np.random.default_rng(2).standard_normal(s.nodes.shape)
    matrix = StepMatrix(pack(case, 1e-3), symmetric)
    k = s.tangent(u)
    matrix.stiffness[:] = k.tobsr((3, 3)).data
    mass, k0 = np.kron(s.mass.toarray(), np.eye(3)), s.tangent(np.zeros_like(u)).toarray()
    weights = Weights(0.6 if definite else -0.6, 1e6, 7.0)
    dense = weights.stiffness * k.toarray() + 1e6 * mass + 7.0 * 2e-3 * k0
    free = case.free_dofs
    dense = dense[np.ix_(free, free)]
    assert (np.linalg.eigvalsh(dense)[0] > 0.0) == definite
    matrix.follow(u, 1.0)
    matrix.factorize(weights)
    right = np.random.default_rng(4).standard_normal(s.nodes.shape)
    found = matrix.solve(right, np.zeros_like(u))
    wanted = np.linalg.solve(dense, right.ravel()[free])
    np.testing.assert_allclose(found.ravel()[free], wanted, atol=1e-9 * np.abs(wanted).max())
    np.testing.assert_array_equal(found.ravel()[case.supported_dofs], 0.0)


@pytest.mark.parametrize("method", ["rk4", "newmark", "energy_momentum"])
def test_damping_by_the_stiffness_at_the_start(method):
    """A stiffening spring stretched by a force, and shaken a little there.

    With K0 at the start the small vibration has the damping ratio beta w / 2 of its own frequency;
    with K0 at rest that of the softer spring.
    """
    stiffness, cubic, stretch, beta = 8.0, 40.0, 0.5, 0.02
    own = stiffness * (1.0 + 3.0 * cubic * (stretch / LENGTH) ** 2)
    omega = np.sqrt(own / MASS)
    force = stiffness * stretch * (1.0 + cubic * (stretch / LENGTH) ** 2)
    u = np.zeros((2, 3))
    u[1, 0] = stretch + 1e-5
    for state, damper in (("start", own), ("rest", stiffness)):
        free = oscillator(duffing_law(cubic), stiffness)
        case = fd.Case(
            free.structure, free.supports, [fd.Force([1], (force, 0.0, 0.0))],
            fd.Rayleigh(beta=beta, state=state),
        )  # fmt: skip
        motion = fd.simulate(case, 0.8, method, dt=5e-4, initial=fd.State(u))
        t = motion.time.to_numpy()
        ratio = 0.5 * beta * damper / MASS / omega
        damped, decay = omega * np.sqrt(1.0 - ratio**2), ratio * omega
        exact = np.cos(damped * t) + decay / damped * np.sin(damped * t)
        exact *= 1e-5 * np.exp(-decay * t)
        x = motion.displacement[:, 1, 0].to_numpy() - stretch
        np.testing.assert_allclose(x, exact, atol=2e-3 * 1e-5)


def test_damping_that_drives_is_told():
    """A folded sheet pulled against its locked folds is stable; one pushed in buckles."""
    free = oscillator(duffing_law(-40.0), 8.0)
    u = np.zeros((2, 3))
    u[1, 0] = 0.5
    case = fd.Case(free.structure, free.supports, [], fd.Rayleigh(beta=1e-3, state="start"))
    with pytest.warns(FoldynWarning, match="drives 1 motion instead of damping it"):
        fd.simulate(case, 0.01, "newmark", dt=1e-3, initial=fd.State(u))
    stable = fd.Case(miura(), SUPPORTS, [], fd.Rayleigh(beta=1e-5, state="start"))
    with warnings.catch_warnings():
        warnings.simplefilter("error", FoldynWarning)
        fd.simulate(stable, 0.01, "newmark", dt=1e-3)


def test_explicit_methods_name_the_remedy_for_stiff_damping():
    load = fd.Force([7], (0.01, 0.0, 0.0), fd.HalfSine(0.5))
    case = fd.Case(miura(), SUPPORTS, [load], fd.Rayleigh(beta=1e-2))
    with pytest.warns(FoldynWarning, match="generalized_alpha"):
        fd.simulate(case, 1e-3)
    follows = case.altered(damping=fd.StrainDamping(1e-2))
    with pytest.warns(FoldynWarning, match="the damping of strain rates makes the critical step"):
        fd.simulate(follows, 1e-3)
    motion = fd.simulate(follows, 1.0, "generalized_alpha", every=0.1)  # without a word
    assert motion.attrs["steps"] < 2000


@pytest.mark.parametrize("method", IMPLICIT)
def test_a_free_fold_comes_to_rest_at_its_new_angle(method):
    """Nothing holds it: the dihedral of the crease becomes the rest angle."""
    pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60)
    s = fd.discretize(
        pattern, SHEET, fold_law=fd.EnhancedLinear(90, 270), bend_law="linear", preset="herkal"
    )
    go = fd.Actuate([0], 200.0, fd.Ramp(duration=3.0, smooth=True))
    motion = fd.simulate(fd.Case(s, loads=[go], damping=fd.Rayleigh(alpha=6.0)), 12.0, method)
    folds, _ = s.dihedrals(motion.displacement[-1])
    assert np.degrees(folds[0]) == pytest.approx(200.0, abs=0.05)
    assert motion.attrs["energy_error"] < (1e-8 if method == "energy_momentum" else 1e-2)
    assert motion.attrs["steps"] < 3000


@pytest.mark.parametrize("method", IMPLICIT)
def test_settles_in_the_static_equilibrium(method):
    """Case study 1 under a slow load with strong damping: where statics finds it."""
    pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60)
    s = fd.discretize(pattern, SHEET, preset="herkal")
    supports = [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "z")]
    slow = fd.Force([0, 1], (-1e-3, 0.0, 0.0), fd.Ramp(5.0))
    motion = fd.simulate(fd.Case(s, supports, [slow], fd.Rayleigh(3.0)), 25.0, method, every=5.0)
    path = fd.trace(fd.Case(s, supports, [fd.Force([0, 1], (-1e-3, 0.0, 0.0))]))
    np.testing.assert_allclose(motion.displacement[-1], path.displacement[-1], atol=1e-4 * 0.0312)
