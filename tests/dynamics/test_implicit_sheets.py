"""Implicit methods on folded sheets: convergence to RK4, solvers, damping at the start."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from measured import apart, order
from moving_sheets import CELL_HELD, IMPLICIT, SHEET, case2, cell
from oscillators import LENGTH, MASS, damped, duffing_law, oscillator, place, pulled, released
from scipy import sparse

import foldyn as fd
from foldyn.algebra import solvers
from foldyn.dynamics.implicit.matrix import StepMatrix, Weights
from foldyn.dynamics.system import pack
from foldyn.errors import FoldynWarning
from foldyn.studies import find_case


@pytest.mark.matrix
@pytest.mark.parametrize("method", IMPLICIT)
def test_case_2_converges_to_the_motion_of_rk4(method):
    """As shipped: superlinear bends, locking folds, a half-sine pulse.

    Bends that pass through rest leave an error of dt^(7/3) in a step, less than what a method of
    order 2 errs by anyway: the observed order is 2.0.
    """
    case = fd.read_case(find_case("herkal/case2")).case("circumcenter")
    reference = fd.simulate(case, 2.0, method="rk4", dt=2.0 / 16000, every_steps=400)
    steps = [200, 400, 800]
    motions = [
        fd.simulate(case, 2.0, method=method, dt=2.0 / n, every_steps=n // 40) for n in steps
    ]
    errors = [apart(motion, reference) for motion in motions]
    assert errors[0] < 0.01
    assert order(steps, errors) == pytest.approx(2.0, abs=0.1)
    adaptive = fd.simulate(case, 2.0, method=method, interval=0.05)
    assert apart(adaptive, reference) < 0.005
    assert adaptive.attrs["steps"] < 800


@pytest.mark.filterwarnings("ignore:damping. beta resists rotations")
@pytest.mark.parametrize("mass", ["circumcenter", "consistent"])
@pytest.mark.parametrize("method", IMPLICIT)
def test_band_and_sparse_matrix_give_the_same_motion(method, mass, monkeypatch):
    case = case2(alpha=0.1, beta=1e-4, mass=mass)
    band = fd.simulate(case, 0.5, method=method, dt=5e-3)
    assert band.attrs["linear_solver"] == "banded"
    monkeypatch.setattr(solvers, "MOST_UNSYMMETRIC", 0.0)
    for name, backend in solvers.SOLVERS.items():
        if not backend.found():
            continue
        only = {name: backend._replace(band=0.0, worthwhile=0)}
        monkeypatch.setattr(solvers, "SOLVERS", only)
        sparse = fd.simulate(case, 0.5, method=method, dt=5e-3)
        symmetric = method != "energy_momentum"
        assert sparse.attrs["linear_solver"] == (name if symmetric else "superlu")
        assert apart(sparse, band) < 1e-6


PATTERNS = {"fold": fd.patterns.simple_fold(), "miura": fd.patterns.miura(dihedral=60)}


def shell_of(name, divisions, mass="lumped", beta=0.0):
    shell = fd.shell(PATTERNS[name], SHEET, divisions=divisions, mass=mass)
    return fd.Case(shell, [fd.Fix([0, 1], "xyz")], damping=fd.Rayleigh(0.0, beta))


PLATES = fd.Case(cell(mass="consistent"), CELL_HELD, damping=fd.Rayleigh(0.3, 0.01))


@pytest.mark.parametrize(
    ("case", "share", "symmetric"),
    [
        *((PLATES, share, symmetric) for share in (0.6, -0.6) for symmetric in (True, False)),
        *((shell_of(name, 3, mass, 0.01), 0.7, True)
          for name in PATTERNS for mass in ("lumped", "consistent")),
    ],
)  # fmt: skip
def test_the_matrix_of_a_step_is_the_weighted_sum(case, share, symmetric):
    """Against dense algebra; an indefinite one goes another way to the same solution."""
    packed, body, weights = pack(case, 1e-3), case.body, Weights(share, 1e6, 7.0)
    matrix, rng = StepMatrix(packed, symmetric), np.random.default_rng(2)
    n, rows = len(case.structure.nodes), packed.system.rows
    u = np.zeros((rows, 3))
    u[:n] = 1e-3 * rng.standard_normal((n, 3))
    matrix.blocks.put(packed.body, matrix.pattern, u, u, False, matrix.stiffness)
    matrix.follow(u, 1.0)
    matrix.factorize(weights)
    force = rng.standard_normal((rows, 3))
    found = matrix.solve(force, np.zeros((rows, 3))).ravel()
    rest = np.zeros(body.size)
    inertia = np.zeros((body.size, body.size))
    inertia[: 3 * n, : 3 * n] = sparse.kron(case.structure.mass, np.eye(3)).toarray()
    free = np.setdiff1d(np.arange(body.size), case.supported_dofs)
    moved = np.concatenate([u[:n].ravel(), rest[3 * n :]])
    whole = share * body.tangent(moved) + 7.0 * 0.01 * body.tangent(rest)
    whole = (whole.toarray() + 1e6 * inertia)[np.ix_(free, free)]
    assert (np.linalg.eigvalsh(whole)[0] > 0.0) == (share > 0.0)
    assert apart(found[free], np.linalg.solve(whole, force.ravel()[free])) < 1e-7
    assert set(matrix.free.tolist()) == set(free.tolist())
    np.testing.assert_array_equal(found[case.supported_dofs], 0.0)


@pytest.mark.parametrize(("name", "across"), [("fold", 17), ("miura", 33)])
def test_the_band_of_a_shell_is_two_lines_of_nodes_wide(name, across):
    """A line across the sheet has `across` nodes, with three dofs and up to three sides each."""
    case = shell_of(name, 16)
    matrix, shell = StepMatrix(pack(case, 1.0), True), case.structure
    number = np.full(case.body.size, -1)
    number[matrix.free] = np.arange(len(matrix.free))
    entries = sparse.coo_array(shell.tangent(np.zeros_like(shell.nodes)))
    row, column = (number[coordinates] for coordinates in entries.coords)
    known = (row >= 0) & (column >= 0)
    assert np.abs(row - column)[known].max() < 2.2 * 6 * across
    assert matrix.solver == "banded"  # no wider than that: nothing else is counted as an entry


@pytest.mark.matrix
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
    free, start = oscillator(duffing_law(cubic), stiffness), released(stretch + 1e-5)
    for state, damper in (("initial", own), ("rest", stiffness)):
        case = pulled(free.altered(damping=fd.Rayleigh(beta=beta, state=state)), force)
        motion = fd.simulate(case, 0.8, method=method, dt=5e-4, initial=start)
        exact = damped(motion.time.values, omega, 0.5 * beta * damper / MASS / omega)
        np.testing.assert_allclose((place(motion) - stretch) / 1e-5, exact, atol=2e-3)


def test_damping_that_drives_is_told():
    """A folded sheet pulled against its locked folds is stable; one pushed in buckles."""
    damping = fd.Rayleigh(beta=1e-3, state="initial")
    case = oscillator(duffing_law(-40.0), 8.0).altered(damping=damping)
    with pytest.warns(FoldynWarning, match="drives 1 motion instead of damping it"):
        fd.simulate(case, 0.01, method="newmark", dt=1e-3, initial=released(0.5))
    stable = fd.Case(cell(), CELL_HELD, [], fd.Rayleigh(beta=1e-5, state="initial"))
    with warnings.catch_warnings():
        warnings.simplefilter("error", FoldynWarning)
        fd.simulate(stable, 0.01, method="newmark", dt=1e-3)
