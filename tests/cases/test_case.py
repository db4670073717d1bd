"""Case: supports, loads and damping put on a structure."""

from __future__ import annotations

import warnings
from types import SimpleNamespace

import numpy as np
import pytest

from foldyn.cases import Case, Constant, Fix, Force, Pulse, Rayleigh, State
from foldyn.errors import FoldynWarning, InputError

POINTS = np.array([[0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0]], dtype=float)
STRUCTURE = SimpleNamespace(
    nodes=POINTS, pattern=SimpleNamespace(vertices=POINTS), plates=(), clamped_nodes=()
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
    assert not case.fixed.any()
    assert case.load_terms == ()
    assert case.damping == Rayleigh(0.0, 0.0)
    assert case.loaded_nodes.size == 0


def test_loads_with_equal_histories_are_summed() -> None:
    case = Case(
        STRUCTURE,
        loads=[
            Force([2, 3], (1, 0, 0), Pulse(1.0)),
            Force([3], (0, 2, 0)),
            Force([3], (0.5, 0, 3), Pulse(1.0)),
        ],
    )
    (first, pulse), (second, constant) = case.load_terms
    assert (pulse, constant) == (Pulse(1.0), Constant())
    np.testing.assert_array_equal(first, [[0, 0, 0], [0, 0, 0], [1, 0, 0], [1.5, 0, 3]])
    np.testing.assert_array_equal(second, [[0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 2, 0]])
    np.testing.assert_array_equal(case.loaded_nodes, [2, 3])


def test_a_load_on_held_axes_only_is_refused() -> None:
    with pytest.raises(InputError, match=r"loads\[1\]: the force .* acts only where .*: 2 \(x\)"):
        Case(STRUCTURE, [Fix([2], "x")], [Force([2], (0, 1, 0)), Force([2], (1, 0, 0))])


def test_a_load_on_held_axes_in_part_warns_and_is_kept_whole() -> None:
    with pytest.warns(FoldynWarning, match=r"loads\[0\].* in part .*: 2 \(x\)") as record:
        case = Case(STRUCTURE, [Fix([2], "x")], [Force([2, 3], (1, 0, 0))])
    assert record[0].filename == __file__
    np.testing.assert_array_equal(case.load_terms[0][0][:, 0], [0, 0, 1, 1])


def test_a_load_beside_held_axes_is_silent() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Case(STRUCTURE, [Fix([2], "yz")], [Force([2], (1, 0, 0))])


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
        (lambda: Fix(0, ""), 'axes = "": must be letters'),
        (lambda: Fix(0, "xx"), 'axes = "xx": an axis is listed twice'),
        (lambda: Fix(0, 3), "axes = 3: must be letters"),
        (lambda: Force(0, (1, 0)), r"vector = \[1, 0\]: must be three numbers"),
        (lambda: Force(0, (1, 0, np.nan)), r"vector\[2\] = nan: must be a finite number"),
        (lambda: Force(0, 1.0), "vector = 1.0: must be three numbers"),
        (lambda: Force(0, "xyz"), 'vector = "xyz": must be numbers'),
        (lambda: Force(0, (1, 0, 0), 5), "history = 5: must be a history"),
        (lambda: Rayleigh(alpha=-1), "alpha = -1: must be at least 0"),
        (lambda: Rayleigh(beta=np.inf), "beta = inf: must be a finite number"),
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
