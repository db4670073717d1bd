"""Gravity: weight, free fall, reactions, and what it may stand beside."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError
from foldyn.structures import MASS_RULES

G = np.array([0.0, 0.0, -9.81])
MASSLESS = r"loads\[0\]: gravity needs the mass of the structure: .*density is missing"


def structure(mass: str = "mixed_voronoi", density: float | None = 1000.0) -> fd.Structure:
    pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.3, panel_angle=60, dihedral=60)
    return fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.01, density), mass=mass, preset="plate")


@pytest.mark.parametrize("mass", MASS_RULES)
def test_the_weight_is_that_of_the_sheet(mass) -> None:
    case = fd.Case(structure(mass), loads=[fd.Gravity(G)])
    ((forces, history),) = case.load_terms
    assert history == fd.Constant()
    kilograms = 4 * 1.0 * 1.3 * np.sin(np.radians(60)) * 0.01 * 1000.0  # four panels
    np.testing.assert_allclose(forces.sum(axis=0), kilograms * G, rtol=1e-13, atol=0)
    assert (forces[:, :2] == 0.0).all()
    assert (forces[:, 2] < 0.0).all()


def test_standard_gravity_by_its_direction() -> None:
    """9.80665 m/s2 (3rd General Conference on Weights and Measures, 1901)."""
    assert fd.Gravity("-z") == fd.Gravity((0.0, 0.0, -9.80665))
    assert fd.Gravity("x").acceleration == (9.80665, 0.0, 0.0)


@pytest.mark.parametrize("mass", ["mixed_voronoi", "consistent"])
def test_a_free_structure_falls_with_g(mass) -> None:
    g = np.array([1.0, -2.0, -9.81])
    motion = fd.simulate(
        fd.Case(structure(mass), loads=[fd.Gravity(g)]), 0.1, method="rk4", interval=0.01
    )
    t = motion.time.to_numpy()[:, None, None]
    assert t[-1] == pytest.approx(0.1)
    for name, expected in (("displacement", 0.5 * g * t**2), ("velocity", g * t)):
        found = motion[name].to_numpy() - expected
        np.testing.assert_allclose(found, 0.0, rtol=0, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("mass", ["mixed_voronoi", "consistent"])
@pytest.mark.parametrize("held", [range(13), [0, 2, 6, 8]], ids=["all", "some"])
def test_supports_carry_what_does_not_fall(mass, held) -> None:
    sheet = structure(mass)
    case = fd.Case(sheet, [fd.Fix(held, "z")], [fd.Gravity(G)])
    reaction = (
        fd.simulate(case, 0.001, method="rk4", every_steps=1).isel(time=0).reaction.to_numpy()
    )
    # at rest and unstrained: M a = p + r, with a = 0 on the supports and r = 0 elsewhere
    dense = sheet.mass.toarray()
    free = np.setdiff1d(np.arange(len(dense)), held)
    weight = dense.sum(axis=1) * G[2]
    fall = np.linalg.solve(dense[np.ix_(free, free)], weight[free])
    expected = dense[np.ix_(held, free)] @ fall - weight[held]
    np.testing.assert_allclose(reaction, expected, rtol=1e-12)


def test_gravity_beside_forces() -> None:
    sheet, pulse, way = structure(), fd.Pulse(1.0), np.array([1.0, 2.0, 0.0])
    loads = [
        fd.Gravity(G), fd.Force([7], (1, 0, 0)), fd.Force([6], (0, 1, 0), pulse),
        fd.Gravity((1, 0, 0), pulse), fd.Gravity((0, 2, 0), pulse),
    ]  # fmt: skip
    case, mass = fd.Case(sheet, loads=loads), sheet.mass.sum(axis=1)
    (steady, constant), (short, law) = case.load_terms
    assert (constant, law) == (fd.Constant(), pulse)
    np.testing.assert_allclose(steady[:, 2], mass * G[2], rtol=1e-15)
    np.testing.assert_array_equal(np.flatnonzero(steady[:, 0]), [7])
    np.testing.assert_allclose(short[0], mass[0] * way, rtol=1e-15)
    np.testing.assert_allclose(short[6], mass[6] * way + [0, 1, 0])
    np.testing.assert_array_equal(case.loaded_nodes, [6, 7])
    assert [np.flatnonzero(f.any(axis=1)).tolist() for f, _ in case.force_terms] == [[7], [6]]
    np.testing.assert_array_equal([g for g, _ in case.gravity_terms], [G, way])
    with pytest.raises(ValueError, match="read-only"):
        steady[0, 0] = 1.0


def test_gravity_on_supports_is_silent() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        case = fd.Case(structure(), [fd.Fix("xmin")], [fd.Gravity(G)])
    assert case.loaded_nodes.size == 0
    assert case.load_terms[0][0][0, 2] < 0.0  # kept: the reactions need it


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: fd.Gravity("down"), r'acceleration = "down": .*choose one of x, y, z, -x'),
        (lambda: fd.Gravity((0, 0, 0)), r"acceleration = \[0, 0, 0\]: must not be zero"),
        (lambda: fd.Gravity((0, 0, np.nan)), r"acceleration\[2\] = nan: must be a finite"),
        (lambda: fd.Gravity(G, "pulse"), 'history = "pulse": must be a history'),
        (lambda: fd.Case(structure(density=None), loads=[fd.Gravity(G)]), MASSLESS),
        (lambda: fd.Case(structure(), loads=[fd.Fix(0)]), "must be a Force or Gravity"),
        (lambda: fd.Case(structure(), loads=fd.Gravity(G)), "must be a list of Force or Gravity"),
    ],
)
def test_wrong_input(make, text) -> None:
    with pytest.raises(InputError, match=text):
        make()
