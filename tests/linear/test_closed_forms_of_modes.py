"""Modes in closed form: hinged panels, a truss, a pendulum."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from bodies import SHEET, hinged_panel
from scipy.optimize import brentq

import foldyn as fd
from foldyn.errors import FoldynWarning
from foldyn.linear import modes
from foldyn.structures import MASS_RULES, ModelOptions

PANEL_SHARES = {  # second moment about an edge of a square over m h^2, by hand
    "panel": 2 / 5 + 1 / 5 / 4,
    "circumcenter": 2 / 8 + 1 / 2 / 4,
    "consistent": 1 / 3,  # linear fields are exact
    "inertia_exact": 1 / 3,
    "bubble": 1 / 3,
}


@pytest.mark.parametrize("mass", sorted(MASS_RULES))
def test_a_hinged_rigid_panel_with_each_mass_rule(mass):
    """f = sqrt(k / I) / 2 pi, I the rule's own; error of first order in fold over bend k."""
    errors = []
    for stiffness in (1e-3, 1e-4):
        case, turning = hinged_panel(mass, stiffness)
        x = case.structure.nodes
        arm = np.linalg.norm((x - x[2])[:, [0, 2]], axis=1)  # from the crease
        arm = np.where(np.isin(np.arange(len(x)), turning), arm, 0.0)
        inertia = arm @ (case.structure.mass @ arm)
        if mass in PANEL_SHARES:
            weight = SHEET.density * SHEET.thickness * 1.0**2
            assert inertia == pytest.approx(PANEL_SHARES[mass] * weight * 1.0**2)
        found = modes(case, 1)
        exact = np.sqrt(stiffness / inertia) / (2 * np.pi)
        errors.append(1 - float(found.frequency[0]) / exact)
        shape = np.linalg.norm(found["shape"].values[0], axis=1)
        expected = arm / np.sqrt(inertia)
        assert shape == pytest.approx(expected, abs=1e-2 * expected.max())
    assert 0 < errors[1] < 1e-4
    # the eigenvalues' rounding is up to 1e-3 of the smaller error on some machines
    assert errors[0] / errors[1] == pytest.approx(10, rel=3e-3)


class Truss:
    """Von Mises truss with a mass m at the apex: m f'' = -P(v), P = EA/L^3 v (2h - v)(h - v)."""

    h, b, EA, m = 0.1, 1.0, 1e4, 0.3

    def case(self, load=-1.0, held="xy"):
        s = fd.Structure(
            nodes=np.array([[-self.b, 0, 0], [self.b, 0, 0], [0, 0, self.h]], float),
            bars=np.array([[0, 2], [1, 2]]),
            bar_area=np.array([1e-4, 1e-4]),
            sheet=fd.Sheet(self.EA / 1e-4, 0.3, 0.01),
            options=ModelOptions(bar_law="linear"),
            node_mass=np.array([0.0, 0.0, self.m]),
        )
        supports = [fd.Fix([0, 1], "xyz"), fd.Fix([2], held)]
        return fd.Case(s, supports, [fd.Force([2], (0, 0, load))] if load else [])

    def eigenvalue(self, v):
        c = self.EA / np.hypot(self.h, self.b) ** 3
        return c * (2 * self.h**2 - 6 * self.h * v + 3 * v**2) / self.m


def test_a_truss_along_its_path():
    """Crisfield, Non-linear Finite Element Analysis 1, section 1.2: stiffness dP/dv."""
    truss = Truss()
    path = fd.trace(truss.case(), "arc_length", first_step=0.5, steps=25)
    seen = set()
    for step in range(0, path.sizes["step"], 4):
        state = fd.initial_state(path, step)
        v = -float(state.displacement[2, 2])
        expected = truss.eigenvalue(v)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            found = modes(truss.case(), 1, state)
        text = " ".join(str(w.message) for w in caught)
        assert float(found.eigenvalue[0]) == pytest.approx(expected, rel=1e-9)
        assert ("unstable equilibrium: 1 of the 1 modes" in text) == (expected < 0)
        assert np.isnan(found.frequency[0]) == (expected < 0)
        if expected > 0:
            assert float(found.frequency[0]) == pytest.approx(np.sqrt(expected) / 2 / np.pi)
        seen.add(bool(expected < 0))
    assert seen == {True, False}


@pytest.mark.filterwarnings("ignore:the path loses stability")
def test_a_truss_that_sways_aside():
    """High and narrow it buckles sideways before it snaps: on the path across, too.

    Crisfield, section 1.2, with the apex free sideways: the paths cross at z^2 = h^2 - 2 b^2.
    """
    truss = Truss()
    truss.h = 2.0
    case = truss.case(-1e4, held="y")
    path = fd.trace(case, "arc_length", first_step=0.05, steps=25)
    crossing = int(np.flatnonzero(path.point.values == "bifurcation")[0])
    z = truss.h + float(path.displacement[crossing, 2, 2])
    assert z == pytest.approx(np.sqrt(truss.h**2 - 2 * truss.b**2), rel=1e-6)
    branch = fd.switch_branch(path, crossing, steps=8, case=case)
    counts = set()
    for one, step in [(path, 0), (path, crossing + 1), (path, 24), (branch, 3), (branch, 7)]:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FoldynWarning)  # unstable states
            found = modes(case, 2, fd.initial_state(one, step))
        negative = int((found.eigenvalue < 0).sum())
        assert negative == int(one.negative_eigenvalues[step])
        assert found.attrs["residual"] < 1e-8
        counts.add(negative)
    assert counts >= {0, 1}


def test_a_truss_under_its_load():
    truss = Truss()
    load = truss.EA / np.hypot(truss.h, truss.b) ** 3 * 0.02 * 0.18 * 0.08  # at v = 0.02
    found = modes(truss.case(-load), 1, "equilibrium")
    assert float(found.displacement[2, 2]) == pytest.approx(-0.02, rel=1e-8)
    assert float(found.eigenvalue[0]) == pytest.approx(truss.eigenvalue(0.02), rel=1e-7)


def test_a_pendulum():
    """A weight m g on a stiff bar of length l: f = sqrt(g/l) / 2 pi, twice; not a rigid mode."""
    length, gravity, m = 0.7, 9.81, 0.2
    s = fd.Structure(
        nodes=np.array([[0, 0, 0], [0, 0, -length]], float),
        bars=np.array([[0, 1]]),
        bar_area=np.array([1e-4]),
        sheet=fd.Sheet(1e9, 0.3, 0.01),
        node_mass=np.array([0.0, m]),
    )
    case = fd.Case(s, [fd.Fix([0], "xyz")], [fd.Gravity((0, 0, -gravity))])

    def hanging(stretch):
        return np.array([[0, 0, 0], [0, 0, -stretch]])

    stretch = brentq(
        lambda d: s.internal_force(hanging(d))[1, 2] + m * gravity, 0, 1e-4, xtol=1e-18
    )
    found = modes(case, 2, fd.State(hanging(stretch)))
    stretched = length + stretch
    expected = np.sqrt(gravity / stretched) / 2 / np.pi
    np.testing.assert_allclose(found.frequency, expected, rtol=1e-9)
    np.testing.assert_allclose(found.rigid_share, 1.0, atol=1e-9)
    assert not found.rigid.any()
