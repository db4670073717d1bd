"""Point masses: closed forms, gravity, free fall, sheets without a mass of their own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from attached_cases import FOLD, MODELS, SHEET, everywhere, structure

import foldyn as fd
from foldyn.errors import InputError

pytestmark = pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
HEAVY = fd.Sheet(1e6, 0.3, 0.01, density=100.0)


@pytest.fixture(params=MODELS)
def model(request):
    return request.param


@pytest.mark.parametrize("rule", ["consistent", "default"])
def test_mass_center_and_inertia_are_sums(model, rule):
    s = structure(model, FOLD, HEAVY, **({} if rule == "default" else {"mass": rule}))
    case = fd.Case(s, masses=[fd.PointMass([0, 4], 0.3), fd.PointMass([4], 0.2)])
    assert case.point_masses[[0, 1, 4]] == pytest.approx([0.3, 0.0, 0.5])
    assert case.total_mass == pytest.approx(s.total_mass + 0.8)
    x = s.nodes
    center = (s.total_mass * s.center_of_mass + 0.3 * x[0] + 0.5 * x[4]) / case.total_mass
    assert case.center_of_mass == pytest.approx(center)

    def of_point(m, arm):
        return m * (arm @ arm * np.eye(3) - np.outer(arm, arm))

    shift = of_point(s.total_mass, s.center_of_mass - center)
    wanted = s.inertia + shift + of_point(0.3, x[0] - center) + of_point(0.5, x[4] - center)
    assert case.inertia == pytest.approx(wanted, abs=1e-12)
    assert case.nodal_mass.sum() == pytest.approx(case.total_mass)
    assert (case.mass != s.mass).nnz == 2


def test_a_case_without_them_has_the_matrix_of_its_structure(model):
    s = structure(model, FOLD, HEAVY)
    assert fd.Case(s).mass is s.mass
    assert fd.Case(s).nodal_mass is s.nodal_mass


def test_gravity_weighs_them_in_statics_and_motion(model):
    s = structure(model, FOLD, HEAVY)
    masses = [fd.PointMass([2, 5], 0.4)]
    held = fd.Case(s, [fd.Fix([0, 1, 4])], [fd.Gravity("-z")], masses=masses)
    weight = 9.80665 * (s.total_mass + 0.8)
    assert held.load_terms[0][0].sum(axis=0) == pytest.approx([0, 0, -weight])
    light = replace(held, loads=[fd.Gravity((0, 0, -1e-4))])
    path = fd.trace(light)
    lifted = path.reaction.values[-1].reshape(-1, 3)[:, 2].sum()
    assert lifted == pytest.approx(1e-4 * (s.total_mass + 0.8), rel=1e-6)
    falling = fd.Case(s, (), [fd.Gravity("-z")], masses=masses)
    motion = fd.simulate(falling, 0.2, "generalized_alpha", every=0.1)
    drop = motion.displacement.values[-1]
    assert drop == pytest.approx(np.tile([0, 0, -0.5 * 9.80665 * 0.2**2], (len(drop), 1)), rel=1e-6)


def test_a_heavy_tip_on_a_light_cantilever(model):
    """f = sqrt(k / (M + 33/140 m)) / 2 pi, k = 3 D b / L^3: Blevins 1979, table 8-8.

    Bars and hinges against their own stiffness k, for what a mass adds.
    """
    sheet, length, width, tip = fd.Sheet(1e6, 0.0, 0.01, density=100.0), 1.0, 0.1, 0.5
    x = np.linspace(0.0, length, 5)
    vertices = [[value, side, 0.0] for value in x for side in (0.0, width)]
    faces = [[2 * k, 2 * k + 2, 2 * k + 3, 2 * k + 1] for k in range(4)]
    options = {"divisions": 2} if model == "shell" else {"scheme": "n4b5"}
    stiff = 1e3 if model == "shell" else sheet.bending_modulus * 4
    s = structure(
        model,
        fd.Pattern(vertices, faces),
        sheet,
        clamped=[(0, 1)],
        crease_stiffness=stiff,
        **options,
    )
    load = [fd.Force([8, 9], (0, 0, 0.5e-6))]
    case = fd.Case(s, [fd.Fix([0, 1])], load, masses=[fd.PointMass([8, 9], 0.5 * tip)])
    deflection = fd.trace(case).displacement.values[-1][[8, 9], 2].mean()
    k = 1e-6 / deflection
    if model == "shell":
        assert k == pytest.approx(3 * sheet.bending_modulus * width / length**3, rel=0.02)
    m = s.total_mass
    exact = np.sqrt(k / (tip + 33.0 / 140.0 * m)) / (2 * np.pi)
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
    s = structure(model, FOLD, HEAVY)
    masses = [fd.PointMass([4, 5], 0.5)]
    force = [fd.Force([4, 5], (0, 0, 0.5e-2))]
    free = fd.Case(s, (), force, masses=masses)
    path = fd.trace(free, inertia_relief=True)
    u = path.displacement.values[-1]
    assert np.abs(path.reaction.values).max(initial=0.0) < 1e-12
    assert np.isfinite(u).all()
    assert np.ptp(u[:, 2]) > 1e-6


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
    response = fd.frf(case, [fd.BaseMotion("z")], f, method="direct")
    assert response.transmissibility.sel(axis="z").values[:, 2] == pytest.approx(exact, rel=1e-3)


def test_they_survive_storage(model, tmp_path):
    s = structure(model, FOLD, HEAVY)
    case = fd.Case(s, [fd.Fix([0, 1, 4])], masses=[fd.PointMass("xmax", 0.3)])
    fd.save(fd.modes(case, 1), tmp_path / "modes.nc")
    again = fd.case_of(fd.load(tmp_path / "modes.nc"))
    assert again.masses == case.masses
    assert np.array_equal(again.nodal_mass, case.nodal_mass)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"mass": 0.0}, "mass = 0.0: must be greater than 0 kg"),
        ({"mass": "heavy"}, 'mass = "heavy": must be a number'),
        ({"nodes": "  "}, "nodes = .*selects nothing"),
        ({"nodes": [0, 0]}, "node 0 is listed twice"),
    ],
)
def test_bad_masses(given, message):
    with pytest.raises(InputError, match=message):
        fd.PointMass(**{"nodes": [0], "mass": 1.0, **given})


def test_masses_of_a_case_are_checked():
    s = structure("bars and hinges", sheet=SHEET)
    with pytest.raises(InputError, match=r"masses\[0\]\.nodes = \[99\]: node 99 is out of range"):
        fd.Case(s, masses=[fd.PointMass([99], 1.0)])
    with pytest.raises(InputError, match=r"masses\[0\] = 1.0: must be a PointMass"):
        fd.Case(s, masses=[1.0])
