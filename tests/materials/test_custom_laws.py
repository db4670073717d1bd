"""Laws of the user's own: the same numbers as built-in laws from the same formulas."""

from __future__ import annotations

import math

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError
from foldyn.materials import CustomBarLaw, CustomHingeLaw, bar_law, hinge_law

# plain formulas, and those that the built-in laws use near rest where the plain ones cancel
OGDEN = CustomBarLaw(
    energy_of=lambda s: 0.25 * ((s**5 - 1.0) / 5.0 - (s - 1.0)),
    stress_of=lambda s: 0.25 * (s**3 - 1.0 / s),
    slope_of=lambda s: 0.25 * (3.0 * s + s**-3),
)
LINEAR_BAR = CustomBarLaw(
    energy_of=lambda s: 0.125 * (s * s - 1.0) ** 2,
    stress_of=lambda s: 0.5 * (s * s - 1.0),
    slope_of=lambda s: 1.0,
)
LINEAR = CustomHingeLaw(
    energy_of=lambda t, r: 0.5 * (t - r) ** 2,
    moment_of=lambda t, r: t - r,
    slope_of=lambda t, r: 1.0,
)
SUPERLINEAR = CustomHingeLaw(
    energy_of=lambda t, r: 3.0 / 7.0 * abs(t - r) ** (7.0 / 3.0),
    moment_of=lambda t, r: math.copysign(abs(t - r) ** (4.0 / 3.0), t - r),
    slope_of=lambda t, r: 4.0 / 3.0 * abs(t - r) ** (1.0 / 3.0),
)


@pytest.mark.parametrize(
    ("custom", "built_in"),
    [
        (OGDEN, bar_law("ogden")),
        (LINEAR_BAR, bar_law("linear")),
        (LINEAR, hinge_law("linear")),
        (SUPERLINEAR, hinge_law("superlinear")),
    ],
    ids=["ogden", "linear bar", "linear", "superlinear"],
)
def test_tables_of_values(custom, built_in):
    bars = isinstance(custom, CustomBarLaw)
    given = (np.linspace(0.5, 1.8, 27),) if bars else (np.linspace(0.1, 6.1, 27), 2.0)
    for name in ("energy", "stress" if bars else "moment", "slope"):
        found, wanted = (getattr(law, name)(*given) for law in (custom, built_in))
        np.testing.assert_allclose(found, wanted, rtol=1e-12, atol=1e-16)


@pytest.mark.parametrize(
    ("custom", "built_in"),
    [
        ((OGDEN, SUPERLINEAR, LINEAR), ("ogden", "superlinear", "linear")),
        ((LINEAR_BAR, LINEAR, SUPERLINEAR), ("linear", "linear", "superlinear")),
    ],
)
def test_structure_with_custom_laws(custom, built_in):
    pattern, sheet = fd.patterns.miura(dihedral=70), fd.Sheet(1e6, 0.25, 0.01)
    fields = ("bar_law", "fold_law", "bend_law")
    ours, theirs = (
        fd.discretize(pattern, sheet, preset="herkal", **dict(zip(fields, laws, strict=True)))
        for laws in (custom, built_in)
    )
    u = 0.03 * np.random.default_rng(1).standard_normal(ours.nodes.shape)
    for found, wanted in (
        (ours.internal_force(u), theirs.internal_force(u)),
        (ours.tangent(u).toarray(), theirs.tangent(u).toarray()),
    ):
        assert np.linalg.norm(found - wanted) < 1e-13 * np.linalg.norm(wanted)
    assert ours.energies(u) == pytest.approx(theirs.energies(u), rel=1e-12)


def test_constants_from_outside_are_seen():
    factor = 3.5
    law = CustomHingeLaw(
        lambda t, r: 0.5 * factor * (t - r) ** 2, lambda t, r: factor * (t - r),
        lambda t, r: factor, name="stiffer",
    )  # fmt: skip
    assert (law.name, law.moment(2.0, 1.0), law.slope(2.0, 1.0)) == ("stiffer", 3.5, 3.5)


def test_division_by_zero_gives_inf_not_a_silent_zero():
    law = CustomBarLaw(lambda s: 1.0 / (s - 1.0), lambda s: -1.0 / (s - 1.0), lambda s: s)
    assert law.energy(1.0) == math.inf
    assert law.stress(1.0) == -math.inf


@pytest.mark.parametrize(
    "function",
    [
        lambda t, r: open(str(t)),  # noqa: SIM115 (never runs)
        lambda t, r: undefined_name * t,  # noqa: F821
        lambda t, r: {}[t],
        lambda t: t,
        lambda t, r, q: t,
        math.sin,
        "t - r",
        3.0,
    ],
    ids=["opens a file", "unknown name", "dict", "one argument", "three", "math.sin", "str", "3"],
)
def test_what_cannot_be_compiled(function):
    law = CustomHingeLaw(function, function, function, name="bad one")
    with pytest.raises(InputError, match=r"'bad one': energy_of cannot be compiled"):
        law.moment(1.0, 1.0)
    s = fd.discretize(
        fd.patterns.simple_fold(), fd.Sheet(1e6, 0.25, 0.01), fold_law=law, preset="plate"
    )
    with pytest.raises(InputError, match="bad one"):
        s.energy(np.zeros(s.nodes.shape))


def test_the_message_names_the_function():
    law = CustomBarLaw(lambda s: s, lambda s: s, lambda s, t: s, name="mine")
    with pytest.raises(InputError, match=r"'mine': slope_of"):
        law.energy(1.0)
