"""Modes without a frequency: rigid motions, mechanisms, soft bends, unstable equilibria."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bodies import body, flat, hinged_panel, miura
from scipy.linalg import eigh

import foldyn as fd
from foldyn.errors import FoldynWarning
from foldyn.linear import linearize, modes

STRAIGHT = {"fold_law": "linear", "bend_law": "linear"}
HELD = [fd.Fix([0, 1, 2], "xyz")]


# ------------------------------------------------------------------ rigid modes, zero frequencies


def test_rigid_modes_of_a_free_body():
    found = modes(fd.Case(body("kresling", mass="consistent")), 10)
    np.testing.assert_array_equal(found.rigid, [True] * 6 + [False] * 4)
    np.testing.assert_array_equal(found.frequency[:6], 0.0)
    np.testing.assert_allclose(found.rigid_share[:6], 1.0, atol=1e-12)
    assert (found.rigid_share[6:] < 1e-12).all()
    for axis in range(3):  # translations first, along x, y, z
        shape = found["shape"].values[axis]
        np.testing.assert_allclose(shape[:, axis], 1 / np.sqrt(found.attrs["free_mass"][axis]))
    assert np.isnan(found.damping_ratio[:6]).all()


def test_rigid_modes_in_a_folded_state_of_a_free_body():
    """About another equilibrium than rest: rotations are about the state's own nodes."""
    case = fd.Case(body("miura", fold_law=fd.EnhancedLinear(70, 290, rest="as_published")))
    assert len(case.structure.nodes) == 41
    found = modes(case, 8, state="equilibrium", secant=1.0)
    assert float(abs(found.displacement).max()) > 1e-3
    assert found.rigid.values.tolist() == [True] * 6 + [False] * 2


@pytest.mark.parametrize(
    ("supports", "count"),
    [
        ([fd.Fix([0], "xyz")], 3),
        ([fd.Fix([0], "xyz"), fd.Fix([4], "x")], 2),
        ([fd.Fix([0, 2, 4], "z")], 4),  # on a line along y
        ([fd.Fix([0, 4, 20], "z")], 3),
        ([fd.Fix([0], "z")], 5),
        ([fd.Fix([0, 4], "xyz")], 1),
        ([fd.Fix([0, 4, 20], "xyz")], 0),
    ],
)
def test_rigid_modes_that_supports_leave(supports, count):
    case = fd.Case(miura(**STRAIGHT), supports)
    found = modes(case, 8)
    assert int(found.rigid.sum()) == count == int((found.frequency == 0).sum())
    linear = linearize(case)
    values = eigh(flat(linear.stiffness), flat(linear.mass), eigvals_only=True)
    np.testing.assert_allclose(found.eigenvalue[count:], values[count:8], rtol=1e-9)


def test_a_mechanism_has_no_frequency_and_is_not_rigid():
    """A panel hinged without a spring turns freely while the other one is held."""
    case, _ = hinged_panel("panel", 1.0)
    case = fd.Case(replace(case.structure, fold_stiffness=np.zeros(1)), case.supports)
    found = modes(case, 2)
    assert found.frequency.values[0] == 0.0 < found.frequency.values[1]
    assert not found.rigid.any()


def test_soft_hinges_at_rest():
    """Panels bend freely at first order: zeros or what the folds give, never noise.

    Secant slopes grow as A^(1/3): so do the eigenvalues of modes that only bends resist.
    """
    case = fd.Case(body("eggbox"), HELD)
    with pytest.warns(FoldynWarning, match="64 hinges of the superlinear law"):
        found = modes(case, 12)
    assert found.attrs["soft_hinges"] == 64
    zero = found.frequency.values == 0.0
    assert zero.any() and not zero.all()
    s = case.structure
    options = replace(s.options, bend_law="linear")
    bare = replace(s, bend_stiffness=np.zeros(64), options=options)
    expected = modes(fd.Case(bare, HELD), 12)
    np.testing.assert_allclose(found.frequency, expected.frequency, rtol=1e-7)
    soft, amplitudes = int(zero.sum()), (1e-10, 1e-9)
    one, ten = (modes(case, soft + 4, secant=a).frequency.values for a in amplitudes)
    power = np.log10(ten / one)
    np.testing.assert_allclose(power[:soft], 1 / 6, atol=2e-3)
    assert (power[soft:] < 0.08).all()


# ------------------------------------------------------------------ prestress, instability


def pressed_flat(shortening):
    """A flat sheet that is pressed in its plane and stays in it: unstable beyond a bound."""
    s = miura(cells=(4, 3), dihedral=180, scheme="n4b5", **STRAIGHT)
    end = np.flatnonzero(s.nodes[:, 0] > s.nodes[:, 0].max() - 1e-9)
    start = np.flatnonzero(s.nodes[:, 0] < 1e-9)
    supports = [
        fd.Fix(start, "xz"), fd.Fix(start[:1], "y"), fd.Fix(end, "z"),
        fd.Impose(end, "x", -shortening * s.nodes[:, 0].max()),
    ]  # fmt: skip
    return fd.Case(s, supports)


def test_prestress_moves_frequencies():
    """Tension stiffens the bending of a flat sheet, pressure softens it, in proportion at first."""
    slack, pulled, pressed = (
        modes(pressed_flat(d), 1, state="equilibrium").eigenvalue.values[0]
        for d in (0.0, -1e-7, 1e-7)
    )
    assert pressed < slack < pulled
    assert pulled - slack == pytest.approx(slack - pressed, rel=0.02)


def test_unstable_modes_of_a_sheet_pressed_in_its_plane():
    case = pressed_flat(1e-2)
    linear = linearize(case, "equilibrium")
    values = eigh(flat(linear.stiffness), flat(linear.mass), eigvals_only=True)
    unstable = int((values < 0).sum())
    assert unstable > 10
    with pytest.warns(FoldynWarning, match=f"unstable equilibrium: {unstable} of the"):
        found = modes(case, unstable + 4, state="equilibrium")
    np.testing.assert_allclose(found.eigenvalue, values[: unstable + 4], rtol=1e-7)
    np.testing.assert_array_equal(np.isnan(found.frequency), np.arange(unstable + 4) < unstable)
    assert found.attrs["complete"] == unstable + 4
    with pytest.warns(FoldynWarning, match="3 of the 3"):
        few = modes(case, 3, state="equilibrium")
    np.testing.assert_allclose(few.eigenvalue, values[:3], rtol=1e-7)
