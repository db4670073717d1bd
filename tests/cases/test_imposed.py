"""Imposed displacements and motions of the base: what a case makes of them."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

import foldyn as fd
from foldyn.cases import BaseMotion, Case, Fix, Force, Harmonic, Impose, Ramp
from foldyn.errors import FoldynWarning, InputError

POINTS = np.array([[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0]], dtype=float)
STRUCTURE = SimpleNamespace(
    nodes=POINTS, pattern=SimpleNamespace(vertices=POINTS), plates=(), clamped_nodes=()
)


def test_imposed_dofs_are_supported_and_told_apart() -> None:
    case = Case(STRUCTURE, [Fix([0], "xz"), Impose("xmax", "z", 0.1), Impose(0, "y", 0.0)])
    imposed = np.array([[0, 1, 0], [0, 0, 0], [0, 0, 1], [0, 0, 1]], dtype=bool)
    np.testing.assert_array_equal(case.imposed, imposed)
    held = np.array([[1, 0, 1], [0, 0, 0], [0, 0, 0], [0, 0, 0]], dtype=bool)
    np.testing.assert_array_equal(case.fixed, imposed | held)
    np.testing.assert_array_equal(case.supported_dofs, [0, 1, 2, 8, 11])
    np.testing.assert_array_equal(case.free_dofs, [3, 4, 5, 6, 7, 9, 10])
    assert not case.imposed.flags.writeable
    assert not case.fixed.flags.writeable


def test_imposed_displacements_with_equal_histories_are_one_term() -> None:
    case = Case(
        STRUCTURE,
        [
            Impose("xmax", "z", 0.1, Ramp(2.0)),
            Impose([3, 0], "x", [-0.2, 0.5], Ramp(2.0)),
            Impose(1, "y", 0.3, Harmonic(2.0)),
            Fix(1, "x"),
        ],
    )
    (ramp, first), (wave, second) = case.imposed_terms
    assert (first, second) == (Ramp(2.0), Harmonic(2.0))
    np.testing.assert_array_equal(ramp, [[0.5, 0, 0], [0, 0, 0], [0, 0, 0.1], [-0.2, 0, 0.1]])
    np.testing.assert_array_equal(wave, [[0, 0, 0], [0, 0.3, 0], [0, 0, 0], [0, 0, 0]])
    assert not ramp.flags.writeable
    assert case.base_terms == case.load_terms == case.actuation_terms == ()


def test_the_base_carries_what_is_fixed_along_its_axis() -> None:
    shake, sweep = Harmonic(2.0), fd.Chirp(1.0, 5.0, 2.0)
    case = Case(
        STRUCTURE,
        [
            BaseMotion("x", shake, 0.01),
            Fix([0, 1]),
            Fix([1, 2], "y"),
            Impose(3, "x", 0.5),  # goes its own way
            BaseMotion("y", shake, -0.02),
            BaseMotion("x", sweep),
            BaseMotion("x", sweep, 0.5),
        ],
    )
    (first, one), (second, other) = case.base_terms
    assert (one, other) == (shake, sweep)
    np.testing.assert_array_equal(
        first, [[0.01, -0.02, 0], [0.01, -0.02, 0], [0, -0.02, 0], [0, 0, 0]]
    )
    np.testing.assert_array_equal(second, [[1.5, 0, 0], [1.5, 0, 0], [0, 0, 0], [0, 0, 0]])


def test_without_motions_nothing_is_imposed() -> None:
    case = Case(STRUCTURE, [Fix([0]), Fix([0, 1], "x")])  # a Fix may repeat another
    assert not case.imposed.any()
    assert case.imposed_terms == case.base_terms == ()


def test_equal_motions_compare_equal() -> None:
    assert Impose([1, 2], "x", np.array([0.1, 0.2])) == Impose((1, 2), "x", [0.1, 0.2])
    assert Impose([1], "x", 1) == Impose(1, "x", 1.0)
    assert Impose([1], "x", np.float64(1)) == Impose([1], "x", np.array(1.0))
    assert Impose([1], "x", 1) != Impose([1], "x", 2)
    assert BaseMotion("x") == BaseMotion("x", value=1)


def test_forces_meet_imposed_dofs_as_any_support() -> None:
    pull = Impose([2], "x", 0.1)
    with pytest.raises(InputError, match=r"loads\[0\]: the force .* acts only where supports hold"):
        Case(STRUCTURE, [pull], [Force([2], (1, 0, 0))])
    with pytest.warns(FoldynWarning, match=r"loads\[0\].* in part .*: 2 \(x\)"):
        Case(STRUCTURE, [pull], [Force([2, 3], (1, 0, 0))])


@pytest.mark.parametrize(
    ("supports", "text"),
    [
        (
            [Fix([1, 2], "xz"), Impose([0, 2], "z", 0.1)],
            r"supports\[1\]: node 2 is held and imposed along z, a contradictory support; leave",
        ),
        (
            [Impose("xmax", "z", 0.1), Fix(3)],
            r"supports\[0\]: node 3 is held and imposed along z, a contradictory support",
        ),
        (
            [Impose([0, 1], "y", 0.1), Fix(0, "x"), Impose([2, 1], "y", 0.1)],
            r"supports\[2\]: node 1 is imposed twice along y, a contradictory support",
        ),
        (
            [Fix([0], "yz"), BaseMotion("x", Harmonic(2.0))],
            r'supports\[1\]: the base moves along x, but no support .* add one with axes = "x"',
        ),
        (
            [Impose([0], "x", 0.1), BaseMotion("x", Harmonic(2.0))],
            r"supports\[1\]: the base moves along x, but no support",
        ),
        ([Impose([4], "x", 0.1)], r"supports\[0\].nodes = \[4\]: node 4 is out of range"),
        ([Impose("x>1", "x", 0.1)], r'supports\[0\].nodes = "x>1": selects no vertex'),
        ([Force([1], (1, 0, 0))], r"supports\[0\] = .*: must be a Fix or Impose or BaseMotion"),
    ],
)
def test_contradictions(supports, text) -> None:
    with pytest.raises(InputError, match=text):
        Case(STRUCTURE, supports)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: Impose([0], "xy", 0.1), 'axis = "xy": must be one of "x", "y" and "z"'),
        (lambda: Impose([0], "", 0.1), 'axis = "": must be one of'),
        (lambda: Impose([0], 0, 0.1), "axis = 0: must be one of"),
        (lambda: BaseMotion("X"), 'axis = "X": must be one of'),
        (lambda: BaseMotion(["x"]), r'axis = \["x"\]: must be one of'),
        (lambda: Impose([0.5], "x", 0.1), r"nodes = \[0.5\]: 0.5 is not a node number"),
        (lambda: Impose([0, 0], "x", [1, 2]), "nodes = .*: node 0 is listed twice"),
        (lambda: Impose([0], "x", np.nan), "value = nan: must be a finite number"),
        (lambda: Impose([0], "x", [np.inf]), r"value\[0\] = inf: must be a finite number"),
        (lambda: Impose([0], "x", "1"), 'value = "1": must be a number'),
        (lambda: Impose([0], "x", True), "value = true: must be a number"),
        (lambda: Impose([0, 1], "x", [True, 1.0]), "value = .*: must be numbers"),
        (lambda: Impose([0, 1], "x", [1.0]), r"value = \[1.0\]: 1 values for 2 nodes; give one"),
        (
            lambda: Impose([0, 1], "x", []),
            r"value = \[\]: must be a number, or a list of one per node",
        ),
        (lambda: Impose([0, 1], "x", [[1, 2]]), "value = .*: must be a number, or a list of one"),
        (lambda: Impose("xmin", "x", [1.0]), 'value = .* but nodes is the selection "xmin"; give'),
        (lambda: BaseMotion("x", value=[1, 2]), r"value = \[1, 2\]: must be a number"),
        (lambda: BaseMotion("x", value=-np.inf), "value = -inf: must be a finite number"),
        (lambda: BaseMotion("x", 0.5), "history = 0.5: must be a history"),
        (lambda: Impose([0], "x", 1, Ramp), "history = Ramp: give an object"),
    ],
)
def test_wrong_input(make, text) -> None:
    with pytest.raises(InputError, match=text):
        make()


def test_values_for_each_node_stand_beside_links() -> None:
    """What is imposed along an axis is no equation between displacements, as a link is."""
    case = Case(STRUCTURE, [fd.Link([0, 1], "y"), Impose([2, 3, 0], "x", [0.1, 0.2, 0.3])])
    ((moved, _),) = case.imposed_terms
    np.testing.assert_array_equal(moved, [[0.3, 0, 0], [0, 0, 0], [0.1, 0, 0], [0.2, 0, 0]])
