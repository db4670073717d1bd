"""Elimination of linear constraints, and what a case makes of its links and directions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse
from scipy.linalg import null_space
from scipy.spatial.transform import Rotation

import foldyn as fd
from foldyn.algebra.elimination import eliminate
from foldyn.errors import InputError

SHEET = fd.Sheet(1e6, 0.25, 0.01, density=1.0)
FOLD = fd.patterns.simple_fold()
BARS = fd.discretize(FOLD, SHEET, preset="plate")


@pytest.mark.parametrize("seed", range(5))
def test_elimination_spans_the_null_space(seed) -> None:
    random, unit = np.random.default_rng(seed), np.eye(24)
    rows = np.where(random.random((9, 24)) < 0.25, random.standard_normal((9, 24)), 0.0)
    rows[7] = 2.0 * rows[1] - rows[3]  # it says nothing new
    held = random.random(24) < 0.25
    solved = eliminate(sparse.csr_array(rows), held)
    free = np.setdiff1d(np.flatnonzero(~held), solved.slaves)
    basis = solved.basis.toarray()
    # x gives back held dofs, and the values of the equations kept
    given = rows[solved.kept] @ basis[:, solved.slaves]
    np.testing.assert_allclose(given, np.eye(len(solved.kept)), atol=1e-12)
    np.testing.assert_array_equal(basis[held], unit[held])
    # free motions: all that satisfy the equations with held dofs at rest
    expected = null_space(np.vstack([rows, unit[held]]))
    assert expected.shape[1] == len(free)
    assert np.linalg.matrix_rank(np.hstack([expected, basis[:, free]]), 1e-9) == len(free)
    assert {1, 3, 7} & set(solved.left)


def test_an_equation_of_held_dofs_alone_is_left_out() -> None:
    rows = sparse.csr_array(np.array([[1.0, 1.0, 0.0], [0.0, 1.0, -1.0]]))
    solved = eliminate(rows, np.array([True, True, False]))
    assert solved.left.tolist() == [0]
    assert solved.kept.tolist() == [1]
    np.testing.assert_array_equal(solved.basis.toarray()[2], [0.0, 1.0, -1.0])


def test_without_constraints_nothing_is_computed() -> None:
    case = fd.Case(BARS, [fd.Fix([4, 5])])
    ties, matrix = case.constraints, BARS.tangent(np.zeros_like(BARS.nodes))
    assert not ties
    force = np.ones(BARS.nodes.size)
    assert ties.force(force) is force
    assert ties.displacement(force) is force
    assert ties.matrix(matrix) is matrix
    np.testing.assert_array_equal(case.reaction_dofs, case.supported_dofs)


def test_directions() -> None:
    case = fd.Case(BARS, [fd.Fix([4, 5]), fd.Fix([0], direction=(3.0, 0.0, 4.0))])
    moved = case.constraints.basis.toarray()[:, case.free_dofs]
    assert len(case.free_dofs) == BARS.nodes.size - 7
    np.testing.assert_allclose(0.6 * moved[0] + 0.8 * moved[2], 0.0, atol=1e-15)
    assert case.reaction_dofs.tolist() == [0, 2, *range(12, 18)]
    along = fd.Case(BARS, [fd.Fix([4, 5]), fd.Fix([0], direction="-z")])
    axis = fd.Case(BARS, [fd.Fix([4, 5]), fd.Fix([0], "z")])
    np.testing.assert_array_equal(along.free_dofs, axis.free_dofs)


def test_links_with_equal_displacements() -> None:
    case = fd.Case(BARS, [fd.Fix([4, 5]), fd.Link([0, 1, 6], axes="xz")])
    u = case.constraints.displacement(np.random.default_rng(0).standard_normal(BARS.nodes.size))
    x = np.zeros(BARS.nodes.size)
    x[case.free_dofs] = u[case.free_dofs]
    moved = case.constraints.displacement(x).reshape(-1, 3)
    assert np.ptp(moved[[0, 1, 6]][:, [0, 2]], axis=0).max() < 1e-15
    assert np.ptp(moved[[0, 1, 6], 1]) > 0.1


def test_riding_points_follow_any_motion_of_a_plate() -> None:
    """Weights (1 + s)/3 and so on of a point of the plane; a rotation by 2 rad is met exactly."""
    case = fd.Case(BARS, [fd.Link([6], to=[0, 1, 2])])
    turn = Rotation.from_rotvec([0.3, -1.2, 1.5]).as_matrix()
    u = BARS.nodes @ turn + (0.1, 0.2, 0.3) - BARS.nodes
    assert np.abs(case.constraints.values(u)).max() < 1e-15
    u[6, 2] += 1e-3
    assert np.abs(case.constraints.values(u)).max() == pytest.approx(1e-3)


OFF = r"supports\[0\].nodes: node 4 lies off the plane of nodes \[0, 1, 2\] by 0\.87"


ROLLER = fd.Impose([0], direction=(1, 0, 1), value=1e-3)
TIED = [fd.Fix([0], "x"), fd.Impose([1], "x", 1e-3), fd.Link([0, 1], axes="x")]
CANNOT = r"supports\[1\]: what it moves cannot follow, because of supports"
BENT = fd.Pattern([[0, 0, 0], [1, 0, 0], [1, 1, 0.1], [0, 1, 0]], [[0, 1, 2, 3]], [])


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: fd.Fix([0], "x", direction=(1, 0, 0)), "direction = .*: holds one direction"),
        (lambda: fd.Fix([0], direction=(0, 0, 0)), "direction = .*: must not be zero"),
        (lambda: fd.Fix([0], direction="up"), 'direction = "up"'),
        (lambda: fd.Impose([0], "x", 0.1, direction="x"), "only one of the two"),
        (lambda: fd.Impose([0], value=0.1), "give the axis of the displacement"),
        (lambda: fd.Link([3]), "nodes = .*: a link ties at least two nodes"),
        (lambda: fd.Link([3, 4], axes="xx"), "an axis is listed twice"),
        (lambda: fd.Link([3], to=[0, 1]), "to = .*: must be three nodes"),
        (lambda: fd.Link([3], axes="x", to=[0, 1, 2]), "leave out the axes"),
        (lambda: fd.Case(BARS, [fd.Link([4], to=[0, 1, 2])]), OFF),
        (
            lambda: fd.Case(BARS, [fd.Link([1, 2], to=[0, 1, 3])]),
            r"to: node 1 cannot ride on itself",
        ),
        (lambda: fd.Case(BARS, [fd.Link([1], to=[0, 3, 6])]), "lie on a line"),
        (lambda: fd.Case(BARS, [fd.Link([0, 77])]), r"supports\[0\].nodes.*node 77"),
        (lambda: fd.Case(BARS, [fd.Fix([0]), ROLLER]), CANNOT + r"\[1\]"),
        (lambda: fd.Case(BARS, TIED), CANNOT + r"\[2\]"),
        (
            lambda: fd.discretize(FOLD, SHEET, rigid=[2], preset="plate"),
            r"\[2\]: panel 2 is out of range; .* 0 to 1",
        ),
        (lambda: fd.shell(FOLD, SHEET, divisions=2, rigid="none"), 'rigid = "none": must be "all"'),
        (
            lambda: fd.discretize(BENT, SHEET, rigid="all", preset="plate"),
            r"panel 0 is not flat: node 0 lies 0.07",
        ),
        (lambda: fd.shell(BENT, SHEET, divisions=2, rigid=[0]), "rigid: panel 0 is not flat"),
    ],
)
def test_wrong_input(make, text) -> None:
    with pytest.raises(InputError, match=text):
        make()


def test_states_that_do_not_satisfy_links_are_refused() -> None:
    case = fd.Case(BARS, [fd.Fix([4, 5]), fd.Link([0, 1])])
    u, v = np.zeros((2, *BARS.nodes.shape))
    u[0, 2], v[0, 2] = 1e-3, 1e-3
    tied = r"initial: does not satisfy supports\[1\]: node 1 stands 0.001 m from where it is tied"
    for call in (fd.simulate, lambda case, _, initial: fd.trace(case, initial=initial)):
        with pytest.raises(InputError, match=tied):
            call(case, 1.0, initial=fd.State(u))
    with pytest.raises(InputError, match=r"initial: velocity of node 1 does not satisfy supports"):
        fd.simulate(case, 1.0, method="rk4", initial=fd.State(0.0 * u, v))
    with pytest.raises(InputError, match=r"state: does not satisfy supports\[1\]"):
        fd.modes(case, 1, state=fd.State(u))


def test_supports_of_a_direction_hold_nodes_where_a_state_puts_them() -> None:
    """As along axes: what is held is the change, not the place."""
    case = fd.Case(BARS, [fd.Fix([4, 5]), fd.Fix([0, 1], direction=(1.0, 0.0, 1.0))])
    u = np.zeros_like(BARS.nodes)
    u[[0, 1], 0] = 1e-3
    motion = fd.simulate(case, 0.1, method="rk4", initial=fd.State(u), dt=2.5e-5, interval=0.02)
    assert motion.energy_error < 1e-4
    held = motion.displacement.values[:, [0, 1]] @ (1.0, 0.0, 1.0)
    np.testing.assert_allclose(held, 1e-3, rtol=1e-12)
    path = fd.trace(case, "newton", load_factors=[0.0], initial=fd.State(u))
    np.testing.assert_allclose(path.displacement.values[-1, :2] @ (1.0, 0.0, 1.0), 1e-3, rtol=1e-12)
