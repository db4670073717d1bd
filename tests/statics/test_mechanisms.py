"""Mechanisms: refused by name; what only looks like one is not."""

from __future__ import annotations

import numpy as np
import pytest
from sheets import BOTTOM, ideal_supports, specimen
from trusses import VonMises

import foldyn as fd
from foldyn.errors import InputError
from foldyn.statics import OrigamiProblem, mechanisms, trace


def names(structure, supports):
    return mechanisms(OrigamiProblem(fd.Case(structure, supports)))


@pytest.fixture(scope="module")
def sheet():
    return specimen()


MOTIONS = [f"{kind} {axis}" for kind in ("translation along", "rotation about") for axis in "xyz"]


@pytest.mark.parametrize(
    ("supports", "expected"),
    [
        ([], MOTIONS),
        ([fd.Fix([59], "xyz")], MOTIONS[3:]),
        ([fd.Fix([3, 10, 20, 40], "xy")], MOTIONS[2:3]),
        ([fd.Fix(BOTTOM, "x"), fd.Fix([59], "yz")], MOTIONS[3:4]),
        ([fd.Fix([57, 59, 61, 3], "z")], [*MOTIONS[:2], MOTIONS[5]]),
        (ideal_supports(), []),
    ],
)
def test_rigid_motions(sheet, supports, expected):
    assert names(sheet, supports) == expected
    # about the line through two nodes that do not lie along an axis
    x = sheet.nodes[60] - sheet.nodes[3]
    (found,) = names(sheet, [fd.Fix([3, 60], "xyz")])
    assert found == f"rotation about (1, {x[1] / x[0]:.3g}, {x[2] / x[0]:.3g})"


def test_folds_without_stiffness(sheet):
    """A Miura whose creases resist nothing folds as a rigid mechanism, with one freedom."""
    loose = specimen(crease_stiffness=1e-50)
    found = names(loose, ideal_supports())
    assert len(found) == 1
    assert found[0].startswith("internal mechanism that moves nodes 0, 1, 2, 3, 4, 5, 6")
    assert names(loose, [*ideal_supports(), fd.Fix([3], "x")]) == []  # held apart: rigid


def test_large_soft_sheet_is_no_mechanism():
    """Its softest mode is 4e-9 of a bar's stiffness, and resists."""
    pattern = fd.patterns.miura(cells=(20, 20), a=0.025, b=0.025, panel_angle=60, dihedral=90)
    s = fd.discretize(pattern, fd.Sheet(1219e6, 0.2, 0.1e-3), preset="herkal")
    assert names(s, [fd.Fix("xmin", "xyz")]) == []


@pytest.mark.parametrize(
    ("truss", "free", "expected"),
    [
        (VonMises(), "xyz", ["rotation about x"]),  # out of its plane, about its feet
        (VonMises(), "xz", []),
        (VonMises(h=0.0), "z", ["internal mechanism that moves node 2 along z"]),  # to first order
        (VonMises(h=1e-4), "z", []),
    ],
)
def test_trusses(truss, free, expected):
    assert mechanisms(OrigamiProblem(truss.case(free=free))) == expected


def test_node_that_no_bar_touches():
    nodes = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 5, 5]], float)
    bars, sheet = np.array([[0, 1], [1, 2], [2, 0]]), fd.Sheet(1e6, 0.3, 0.01)
    structure = fd.Structure(nodes, bars, np.full(3, 1e-4), sheet)
    found = names(structure, [fd.Fix([0, 1, 2], "z"), fd.Fix([0], "xy"), fd.Fix([1], "y")])
    assert len(found) == 3 and all("node 3" in name for name in found)


def test_trace_refuses_and_says_what_helps(sheet):
    case = fd.Case(sheet, [], [fd.Force([3], (0.1, 0, 0))])
    with pytest.raises(InputError) as caught:
        trace(case)
    message = str(caught.value)
    for name in ("translation along x", "rotation about z", "hold what moves", "inertia_relief"):
        assert name in message


def test_start_state_is_judged_where_it_is():
    """A flat truss is a mechanism; pressed down a little it is not."""
    u = np.zeros((3, 3))
    u[2, 2] = -0.05
    path = trace(VonMises(h=0.0).case(), load_factors=[1.0], initial=fd.State(u))
    v = -float(path.displacement[0, 2, 2])
    assert VonMises(h=0.0).load(v) == pytest.approx(1.0, rel=1e-8)
