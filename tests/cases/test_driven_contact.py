"""Supports and planes that would go through each other are refused before anything is computed."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from contact_sheets import strip
from foldyn.cases.contact_checks import _followers
from foldyn.dynamics import prepare
from foldyn.errors import InputError

LATE = fd.Ramp(0.01)
RISING = fd.Plane((0, 0, -1e-3), (0, 0, 1), motion=(0, 0, 2e-3), history=LATE)
GROUND = fd.Plane((0, 0, -1e-3), (0, 0, 1))
AT_HALF_TIME = r"contact.planes\[0\]: at t = 0.005\d* s it has reached node 0, and neither"


def case(supports, *planes: fd.Plane) -> fd.Case:
    return fd.Case(strip(2), supports, contact=fd.Contact(panels=False, planes=planes))


HELD = fd.Fix([0, 1])
FALLING = fd.Impose([0, 1], "z", -1e-3, LATE)
MEETING = fd.Plane((0, 0, -1e-3), (0, 0, 1), motion=(0, 0, 1e-3), history=LATE)


@pytest.mark.parametrize(
    ("supports", "plane"),
    [
        ([HELD, fd.BaseMotion("z", LATE, 1e-6)], RISING),
        ([HELD, fd.BaseMotion("x", LATE, 1e-6)], RISING),
        ([fd.Fix([0, 1], "z")], RISING),
        ([fd.Fix([0, 1], direction=(0, 0, -2))], RISING),
        ([fd.Impose([0, 1], "z", -2e-3, LATE)], GROUND),
        ([HELD, fd.BaseMotion("z", LATE, -2e-3)], GROUND),
        ([FALLING], MEETING),
    ],
)
def test_a_node_that_cannot_give_way_to_a_plane(supports, plane):
    with pytest.raises(InputError, match=AT_HALF_TIME):
        prepare(case(supports, plane), 0.02, method="rk4", interval=0.01)
    prepare(case(supports, plane), 0.004, method="rk4", interval=0.004)  # it ends before


def test_what_can_give_way_is_left_alone():
    beside = fd.Plane((-1e-3, 0, 0), (1, 0, 0), motion=(0, 0, 2e-3), history=LATE)
    for support, plane in (
        (fd.Fix([0, 1], "xy"), RISING),
        (HELD, RISING),  # planes leave such nodes alone
        (fd.Fix([0, 1], "yz"), beside),
        (HELD, fd.Plane((0, 0, 1e-3), (0, 0, -1))),
    ):
        prepare(case([support], plane), 0.02, method="rk4", interval=0.01)


def test_a_moving_node_that_starts_behind_a_plane():
    supports = [fd.Fix([0, 1]), fd.BaseMotion("z", LATE, 1e-6)]
    behind = fd.Plane((0.01, 0, 1e-3), (1, 0, 0))
    with pytest.raises(InputError, match=r"contact.planes\[0\]: node 0 is 0.01 m behind it"):
        prepare(case(supports, behind), 0.02, method="rk4", interval=0.01)


def test_panels_that_supports_move_through_each_other():
    """Two loose sheets: a held one, and one that is tilted and lowered through it."""
    square = np.array([[0, 0, 0], [0.04, 0, 0], [0.04, 0.04, 0], [0, 0.04, 0]])
    above = square * 0.5 + [0.01, 0.01, 2e-3]
    pattern = fd.Pattern(np.vstack([square, above]), [(0, 1, 2, 3), (4, 5, 6, 7)])
    s = fd.discretize(pattern, fd.Sheet(1e9, 0.3, 2e-4, 700.0), preset="plate")
    held = [fd.Fix([0, 1, 2, 3]), fd.Fix([4, 5, 6, 7], "xy"), fd.Impose([6, 7], "z", -1e-3, LATE)]

    def lowered(by: float, contact: fd.Contact | None) -> fd.Case:
        return fd.Case(s, [*held, fd.Impose([4, 5], "z", -by, LATE)], contact=contact)

    with pytest.raises(InputError, match=r"supports: at t = 0.00\d+ s panels 0 and 1, all of"):
        prepare(lowered(3e-3, fd.Contact()), 0.02, method="rk4", interval=0.01)
    prepare(lowered(1e-3, fd.Contact()), 0.02, method="rk4", interval=0.01)
    prepare(lowered(3e-3, None), 0.02, method="rk4", interval=0.01)


def test_panels_without_a_center_have_no_node_of_that_number():
    """Three triangles; the last node is free, and stays so."""
    nodes = [[0, 0, 0], [0.04, 0, 0], [0, 0.04, 0], [0, 0, 1e-3], [0.04, 0, 1e-3], [0, 0.04, 1e-3]]
    free = [[0.06, 0, 0], [0.1, 0, 0], [0.06, 0.04, 0]]
    pattern = fd.Pattern(nodes + free, [(0, 1, 2), (3, 4, 5), (6, 7, 8)])
    s = fd.discretize(pattern, fd.Sheet(1e9, 0.3, 2e-4, 700.0), preset="plate")
    supports = [fd.Fix([0, 1, 2]), fd.Fix([3, 4, 5, 6, 7], "xy"), fd.Fix([6, 7], "z")]
    drop = fd.Impose([3], "z", -5e-4, LATE)
    prepare(fd.Case(s, [*supports, drop], contact=fd.Contact()), 0.02, method="rk4", interval=0.01)
    assert len(_followers(fd.Case(s, supports), np.arange(9) < 8)[0]) == 0


def test_paths_refuse_the_same():
    pressed = case([fd.Fix([0, 1], "z")], fd.Plane((0, 0, -1e-3), (0, 0, 1), motion=(0, 0, 2e-3)))
    why = r"contact.planes\[0\]: at the load factor 0.5\d* it has reached node 0"
    with pytest.raises(InputError, match=why):
        fd.trace(pressed, "displacement", steps=4)
    dropped = case([fd.Fix([0, 1], "xy"), fd.Impose([0, 1], "z", -2e-3)], GROUND)
    with pytest.raises(InputError, match=why):
        fd.trace(dropped, load_factors=[0.0, 0.4, 1.0])
