"""Creases in series with panels: two springs, solved by themselves."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import foldyn as fd
from foldyn import checks
from foldyn.materials.prony import in_series
from foldyn.structures import ModelOptions

OWN = fd.CustomHingeLaw(
    lambda t, r: 0.5 * (t - r) ** 2 + (t - r) ** 4, lambda t, r: (t - r) + 4.0 * (t - r) ** 3,
    lambda t, r: 1.0 + 12.0 * (t - r) ** 2, name="own",
)  # fmt: skip
SOFTNESS = 2.0  # rad/(N m)


def fold(law, rest, crease):
    """A fold along y whose crease has this stiffness, and displacements at a dihedral."""
    nodes = np.array([[0, 0, 0], [0, 1, 0], [-1, 0.5, 0], [1, 0.5, 0]], float)
    structure = fd.Structure(
        nodes=nodes,
        bars=np.array([[0, 1]]),
        bar_area=np.array([1e-4]),
        sheet=fd.Sheet(1e3, 0.3, 0.01),
        options=ModelOptions(fold_law=law),
        folds=np.array([[0, 1, 2, 3]]),
        fold_stiffness=np.array([crease / (1.0 + crease * SOFTNESS)]),
        fold_rest=np.array([math.radians(rest)]),
        panel_softness=np.array([SOFTNESS]),
    )

    def at(theta):
        u = np.zeros((4, 3))
        u[3] = [math.cos(theta - math.pi) - 1.0, 0.0, math.sin(math.pi - theta)]
        return u

    return structure, at


@pytest.mark.parametrize(
    "law", ["linear", "superlinear", OWN], ids=["linear", "superlinear", "own"]
)
@pytest.mark.parametrize("rest", [60.0, 120.0])
@pytest.mark.parametrize("stiff", [0.1, 5.0])
def test_a_fold_is_its_crease_and_its_panels_in_series(law, rest, stiff):
    structure, at = fold(law, rest, stiff)
    own, start = structure.fold_law, math.radians(rest)
    for turned in (20.0, 50.0, 100.0, 200.0, 300.0, 340.0):
        theta = math.radians(turned)

        def beyond(phi, theta=theta):
            return stiff * float(own.moment(phi, start)) - (theta - phi) / SOFTNESS

        phi = brentq(beyond, -50.0, 50.0, xtol=1e-15, rtol=1e-15)
        energy = stiff * float(own.energy(phi, start)) + 0.5 * (theta - phi) ** 2 / SOFTNESS
        u = at(theta)
        assert structure.energies(u)["strain_folds"] == pytest.approx(energy, rel=1e-9, abs=1e-12)
        assert checks.gradient_error(structure.energy, structure.internal_force, at=u) < 1e-6
        assert checks.tangent_error(structure.internal_force, structure.tangent, at=u) < 1e-5


def test_a_law_that_locks_does_so_where_panels_meet():
    """Between its limits the fold is in series; beyond, its law is that of the hinge."""
    law, start = fd.EnhancedLinear(theta1=75, theta2=285), math.radians(120.0)
    structure, at = fold(law, 120.0, 5.0)
    for theta in np.radians([20.0, 100.0, 340.0]):
        energy = structure.fold_stiffness[0] * float(law.energy(theta, start))
        assert structure.energies(at(theta))["strain_folds"] == pytest.approx(energy, rel=1e-9)


@pytest.mark.parametrize("time", [0.0, 0.3])
def test_branches_in_series_have_the_complex_stiffness_of_both(time):
    ratio, rate = np.array([[0.5, 2.0], [1.0, 0.1]]), np.array([[3.0, 50.0], [0.2, 7.0]])
    share = np.array([0.7, 0.04])
    g, r = in_series(share, ratio, rate, np.full(2, time))
    assert (g >= 0.0).all() and (r > 0.0).all()
    for omega in (0.01, 1.0, 30.0, 1e4):
        s = 1j * omega
        crease = 1.0 + (ratio * s / (s + rate)).sum(axis=1) + time * s
        panels = share / (1.0 - share)
        both = 1.0 / (1.0 / crease + 1.0 / panels)  # per unit stiffness of the crease
        found = share * (1.0 + (g * s / (s + r)).sum(axis=1))
        assert found == pytest.approx(both, rel=1e-12)


def test_creases_between_rigid_panels_keep_their_branches():
    ratio, rate = np.array([[0.5, 2.0]]), np.array([[3.0, 50.0]])
    g, r = in_series(np.ones(1), ratio, rate, np.zeros(1))
    assert np.array_equal(g[:, :2], ratio) and np.array_equal(r[:, :2], rate) and not g[:, 2].any()
