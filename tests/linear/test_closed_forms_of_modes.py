"""Modes in closed form: hinged panels, a truss, a pendulum."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from bodies import SHEET, hinged_panel
from scipy.optimize import brentq

import foldyn as fd
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
        x, arm = case.structure.nodes, np.zeros(len(case.structure.nodes))
        arm[turning] = np.linalg.norm((x - x[2])[turning][:, [0, 2]], axis=1)  # from the crease
        inertia = arm @ (case.structure.mass @ arm)
        if mass in PANEL_SHARES:
            weight = SHEET.density * SHEET.thickness * 1.0**2
            assert inertia == pytest.approx(PANEL_SHARES[mass] * weight * 1.0**2)
        found = modes(case, 1)
        exact = np.sqrt(stiffness / inertia) / (2 * np.pi)
        errors.append(1 - float(found.frequency[0]) / exact)
        shape, expected = np.linalg.norm(found["shape"].values[0], axis=1), arm / np.sqrt(inertia)
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
    truss, seen = Truss(), set()
    path = fd.trace(truss.case(), "arc_length", first_step=0.5, steps=25)
    for step in range(0, path.sizes["step"], 4):
        state = fd.initial_state(path, step)
        expected = truss.eigenvalue(-float(state.displacement[2, 2]))
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            found = modes(truss.case(), 1, state=state)
        text = " ".join(str(w.message) for w in caught)
        assert float(found.eigenvalue[0]) == pytest.approx(expected, rel=1e-9)
        assert ("unstable equilibrium: 1 of the 1 modes" in text) == (expected < 0)
        frequency = np.sqrt(expected) / 2 / np.pi if expected > 0 else np.nan
        assert float(found.frequency[0]) == pytest.approx(frequency, nan_ok=True)
        seen.add(bool(expected < 0))
    assert seen == {True, False}
    load = truss.EA / np.hypot(truss.h, truss.b) ** 3 * 0.02 * 0.18 * 0.08  # at v = 0.02
    found = modes(truss.case(-load), 1, state="equilibrium")
    assert float(found.displacement[2, 2]) == pytest.approx(-0.02, rel=1e-8)
    assert float(found.eigenvalue[0]) == pytest.approx(truss.eigenvalue(0.02), rel=1e-7)


@pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")  # unstable states
def test_a_truss_that_sways_aside():
    """High and narrow it buckles sideways before it snaps: on the path across, too.

    Crisfield, section 1.2, with the apex free sideways: the paths cross at z^2 = h^2 - 2 b^2.
    """
    truss = Truss()
    truss.h = 2.0
    case = truss.case(-1e4, held="y")
    path = fd.trace(case, "arc_length", first_step=0.05, steps=20)
    crossing = int(np.flatnonzero(path.point.values == "bifurcation")[0])
    z = truss.h + float(path.displacement[crossing, 2, 2])
    assert z == pytest.approx(np.sqrt(truss.h**2 - 2 * truss.b**2), rel=1e-6)
    branch, counts = fd.switch_branch(path, crossing, steps=8, case=case), set()
    for one, step in [(path, 0), (path, crossing + 1), (path, 24), (branch, 3), (branch, 7)]:
        found = modes(case, 2, state=fd.initial_state(one, step))
        negative = int((found.eigenvalue < 0).sum())
        assert negative == int(one.negative_eigenvalues[step])
        assert found.attrs["residual"] < 1e-8
        counts.add(negative)
    assert counts >= {0, 1}


def test_a_pendulum():
    """A weight m g on a stiff bar of length l: f = sqrt(g/l) / 2 pi, twice; not a rigid mode."""
    length, gravity, m = 0.7, 9.81, 0.2
    nodes, sheet = np.array([[0, 0, 0], [0, 0, -length]]), fd.Sheet(1e9, 0.3, 0.01)
    masses = np.array([0.0, m])
    s = fd.Structure(nodes, np.array([[0, 1]]), np.array([1e-4]), sheet, node_mass=masses)
    case = fd.Case(s, [fd.Fix([0], "xyz")], [fd.Gravity((0, 0, -gravity))])
    stretched = nodes * [0, 0, 1.0 / length]  # by 1 m

    def unbalanced(d):
        return s.internal_force(d * stretched)[1, 2] + m * gravity

    stretch = brentq(unbalanced, 0, 1e-4, xtol=1e-18)
    found = modes(case, 2, state=fd.State(stretch * stretched))
    expected = np.sqrt(gravity / (length + stretch)) / 2 / np.pi
    np.testing.assert_allclose(found.frequency, expected, rtol=1e-9)
    np.testing.assert_allclose(found.rigid_share, 1.0, atol=1e-9)
    assert not found.rigid.any()


def test_bends_that_a_load_has_hardly_turned():
    """Their moment k |d|^(4/3) carries a load F: d grows by its 3/4th power, f by its eighth root.

    At 1e-6 rad the rounding that statics allows in the forces is 1e-5 of d.
    """
    pattern = fd.Pattern([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2, 3)])
    s = fd.discretize(pattern, fd.Sheet(1e6, 0.3, 0.03, 1e3), preset="merlin2")
    found = []
    for turn in (1.6e-6, 3.2e-6):
        force = fd.Force([1], (0, 0, 6.3 * turn ** (4 / 3)))
        case = fd.Case(s, [fd.Fix([0, 2, 3])], [force])
        found.append(float(fd.modes(case, 1, state="equilibrium").frequency[0]))
    assert found[1] / found[0] == pytest.approx(2 ** (1 / 6), rel=2e-7)
