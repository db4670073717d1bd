"""Creases far stiffer than their panels that yield, creep or soften (n5b8e, shells)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from measured import apart
from moving_sheets import EXPLICIT

import foldyn as fd
from foldyn.dynamics import softening, stability
from foldyn.errors import FoldynWarning, InputError
from foldyn.materials import hinge_law
from pairwise import beyond

PATTERN = fd.patterns.miura(cells=(1, 1), b=1.1, panel_angle=65, dihedral=100)
SHEET = fd.Sheet(1e6, 0.3, 0.03, 1000.0)
PLASTIC = fd.Plastic(yield_moment=1.0, isotropic=0.5, law="linear")
AS_STIFF = 7.2  # N m/rad per m: crease 1 is then as stiff as the panels beside it
LONG = 2.0  # s, of loads that the sheet follows


def case(k, law, moment=2.0, duration=LONG, model="n5b8e"):
    options = {"crease_stiffness": k, "fold_law": law}
    if model == "shell":
        sheet = fd.shell(PATTERN, SHEET, divisions=2, **options)
    else:
        sheet = fd.discretize(PATTERN, SHEET, preset="n5b8e", **options)
    load = fd.CreaseMoment([1], moment, fd.HalfSine(duration))
    return fd.Case(sheet, [fd.Fix([0, 1, 2])], [load])


def both(made, method="rk4", duration=LONG):
    """An explicit motion, and an implicit one with small steps."""
    length, interval = 1.25 * duration, duration / 20.0
    wanted = fd.simulate(
        made, length, method="generalized_alpha", dt=duration / 2000.0, interval=interval
    )
    return fd.simulate(made, length, method=method, interval=interval), wanted


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("ratio", "model", "method"),
    [
        (10.0, "n5b8e", "rk4"), (100.0, "n5b8e", "central_difference"), (100.0, "shell", "rk4"),
        *beyond([(r, "n5b8e", method) for r in (10.0, 100.0, 3000.0) for method in EXPLICIT]),
    ],
)  # fmt: skip
def test_stiff_creases_yield_as_in_implicit_motions(ratio, model, method, monkeypatch):
    """With an inertia in proportion to the stiffness at rest they yield far too slowly."""
    lasting = LONG if model == "n5b8e" else 3.0 * LONG  # pieces of its creases yield in turn
    found, wanted = both(case(ratio * AS_STIFF, PLASTIC, 2.0, lasting, model), method, lasting)
    assert float(wanted.dissipated[-1]) > 0.05
    assert apart(found, wanted) < 3e-3
    assert apart(found, wanted, "dissipated") < 1e-2
    if model == "n5b8e" and ratio == 100.0 and method == "central_difference":
        monkeypatch.setattr(stability, "lost_stiffness", lambda made: np.zeros(16))
        with pytest.warns(FoldynWarning, match="lose stiffness"):
            heavy, _ = both(case(ratio * AS_STIFF, PLASTIC), method)
        assert apart(heavy, wanted) > 2e-2


@pytest.mark.matrix
def test_steps_are_shorter_by_the_root_of_what_is_lost():
    plain, yielding = (
        [fd.critical_step(case(ratio * AS_STIFF, law)) for ratio in (1e-3, 1e2, 1e3)]
        for law in ("linear", PLASTIC)
    )
    assert np.ptp(plain) < 1e-3 * plain[0]
    assert yielding[0] == pytest.approx(plain[0], rel=0.02)
    assert yielding[1] / yielding[2] == pytest.approx(math.sqrt(10.0), rel=0.02)
    assert 0.5 / math.sqrt(1e3) < yielding[2] / plain[2] < 2.0 / math.sqrt(1e3)


def soft(turn=0.05):
    """M = k s tanh(d / s), which softens beyond the turn s."""
    return fd.CustomHingeLaw(
        lambda t, r: turn**2 * math.log(math.cosh((t - r) / turn)),
        lambda t, r: turn * math.tanh((t - r) / turn),
        lambda t, r: 1.0 - math.tanh((t - r) / turn) ** 2,
        "soft",
    )


def bistable():
    """Rests at the turns 0 and 0.2 rad, and pushes away from 0.1 rad."""
    return fd.CustomHingeLaw(
        lambda t, r: (t - r) ** 2 * (0.5 - 5.0 * (t - r) + 12.5 * (t - r) ** 2),
        lambda t, r: (t - r) * (1.0 - 10.0 * (t - r)) * (1.0 - 5.0 * (t - r)),
        lambda t, r: 1.0 - 30.0 * (t - r) + 150.0 * (t - r) ** 2,
        "bistable",
    )


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("law", "moment"),
    [
        (soft(), 12.0), (bistable(), 1.5), (fd.Eyring(0.2, 1.0, law="linear"), 2.0),
        *beyond([("superlinear", 10.0), (fd.Prony([20.0], [0.02], law="linear"), 2.0)]),
    ],
    ids=lambda value: getattr(value, "name", value),
)  # fmt: skip
def test_creases_of_other_laws_soften_as_in_implicit_motions(law, moment):
    """Crease 1 is 28 times as stiff as its panels."""
    found, wanted = both(case(200.0, law, moment))
    assert apart(found, wanted) < 2e-3


@pytest.mark.matrix
def test_a_motion_as_fast_as_edge_angles_swing_is_doubted():
    """Yielding in three swings, after a tenth of the time that the test above gives it."""
    made = case(100.0 * AS_STIFF, PLASTIC, duration=0.1 * LONG)
    with pytest.warns(FoldynWarning, match=r"law 'plastic'.*generalized_alpha"):
        found, wanted = both(made, duration=0.1 * LONG)
    assert apart(found, wanted) > 1e-2


@pytest.mark.parametrize("method", EXPLICIT)
def test_creases_that_would_make_steps_far_shorter_are_refused(method):
    made = case(2e4 * AS_STIFF, PLASTIC)
    with pytest.raises(InputError, match=r"method: .*'plastic'.*generalized_alpha"):
        fd.simulate(made, 0.1, method=method, interval=0.1)
    assert fd.simulate(made, 0.01, method="auto", interval=0.01).attrs["method"] not in EXPLICIT
    fd.critical_step(case(2e4 * AS_STIFF, "linear"), method)


@pytest.mark.parametrize(
    ("law", "least"),
    [
        ("linear", 1.0), ("superlinear", 0.0), (fd.EnhancedLinear(), 1.0),
        (fd.PlateSuperlinear(2.0), 1.0), (soft(), 0.0), (bistable(), 0.0), (PLASTIC, 0.2),
        (fd.Plastic(1.0, kinematic=0.5), 0.2), (fd.Plastic(1.0), 0.0), (fd.Eyring(1.0, 1.0), 0.0),
        (fd.Prony([20.0], [1.0]), 1.0), (fd.Prony([20.0], [1.0], law=soft()), 0.0),
    ],
)  # fmt: skip
def test_the_least_slope_of_a_law(law, least):
    rest, one = np.radians([20.0, 150.0, 250.0]), np.ones(3)
    found = hinge_law(law, "law").least_slope(rest, 4.0 * one, 2.0 * one)
    np.testing.assert_allclose(found, least, atol=1e-12)


def test_what_closed_creases_lose_as_they_open():
    """Beyond the locking angle they are 1 / cos^2 times as stiff."""
    law = fd.EnhancedLinear(theta1=130.0, theta2=230.0)
    made, plain = (stability.explicit(case(AS_STIFF, one)) for one in (law, "linear"))
    assert not softening.lost_stiffness(plain).any()
    hinges, rest = made.structure.body.sheet.fold_hinges(), made.structure.fold_rest
    per_hidden = hinges.per_hidden[:, 0]
    lost = (law.slope(rest, rest) - 1.0) * hinges.stiffness * per_hidden**2 * 4.0
    assert lost.max() > 0.01 * (hinges.stiffness * per_hidden**2).max()
    own = np.searchsorted(made.body.hidden, hinges.hidden[:, 0])
    np.testing.assert_allclose(softening.lost_stiffness(made)[own], lost, rtol=1e-6, atol=1e-9)
