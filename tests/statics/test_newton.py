"""Newton's method: its rates, line search, tolerances; on small problems with known answers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import sparse

import foldyn as fd
from foldyn.errors import ComputationError, CrossingWarning
from foldyn.statics import OrigamiProblem, Settings, Solver, trace
from foldyn.statics.newton import Problem
from foldyn.structures import ModelOptions


class Spring(Problem):
    """One dof pulled by a force f on a spring with a force g(u)."""

    def __init__(self, force, slope):
        self.force, self.slope = force, slope
        self.free, self.held = np.array([0]), np.zeros(0, int)
        self.force_rounding, self.length = 1e-15, 1.0
        self.visited = []

    def prescribed(self, factor):
        return np.zeros(0)

    def residual(self, u, factor):
        self.visited.append(float(u[0]))
        return np.array([self.force(u[0]) - factor])

    def tangent(self, u, factor, before=None):
        return sparse.csr_array(np.array([[self.slope(u[0])]]))

    def rate(self, u, factor):
        return np.array([-1.0])

    def reference(self, u, factor):
        return abs(factor)

    def turn(self, u, v):
        return 0.0


def errors_of(solver, u, factor, **given):
    """Distances from the solution after each iteration of a correction."""
    states = []
    residual = solver.problem.residual

    def spy(u, factor):
        states.append(u.copy())
        return residual(u, factor)

    solver.problem.residual = spy
    attempt = solver.correct(u, factor, **given)
    del solver.problem.residual
    assert not attempt.failure
    return np.array([np.linalg.norm(state - attempt.u) for state in states]), attempt


def miura_case(bend_law="superlinear", **model):
    pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=60)
    sheet = fd.Sheet(1e6, 0.25, 0.01, 1.0)
    s = fd.discretize(pattern, sheet, bend_law=bend_law, preset="herkal", **model)
    supports = [fd.Fix([0, 1, 2], "x"), fd.Fix([0, 2, 6, 8], "z"), fd.Fix([1], "y")]
    return fd.Case(s, supports, [fd.Force([7], (0.01, 0.0, 0.0))])


def test_quadratic_convergence():
    """Case study 2 at full load: every bend is bent by more than 4e-4 rad."""
    case = miura_case()
    s = case.structure
    problem = OrigamiProblem(case)
    solver = Solver(problem, Settings(tolerance=1e-13))
    exact = solver.correct(problem.start(), 1.0).u
    _, bends = s.dihedrals(exact.reshape(-1, 3))
    assert np.abs(bends - s.bend_rest).min() > 4e-4
    wave = np.sin(np.arange(exact.size))  # a smooth disturbance of all free dofs
    start = exact.copy()
    start[problem.free] += 1e-3 * wave[problem.free]
    errors, _ = errors_of(solver, start, 1.0)
    late = errors[(errors > 1e-13) & (errors < 1e-3)][-3:]
    assert len(late) == 3
    assert late[0] / late[2] > 1e4
    order = np.log(late[2] / late[1]) / np.log(late[1] / late[0])
    assert order > 1.8, late


@pytest.mark.parametrize("bar_law", ["ogden", "linear"])
def test_quadratic_convergence_with_linear_bends(bar_law):
    case = miura_case("linear", bar_law=bar_law)
    problem = OrigamiProblem(case)
    solver = Solver(problem, Settings(tolerance=1e-13))
    errors, attempt = errors_of(solver, problem.start(), 1.0)
    assert attempt.iterations <= 8
    late = errors[(errors > 1e-13) & (errors < 1e-2 * errors[0])]
    assert len(late) >= 2
    # e' < C e^2 with one C, over more than four orders of magnitude
    constants = late[1:] / late[:-1] ** 2
    assert late[0] / late[-1] > 1e4
    assert constants.max() < 1e3


def bent_triangle(angle):
    """Two triangles joined by a superlinear bend; three nodes held, the fourth free along z."""
    nodes = np.array([[0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.5, -1, 0]], float)
    structure = fd.Structure(
        nodes, np.zeros((0, 2), int), np.zeros(0), fd.Sheet(1e6, 0.3, 0.01),
        options=ModelOptions(bend_law="superlinear"), bends=np.array([[0, 1, 2, 3]]),
        bend_stiffness=np.array([2.0]), bend_rest=np.array([math.pi]),
    )  # fmt: skip
    u = np.zeros(12)
    u[11] = math.tan(angle)
    return fd.Case(structure, [fd.Fix([0, 1, 2], "xyz"), fd.Fix([3], "xy")]), u


def test_rate_where_a_bend_ends_at_rest():
    """Newton on d^(4/3) = 0: d' = d - 3/4 d, down to where the floor of the slope takes over.

    The floor, 1e-3, is above the slope 4/3 d^(1/3) for d < 4.2e-10.
    """
    case, u = bent_triangle(0.01)
    solver = Solver(OrigamiProblem(case), Settings(iterations=60))
    solver.problem.force_rounding = 2.0 * 5e-10 ** (4 / 3)  # there are no bars to round
    errors, attempt = errors_of(solver, u, 0.0)
    ratios = errors[1:] / errors[:-1]
    far = errors[:-1] > 1e-7  # nearer, the state that errors are measured from is too near
    assert far.sum() >= 8
    np.testing.assert_allclose(ratios[far], 0.25, atol=5e-3)
    assert abs(attempt.u[11]) < 1e-9


def test_floor_never_enters_the_residual():
    """Where the floor replaces the slope the state found still balances the exact force."""
    case, u = bent_triangle(1e-10)
    problem = OrigamiProblem(case)
    exact = case.structure.internal_force(u.reshape(-1, 3)).ravel()
    assert problem.tangent(u, 0.0)[11, 11] == pytest.approx(2.0 * 1e-3, rel=1e-6)  # k floor / arm^2
    np.testing.assert_array_equal(problem.residual(u, 0.0), exact)
    d = 3e-10  # where the slope is 0.9e-3
    load = 2.0 * d ** (4 / 3)  # at an arm of 1 m
    loaded = fd.Case(case.structure, case.supports, [fd.Force([3], (0, 0, load))])
    attempt = Solver(OrigamiProblem(loaded), Settings(tolerance=1e-5)).correct(u, 1.0)
    assert not attempt.failure
    assert attempt.u[11] == pytest.approx(d, rel=1e-4)  # its angle is known to 1e-6 of itself


def test_line_search_saves_what_plain_steps_lose():
    """arctan = 0: Newton diverges from beyond 1.3917 (the root of 2 u = (1 + u^2) arctan u)."""
    spring = Spring(math.atan, lambda u: 1.0 / (1.0 + u * u))
    spring.reference = lambda u, factor: 1.0
    spring.length = 1e6  # steps below 1e-10 count as none
    solver = Solver(spring)
    assert solver.correct(np.array([1.40]), 0.0).failure
    assert not solver.correct(np.array([1.38]), 0.0).failure
    searched = solver.correct(np.array([3.0]), 0.0, search=True)
    assert not searched.failure
    assert abs(searched.u[0]) < 1e-9


def test_both_tolerances_are_met():
    """Stiff and soft: the residual alone would accept a state that is far off."""
    weak = 1e-9
    spring = Spring(lambda u: weak * u**3, lambda u: 3 * weak * u * u)
    spring.reference = lambda u, factor: 1.0  # forces of 1 N elsewhere
    attempt = Solver(spring, Settings(tolerance=1e-8, iterations=60)).correct(np.array([5.0]), weak)
    assert not attempt.failure
    assert attempt.u[0] == pytest.approx(1.0, rel=1e-8)


def test_exactly_critical_start():
    """A tangent that is exactly zero does not stop the iteration; no number is never accepted."""
    spring = Spring(lambda u: u**3, lambda u: 3 * u * u)
    attempt = Solver(spring, Settings(iterations=200)).correct(np.array([0.0]), 1.0)
    assert attempt.u[0] == pytest.approx(1.0) or attempt.failure
    spring = Spring(lambda u: math.nan if u > 0.5 else u, lambda u: 1.0)
    assert "finite" in Solver(spring).correct(np.array([0.0]), 1.0).failure


def test_tighter_tolerance_gives_a_closer_state():
    exact, loose, usual = (
        trace(miura_case(), load_factors=[1.0], settings=Settings(**given))
        for given in ({"tolerance": 1e-13}, {"tolerance": 1e-2}, {})
    )
    error = float(np.abs(usual.displacement - exact.displacement).max())
    assert error < 1e-9 * float(np.abs(exact.displacement).max())
    assert loose.attrs["newton_iterations"] < exact.attrs["newton_iterations"]
    assert float(usual.residual[0]) < 1e-9


@pytest.mark.matrix
def test_panels_do_not_pass_through_each_other():
    """A linear fold under a closing moment has no equilibrium beyond closed: the path ends."""
    pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=40)
    s = fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.01), fold_law="linear", preset="herkal")
    supports = [fd.Fix([0, 1], "xyz"), fd.Fix([2, 3], "y"), fd.Impose([4, 5], "x", -0.75)]
    case = fd.Case(s, [*supports, fd.Fix([4, 5], "yz")])
    # before that their middles do, which bulge towards each other
    with pytest.warns(CrossingWarning, match="0 and 1"), pytest.raises(ComputationError) as caught:
        trace(case, "displacement", steps=20)
    path = caught.value.partial
    folded = np.degrees([s.dihedrals(u)[0][0] for u in path.displacement.values])
    assert (np.diff(folded) > 0.0).all()  # a mountain: it closes at 360 degrees
    assert 359.9 < folded[-1] < 360.0
    assert path.attrs["status"] == "stopped"
    assert "crease 0 is closed" in path.attrs["remedy"]
    assert "enhanced" in path.attrs["remedy"]
