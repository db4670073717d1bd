"""Case: supports, loads and damping put on a structure, and what moves supports."""

from __future__ import annotations

import warnings
from types import SimpleNamespace

import numpy as np
import pytest

import foldyn as fd
from foldyn.cases import (
    BaseMotion,
    Case,
    Constant,
    Fix,
    Force,
    Harmonic,
    Impose,
    Pulse,
    Ramp,
    Rayleigh,
    State,
)
from foldyn.errors import FoldynWarning, InputError

POINTS = np.array([[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0]], dtype=float)
STRUCTURE = SimpleNamespace(
    nodes=POINTS, pattern=SimpleNamespace(vertices=POINTS), plates=(), clamped_nodes=(), linear=""
)


def test_fixed_and_free_dofs() -> None:
    case = Case(STRUCTURE, [Fix([0]), Fix("xmax", "z"), Fix(1, "xz")])
    expected = np.array([[1, 1, 1], [1, 0, 1], [0, 0, 1], [0, 0, 1]], dtype=bool)
    np.testing.assert_array_equal(case.fixed, expected)
    np.testing.assert_array_equal(case.supported_dofs, [0, 1, 2, 3, 5, 8, 11])
    np.testing.assert_array_equal(case.free_dofs, [4, 6, 7, 9, 10])
    assert case.free_dofs.dtype == case.supported_dofs.dtype == np.int64


def test_nothing_on_a_structure() -> None:
    case = Case(STRUCTURE)
    assert not case.fixed.any() and case.load_terms == () and case.loaded_nodes.size == 0
    assert case.damping == Rayleigh(0.0, 0.0)


def test_loads_with_equal_histories_are_summed() -> None:
    pulse = Pulse(1.0)
    loads = [
        Force([2, 3], (1, 0, 0), pulse), Force([3], (0, 2, 0)), Force([3], (0.5, 0, 3), Pulse(1.0))
    ]  # fmt: skip
    case = Case(STRUCTURE, loads=loads)
    (first, one), (second, other) = case.load_terms
    assert (one, other) == (pulse, Constant())
    np.testing.assert_array_equal(first, [[0, 0, 0], [0, 0, 0], [1, 0, 0], [1.5, 0, 3]])
    np.testing.assert_array_equal(second, [[0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 2, 0]])
    np.testing.assert_array_equal(case.loaded_nodes, [2, 3])


def test_a_load_on_held_axes_in_part_warns_and_is_kept_whole() -> None:
    with pytest.warns(FoldynWarning, match=r"loads\[0\].* in part .*: 2 \(x\)") as record:
        case = Case(STRUCTURE, [Fix([2], "x")], [Force([2, 3], (1, 0, 0))])
    assert record[0].filename == __file__
    np.testing.assert_array_equal(case.load_terms[0][0][:, 0], [0, 0, 1, 1])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Case(STRUCTURE, [Fix([2], "yz")], [Force([2], (1, 0, 0))])  # beside it
    loads = [Force([2], (0, 1, 0)), Force([2], (1, 0, 0))]
    with pytest.raises(InputError, match=r"loads\[1\]: the force .* acts only where .*: 2 \(x\)"):
        Case(STRUCTURE, [Fix([2], "x")], loads)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: Case(STRUCTURE, [Fix([4])]), r"supports\[0\].nodes = \[4\]: node 4 is out of"),
        (lambda: Case(STRUCTURE, [Fix("x>1")]), r'supports\[0\].nodes = "x>1": selects no'),
        (lambda: Case(STRUCTURE, loads=[Force(9, (1, 0, 0))]), r"loads\[0\].nodes.*0 to 3"),
        (lambda: Case(STRUCTURE, [Force(0, (1, 0, 0))]), r"supports\[0\] = .*: must be a Fix"),
        (lambda: Case(STRUCTURE, Fix(0)), "supports = .*: must be a list of Fix"),
        (lambda: Case(STRUCTURE, damping=0.1), "damping = 0.1: must be Rayleigh"),
        (lambda: Fix(0, "xw"), 'axes = "xw": must be letters of "xyz"'),
        (lambda: Fix(0, "xx"), 'axes = "xx": an axis is listed twice'),
        (lambda: Force(0, (1, 0)), r"vector = \[1, 0\]: must be three numbers"),
        (lambda: Force(0, (1, 0, np.nan)), r"vector\[2\] = nan: must be a finite number"),
        (lambda: Force(0, (1, 0, 0), 5), "history = 5: must be a history"),
        (lambda: Rayleigh(alpha=-1), "alpha = -1: must be at least 0"),
        (lambda: State(displacement=np.zeros(3)), r"displacement: shape \(3,\)"),
        (lambda: State(velocity=[[0, 0, np.nan]]), r"velocity\[0\]\[2\] = nan"),
        (lambda: State(np.zeros((2, 3)), np.zeros((3, 3))), "must have the same shape"),
    ],
)
def test_wrong_input(make, text) -> None:
    with pytest.raises(InputError, match=text):
        make()


def test_a_state_keeps_its_own_numbers() -> None:
    displacement = np.zeros((2, 3))
    state = State(displacement)
    displacement[0, 0] = 1.0
    assert state.displacement[0, 0] == 0.0
    assert state.velocity is None


def test_imposed_dofs_are_supported_and_told_apart() -> None:
    case = Case(STRUCTURE, [Fix([0], "xz"), Impose("xmax", "z", 0.1), Impose(0, "y", 0.0)])
    imposed = np.array([[0, 1, 0], [0, 0, 0], [0, 0, 1], [0, 0, 1]], dtype=bool)
    np.testing.assert_array_equal(case.imposed, imposed)
    imposed[0] = True  # by the first support
    np.testing.assert_array_equal(case.fixed, imposed)
    np.testing.assert_array_equal(case.supported_dofs, [0, 1, 2, 8, 11])
    np.testing.assert_array_equal(case.free_dofs, [3, 4, 5, 6, 7, 9, 10])
    assert not case.imposed.flags.writeable and not case.fixed.flags.writeable
    held = Case(STRUCTURE, [Fix([0]), Fix([0, 1], "x")])  # a Fix may repeat another
    assert not held.imposed.any() and held.imposed_terms == held.base_terms == ()


def test_imposed_displacements_with_equal_histories_are_one_term() -> None:
    """What is imposed along an axis is no equation between displacements, as a link is."""
    supports = [
        Impose("xmax", "z", 0.1, Ramp(2.0)), Impose([3, 0], "x", [-0.2, 0.5], Ramp(2.0)),
        Impose(1, "y", 0.3, Harmonic(2.0)), Fix(1, "x"), fd.Link([0, 3], "y"),
    ]  # fmt: skip
    case = Case(STRUCTURE, supports)
    (ramp, first), (wave, second) = case.imposed_terms
    assert (first, second) == (Ramp(2.0), Harmonic(2.0))
    np.testing.assert_array_equal(ramp, [[0.5, 0, 0], [0, 0, 0], [0, 0, 0.1], [-0.2, 0, 0.1]])
    np.testing.assert_array_equal(wave, [[0, 0, 0], [0, 0.3, 0], [0, 0, 0], [0, 0, 0]])
    assert not ramp.flags.writeable
    assert case.base_terms == case.load_terms == case.actuation_terms == ()


def test_the_base_carries_what_is_fixed_along_its_axis() -> None:
    shake, sweep = Harmonic(2.0), fd.Chirp(1.0, 5.0, 2.0)
    supports = [
        BaseMotion("x", shake, 0.01), Fix([0, 1]), Fix([1, 2], "y"),
        Impose(3, "x", 0.5),  # goes its own way
        BaseMotion("y", shake, -0.02), BaseMotion("x", sweep), BaseMotion("x", sweep, 0.5),
    ]  # fmt: skip
    (first, one), (second, other) = Case(STRUCTURE, supports).base_terms
    assert (one, other) == (shake, sweep)
    moved = [[0.01, -0.02, 0], [0.01, -0.02, 0], [0, -0.02, 0], [0, 0, 0]]
    np.testing.assert_array_equal(first, moved)
    np.testing.assert_array_equal(second, [[1.5, 0, 0], [1.5, 0, 0], [0, 0, 0], [0, 0, 0]])


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


PULL, SHAKE = Impose([0], "x", 0.1), BaseMotion("x", Harmonic(2.0))


@pytest.mark.parametrize(
    ("supports", "text"),
    [
        (
            [Fix([1, 2], "xz"), Impose([0, 2], "z", 0.1)],
            r"\[1\]: node 2 is held and imposed along z",
        ),
        (
            [Impose("xmax", "z", 0.1), Fix(3)],
            r"\[0\]: node 3 is held .* z, a contradictory support",
        ),
        ([PULL, Fix(1, "x"), PULL], r"supports\[2\]: node 0 is imposed twice along x, a contradic"),
        (
            [Fix([0], "yz"), SHAKE],
            r'\[1\]: the base moves along x, but no .* add one with axes = "x"',
        ),
        ([PULL, SHAKE], r"supports\[1\]: the base moves along x, but no support"),
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
        (lambda: BaseMotion(["x"]), r'axis = \["x"\]: must be one of'),
        (lambda: Impose([0, 0], "x", [1, 2]), "nodes = .*: node 0 is listed twice"),
        (lambda: Impose([0], "x", [np.inf]), r"value\[0\] = inf: must be a finite number"),
        (lambda: Impose([0, 1], "x", [1.0]), r"value = \[1.0\]: 1 value for 2 nodes; give one"),
        (lambda: Impose([0, 1], "x", []), r"= \[\]: must be a number, or a list of one per node"),
        (lambda: Impose("xmin", "x", [1.0]), 'value = .* but nodes is the selection "xmin"; give'),
        (lambda: BaseMotion("x", value=[1, 2]), r"value = \[1, 2\]: must be a number"),
        (lambda: BaseMotion("x", 0.5), "history = 0.5: must be a history"),
        (lambda: Impose([0], "x", 1, Ramp), "history = Ramp: give an object"),
    ],
)
def test_wrong_motions(make, text) -> None:
    with pytest.raises(InputError, match=text):
        make()
