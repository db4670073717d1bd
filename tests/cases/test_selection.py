"""Node selections by number and by expression."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from foldyn.cases import resolve_nodes, select
from foldyn.errors import InputError
from foldyn.patterns import miura

GRID = np.array([[x, y, 0.0] for x in (0.0, 1.0, 2.0) for y in (-1.0, 0.0, 1.0)])


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        ("xmin", [0, 1, 2]),
        ("zmin", range(9)),
        ("xmin and y>0", [2]),
        ("not (xmin or xmax)", [3, 4, 5]),
        ("not xmin and not xmax", [3, 4, 5]),
        ("x == 1", [3, 4, 5]),
        ("x != 1", [0, 1, 2, 6, 7, 8]),
        ("y <= 0 and x >= 2", [6, 7]),
        ("0 < x < 2", [3, 4, 5]),
        ("-0.5 <= y", [1, 2, 4, 5, 7, 8]),
        ("y > +0.5 or x < 1e-1 and ymin", [0, 2, 5, 8]),
        ("  xmin  ", [0, 1, 2]),
    ],
)
def test_expressions(expression, expected) -> None:
    np.testing.assert_array_equal(select(GRID, expression), list(expected))


def test_rounding_does_not_matter() -> None:
    points = GRID + 1e-12 * np.sin(np.arange(27)).reshape(9, 3)
    for expression in ("xmin", "y > 0", "y >= 0", "x == 1", "x < 1", "zmax", "z <= 0"):
        np.testing.assert_array_equal(select(points, expression), select(GRID, expression))


def test_selection_of_pattern_vertices() -> None:
    pattern = miura(cells=(2, 1))
    z = pattern.vertices[:, 2]
    np.testing.assert_array_equal(select(pattern, "zmax"), np.flatnonzero(np.isclose(z, z.max())))
    # contract: vertex (i, j) is number i * (2 cells[1] + 1) + j, i along x
    np.testing.assert_array_equal(select(pattern, "xmin"), [0, 1, 2])
    np.testing.assert_array_equal(select(pattern, "xmax"), [12, 13, 14])


@pytest.mark.parametrize(
    ("expression", "text"),
    [
        ("x > 5", "selects no vertex; the pattern spans x 0 to 2, y -1 to 1, z 0 to 0"),
        ("xmid", "xmid is not known"),
        ("x", "x is not known; use xmin"),
        ("x = 1", "cannot be read .compare with ==, not =."),
        ("xmin and", "cannot be read"),
        ("x > y", "y is not a number"),
        ("1 < 2", "compare x, y or z with a number"),
        ("xmin > 1", "compare x, y or z with a number"),
        ("x in (1, 2)", "is not a number"),
        ("x is 1", "compare with <"),
        ("x > True", "True is not a number"),
        ("x > 1 + 1", "is not a number"),
        ("__import__('os').getcwd()", "is not a condition"),
        ("[].__class__", "is not a condition"),
        ("x > 1e999", "selects no vertex"),
        ("x > " + "9" * 400, "is not a finite number"),
        ("(" * 300 + "xmin" + ")" * 300, "cannot be read"),
        ("xmin or " * 200 + "xmin", "is longer than 1000 characters"),
        ("xmin\x00", "cannot be read"),
        ("x" + ".a" * 480, "has more than 50 nested operations"),
        ("not " * 200 + "xmin", "has more than 50 nested operations"),
        ("x > " + "-" * 900 + "1", "has more than 50 nested operations"),
        ("x > 0x" + "f" * 900, "is not a finite number"),
        ("x > 0ify", "cannot be read"),
        ("1", "1 is not a condition"),
    ],
)
@pytest.mark.filterwarnings("error")
def test_expressions_that_cannot_be_used(expression, text) -> None:
    with pytest.raises(InputError, match=text):
        select(GRID, expression)


def structure(points=GRID, centers=2) -> SimpleNamespace:
    """Stand-in for a structure: vertices followed by panel centers."""
    nodes = np.vstack([points, np.full((centers, 3), 0.0)])
    return SimpleNamespace(nodes=nodes, pattern=SimpleNamespace(vertices=points))


@pytest.mark.parametrize(
    ("nodes", "expected"),
    [
        (3, [3]),
        (np.int64(3), [3]),
        ([2, 0], [2, 0]),
        ((10,), [10]),
        (np.array([1, 2]), [1, 2]),
        (range(3), [0, 1, 2]),
        ("zmin", range(9)),  # vertices only, though the centers lie at z = 0 too
    ],
)
def test_nodes(nodes, expected) -> None:
    found = resolve_nodes(structure(), nodes)
    np.testing.assert_array_equal(found, list(expected))
    assert found.dtype == np.int64


@pytest.mark.parametrize(
    ("nodes", "text"),
    [
        ([0, 11], r"loads\[0\].nodes = \[0, 11\]: node 11 is out of range; .* 0 to 10"),
        ([-1], "node -1 is out of range"),
        ([0, 0], "node 0 is listed twice"),
        ([], "must be node numbers"),
        ([True], "true is not a node number"),
        (["xmin"], '"xmin" is not a node number'),
        ("", "cannot be read"),
        ("y > 3", r'loads\[0\].nodes = "y > 3": selects no vertex'),
    ],
)
def test_nodes_that_cannot_be_used(nodes, text) -> None:
    with pytest.raises(InputError, match=text):
        resolve_nodes(structure(), nodes, "loads[0].nodes")
