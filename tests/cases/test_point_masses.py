"""Point masses: closed forms, gravity, free fall, sheets without a mass of their own."""

from __future__ import annotations

import numpy as np
import pytest
from attached_cases import FOLD, everywhere, structure

import foldyn as fd
from foldyn.errors import InputError

pytestmark = pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
HEAVY = fd.Sheet(1e6, 0.3, 0.01, density=100.0)


@pytest.mark.parametrize("rule", [{"mass": "consistent"}, {}])
def test_mass_center_and_inertia_are_sums(model, rule):
    s = structure(model, FOLD, HEAVY, **rule)
    assert fd.Case(s).mass is s.mass and fd.Case(s).nodal_mass is s.nodal_mass
    case = fd.Case(s, masses=[fd.PointMass([0, 4], 0.3), fd.PointMass([4], 0.2)])
    assert case.point_masses[[0, 1, 4]] == pytest.approx([0.3, 0.0, 0.5])
    assert case.total_mass == pytest.approx(s.total_mass + 0.8)
    x = s.nodes
    center = (s.total_mass * s.center_of_mass + 0.3 * x[0] + 0.5 * x[4]) / case.total_mass
    assert case.center_of_mass == pytest.approx(center)
    wanted = s.inertia.copy()
    for m, at in ((s.total_mass, s.center_of_mass), (0.3, x[0]), (0.5, x[4])):
        arm = at - center
        wanted += m * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    assert case.inertia == pytest.approx(wanted, abs=1e-12)
    assert case.nodal_mass.sum() == pytest.approx(case.total_mass)
    assert (case.mass != s.mass).nnz == 2


def test_gravity_weighs_them_in_statics_and_motion(model):
    s, masses = structure(model, FOLD, HEAVY), [fd.PointMass([2, 5], 0.4)]
    held = fd.Case(s, [fd.Fix([0, 1, 4])], [fd.Gravity((0, 0, -1e-4))], masses=masses)
    weight = 1e-4 * (s.total_mass + 0.8)
    assert held.load_terms[0][0].sum(axis=0) == pytest.approx([0, 0, -weight])
    lifted = fd.trace(held).reaction.values[-1].reshape(-1, 3)[:, 2].sum()
    assert lifted == pytest.approx(weight, rel=1e-6)
    falling = fd.Case(s, (), [fd.Gravity("-z")], masses=masses)
    drop = fd.simulate(falling, 0.2, method="generalized_alpha", interval=0.1).displacement.values[
        -1
    ]
    assert drop == pytest.approx(np.tile([0, 0, -0.5 * 9.80665 * 0.2**2], (len(drop), 1)), rel=1e-6)


def test_a_heavy_tip_on_a_light_cantilever(model):
    """f = sqrt(k / (M + 33/140 m)) / 2 pi, k = 3 D b / L^3: Blevins 1979, table 8-8.

    Bars and hinges against their own stiffness k, for what a mass adds.
    """
    sheet, width, tip = fd.Sheet(1e6, 0.0, 0.01, density=100.0), 0.1, 0.5
    vertices = [[x, y, 0.0] for x in np.linspace(0.0, 1.0, 5) for y in (0.0, width)]
    strip = fd.Pattern(vertices, [[k, k + 2, k + 3, k + 1] for k in (0, 2, 4, 6)])
    options = {"divisions": 2} if model == "shell" else {"scheme": "n4b5"}
    stiff = 1e3 if model == "shell" else sheet.bending_modulus * 4
    s = structure(model, strip, sheet, clamped=[(0, 1)], crease_stiffness=stiff, **options)
    load, mass = fd.Force([8, 9], (0, 0, 0.5e-6)), fd.PointMass([8, 9], 0.5 * tip)
    case = fd.Case(s, [fd.Fix([0, 1])], [load], masses=[mass])
    k = 1e-6 / fd.trace(case).displacement.values[-1][[8, 9], 2].mean()
    if model == "shell":
        assert k == pytest.approx(3 * sheet.bending_modulus * width, rel=0.02)
    exact = np.sqrt(k / (tip + 33.0 / 140.0 * s.total_mass)) / (2 * np.pi)
    assert float(fd.modes(case, 1).frequency[0]) == pytest.approx(exact, rel=5e-3)


def test_a_sheet_without_density_swings_with_point_masses_alone(model):
    s = structure(model, FOLD)
    with pytest.raises(InputError, match="density is missing"):
        _ = fd.Case(s).mass
    some = fd.Case(s, [fd.Fix([0, 1])], masses=[fd.PointMass([4], 1.0)])
    with pytest.raises(InputError, match="is free but has no mass"):
        fd.modes(some, 1)
    full = fd.Case(s, [fd.Spring(9.0, everywhere(s))], masses=[fd.PointMass(everywhere(s), 1.0)])
    assert float(fd.modes(full, 1).frequency[0]) == pytest.approx(3.0 / (2 * np.pi), rel=1e-8)
    assert fd.modes(full, 1).attrs["free_mass"] == pytest.approx(len(s.nodes))


def test_inertia_relief_balances_with_them(model):
    """A push at the common center of mass bends what it would not bend without the mass."""
    s, push = structure(model, FOLD, HEAVY), fd.Force([4, 5], (0, 0, 0.5e-2))
    free = fd.Case(s, (), [push], masses=[fd.PointMass([4, 5], 0.5)])
    path = fd.trace(free, inertia_relief=True)
    assert np.abs(path.reaction.values).max(initial=0.0) < 1e-12
    assert np.isfinite(path.displacement).all()
    assert np.ptp(path.displacement.values[-1, :, 2]) > 1e-6


def test_the_base_drives_them_in_a_frequency_response(model):
    k, m = 50.0, 2.0
    s = structure(model, FOLD, fd.Sheet(1e-3, 0.3, 0.01))
    others = [node for node in everywhere(s) if node not in (0, 1)]
    springs = fd.Spring(k, between=[(0, node) for node in others], direction="z")
    supports = [fd.Fix([0, 1]), fd.Fix(others, "xy"), springs]
    case = fd.Case(s, supports, (), fd.Rayleigh(0.5), [fd.PointMass(others, m)])
    f = np.array([0.3, 0.8, 2.0])
    w = 2 * np.pi * f
    exact = k / (k - w**2 * m + 0.5j * w * m)
    response = fd.frf(case, [fd.BaseMotion("z")], frequencies=f, method="direct")
    assert response.transmissibility.sel(axis="z").values[:, 2] == pytest.approx(exact, rel=1e-3)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: fd.PointMass([0], 0.0), "mass = 0.0: must be greater than 0 kg"),
        (lambda: fd.PointMass([0], "heavy"), 'mass = "heavy": must be a number'),
        (lambda: fd.PointMass("  ", 1.0), "nodes = .*selects nothing"),
        (lambda: fd.PointMass([0, 0], 1.0), "node 0 is listed twice"),
        (lambda: fd.PointMass([99], 1.0), r"masses\[0\]\.nodes = \[99\]: node 99 is out of range"),
        (lambda: 1.0, r"masses\[0\] = 1.0: must be a PointMass"),
    ],
)
def test_bad_masses(make, message):
    with pytest.raises(InputError, match=message):
        fd.Case(structure("bars and hinges"), masses=[make()])
