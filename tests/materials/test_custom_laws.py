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


def relative(a, b):
    return np.linalg.norm(a - b) / np.linalg.norm(b)


@pytest.mark.parametrize(
    ("custom", "built_in"), [(OGDEN, "ogden"), (LINEAR_BAR, "linear")], ids=["ogden", "linear"]
)
def test_bar_law_table(custom, built_in):
    stretch = np.linspace(0.5, 1.8, 27)
    law = bar_law(built_in)
    for f in ("energy", "stress", "slope"):
        np.testing.assert_allclose(
            getattr(custom, f)(stretch), getattr(law, f)(stretch), rtol=1e-12, atol=1e-16
        )


@pytest.mark.parametrize(
    ("custom", "built_in"),
    [(LINEAR, "linear"), (SUPERLINEAR, "superlinear")],
    ids=["linear", "superlinear"],
)
def test_hinge_law_table(custom, built_in):
    theta = np.linspace(0.1, 6.1, 27)
    law = hinge_law(built_in)
    for f in ("energy", "moment", "slope"):
        np.testing.assert_allclose(
            getattr(custom, f)(theta, 2.0), getattr(law, f)(theta, 2.0), rtol=1e-12
        )


@pytest.mark.parametrize(
    ("custom", "built_in"),
    [
        ({"bar_law": OGDEN}, {"bar_law": "ogden"}),
        ({"bar_law": LINEAR_BAR}, {"bar_law": "linear"}),
        ({"fold_law": LINEAR}, {"fold_law": "linear"}),
        ({"bend_law": SUPERLINEAR}, {"bend_law": "superlinear"}),
        (
            {"bar_law": OGDEN, "fold_law": SUPERLINEAR, "bend_law": LINEAR},
            {"bar_law": "ogden", "fold_law": "superlinear", "bend_law": "linear"},
        ),
    ],
    ids=["ogden", "linear bars", "linear folds", "superlinear bends", "all three"],
)
def test_structure_with_custom_laws(custom, built_in):
    pattern = fd.patterns.miura(dihedral=70)
    sheet = fd.Sheet(1e6, 0.25, 0.01)
    ours, theirs = (
        fd.discretize(pattern, sheet, preset="herkal", **laws) for laws in (custom, built_in)
    )
    u = 0.03 * np.random.default_rng(1).standard_normal(ours.nodes.shape)
    assert relative(ours.internal_force(u), theirs.internal_force(u)) < 1e-13
    assert relative(ours.tangent(u).toarray(), theirs.tangent(u).toarray()) < 1e-13
    for name, energy in theirs.energies(u).items():
        assert ours.energies(u)[name] == pytest.approx(energy, rel=1e-12)


def test_constants_from_outside_are_seen():
    factor = 3.5
    law = CustomHingeLaw(
        energy_of=lambda t, r: 0.5 * factor * (t - r) ** 2,
        moment_of=lambda t, r: factor * (t - r),
        slope_of=lambda t, r: factor,
        name="stiffer",
    )
    assert law.name == "stiffer"
    assert law.moment(2.0, 1.0) == 3.5
    assert law.slope(2.0, 1.0) == 3.5


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
    s = fd.discretize(fd.patterns.simple_fold(), fd.Sheet(1e6, 0.25, 0.01), fold_law=law)
    with pytest.raises(InputError, match="bad one"):
        s.energy(np.zeros(s.nodes.shape))


def test_the_message_names_the_function():
    law = CustomBarLaw(lambda s: s, lambda s: s, lambda s, t: s, name="mine")
    with pytest.raises(InputError, match=r"'mine': slope_of"):
        law.energy(1.0)
