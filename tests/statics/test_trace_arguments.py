"""What `trace` refuses, and how it says so."""

from __future__ import annotations

import numpy as np
import pytest
from sheets import compression, ideal_supports, specimen
from trusses import APEX, VonMises

import foldyn as fd
from foldyn.errors import InputError
from foldyn.statics import Settings, trace

STUCK = fd.Case(VonMises().structure(), [fd.Fix([0, 1, 2], "xyz")])
IDLE = fd.Case(specimen(), [*ideal_supports(), fd.Fix([3], "x")])


@pytest.fixture(scope="module")
def case():
    return VonMises().case()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"method": "newtn"}, "choose one of newton, displacement, mgdcm, arc_length"),
        ({"load_factors": [1.0], "steps": 3}, "give one of them"),
        ({"load_factors": [0.0, np.nan]}, "finite number"),
        ({"load_factors": []}, "at least one"),
        ({"load_factors": "all"}, "must be numbers"),
        ({"load_factors": [0.5, 0.5]}, "number 1 repeats"),
        ({"steps": 0}, "steps = 0: must be a whole number, at least 1"),
        ({"steps": True}, "whole number, at least 1"),
        ({"first_step": 0.1}, "method 'newton' is driven by load_factors"),
        ({"method": "mgdcm", "load_factors": [0, 1, 2]}, "two numbers"),
        ({"method": "mgdcm", "load_factors": [1, 1]}, "begin and end must differ"),
        ({"method": "mgdcm", "first_step": 0.0}, "not zero"),
        ({"method": "mgdcm", "load_factors": [0, 1], "first_step": -0.1}, "leads away"),
        ({"method": "displacement"}, "needs something that moves"),
        ({"constant": "weight"}, 'give "gravity"'),
        ({"constant": "gravity"}, "no Gravity among its loads"),
        ({"constant": [1]}, "no load 1; it has 1, counted from 0"),
        ({"constant": [0.5]}, "0.5 is not a load number"),
        ({"constant": None}, "is not a load number"),
        ({"constant": [0]}, "nothing grows along the path"),
        ({"initial": np.zeros((3, 3))}, "give a State"),
        ({"initial": fd.State(np.zeros((4, 3)))}, r"shape \(4, 3\): the case has \(3, 3\)"),
        ({"settings": 1e-6}, "settings: got float, give statics.Settings"),
        ({"settings": {"tolerence": 1e-6}}, "did you mean 'tolerance'"),
        ({"settings": {"largest_turn": -3.0}}, "settings: largest_turn = -3.0: must be greater"),
        ({"until": 0.1}, "until = 0.1: give a function, or a table of"),
        ({"until": {"node": 2, "axis": "z"}}, "until.displacement: missing"),
        ({"until": {"node": 9, "axis": "z", "displacement": 1.0}}, "until.node = .*out of range"),
        ({"until": {"node": 2, "axis": "z", "displacement": 0}}, "is the value at rest"),
        ({"inertia_relief": 1}, "True or False"),
        ({"inertia_relief": True}, "needs the mass"),
        ({"case": STUCK}, "nothing can move"),
        ({"case": IDLE}, "nothing grows along the path"),
        ({"case": specimen()}, "got Structure, give a Case"),
        ({"settings": Settings(solver="umfpack")}, "choose one of auto, superlu, rslab, pardiso"),
    ],
)
def test_bad_arguments(case, arguments, message):
    with pytest.raises(InputError, match=message):
        trace(**{"case": case, **arguments})


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"tolerance": 0.0}, "at least 1e-14"),
        ({"tolerance": 0.5}, "must be at most 0.01"),
        ({"iterations": 0}, "whole number, at least 1"),
        ({"target": 2.5}, "whole number, at least 1"),
        ({"jump": 1.0}, "greater than 1"),
        ({"largest_turn": -3}, "greater than 0"),
        ({"locate": 1}, "True or False"),
    ],
)
def test_bad_settings(values, message):
    with pytest.raises(InputError, match=message):
        Settings(**values)


def test_state_under_constant_loads_alone():
    """load_factors = [0] finds the state at rest: folds that are not stress-free open."""
    case = fd.Case(specimen("as_published"), ideal_supports())
    path = trace(case, load_factors=[0.0])
    assert float(path.displacement.sel(node=3, axis="x")[0]) < -1e-3
    assert path.residual.values[0] < 1e-9


def test_rest_angle_out_of_range():
    s = fd.discretize(
        fd.patterns.simple_fold(dihedral=60), fd.Sheet(1e6, 0.25, 0.01), preset="plate"
    )
    supports = [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "z")]
    case = fd.Case(s, supports, [fd.Actuate([0], 200.0)])
    with pytest.raises(InputError, match="at 4 the rest angle of crease 0 would leave 0 to 360"):
        trace(case, load_factors=[1.0, 4.0])


def test_start_with_nodes_on_top_of_each_other():
    case = compression()
    u = np.zeros_like(case.structure.nodes)
    u[30] = case.structure.nodes[31] - case.structure.nodes[30]
    with pytest.raises(InputError, match="initial: the neighboring nodes 30 and 31 coincide"):
        trace(case, load_factors=[0.0], initial=fd.State(u))


def test_base_motion_and_histories_play_no_part():
    truss = VonMises()
    supports = [*truss.case().supports, fd.BaseMotion("z", fd.HalfSine(0.5), 0.1)]
    load = fd.Force([APEX], (0, 0, -1.0), fd.Pulse(0.1))
    moved = trace(fd.Case(truss.structure(), supports, [load]), load_factors=[2.0])
    plain = trace(truss.case(), load_factors=[2.0])
    np.testing.assert_array_equal(moved.displacement, plain.displacement)


def test_a_table_says_where_a_path_ends_and_how_it_steps(case):
    """As a function and `Settings` do."""
    end = -0.4 * VonMises().h
    tables = trace(
        case, "arc_length", until={"node": APEX, "axis": "z", "displacement": end},
        settings={"largest_turn": 2.0},
    )  # fmt: skip
    objects = trace(
        case, "arc_length", until=lambda u, factor: u[APEX, 2] <= end,
        settings=Settings(largest_turn=2.0),
    )  # fmt: skip
    np.testing.assert_array_equal(tables.displacement, objects.displacement)
    assert tables.displacement[-1, APEX, 2] <= end < tables.displacement[-2, APEX, 2]
