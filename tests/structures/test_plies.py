"""Laminates: classical lamination theory, and when plies fail."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad_vec

import foldyn as fd
from case_texts import SHELL_MODES
from foldyn.errors import InputError
from foldyn.linear import modes
from foldyn.strength.plies import CRITERIA, ply_factors
from foldyn.structures.ply import heights, stiffness

CARBON = {"youngs_modulus": (140e9, 10e9), "poissons_ratio": 0.3, "shear_modulus": 5e9}
STRENGTH = (1500e6, 1200e6, 50e6, 200e6, 70e6)
T, RHO = 1.25e-4, 1600.0


def plies(*angles, **others):
    return [fd.Ply(T, angle=own, density=RHO, **{**CARBON, **others}) for own in angles]


def symmetric(*angles, direction=(1.0, 0.0, 0.0), **others):
    half = plies(*angles, **others)
    return fd.Sheet(plies=[*half, *half[::-1]], direction=direction)


def strip(length, width):
    corners = [(0, 0, 0), (length, 0, 0), (length, width, 0), (0, width, 0)]
    return fd.Pattern(corners, [(0, 1, 2, 3)])


def test_stiffness_is_the_integral_over_the_thickness():
    layers = plies(20, -50, 75)
    bounds = heights(layers)
    for power in range(3):
        found = stiffness(layers, power + 1)
        exact = sum(
            quad_vec(lambda z, own=own, n=power: z**n * own.elastic, low, high)[0]
            for own, low, high in zip(layers, bounds[:-1], bounds[1:], strict=True)
        )
        np.testing.assert_allclose(found, exact, rtol=1e-9, atol=1e-9 * np.abs(exact).max())


def test_constants_of_a_laminate():
    """0, 45, -45 and 90 degrees: isotropic in the plane; a single ply is a sheet."""
    made = symmetric(0, 45, -45, 90)
    first, second = made.moduli
    assert first == pytest.approx(second, rel=1e-12)
    assert made.shear_modulus == pytest.approx(first / (2.0 + 2.0 * made.poissons_ratio), rel=1e-12)
    assert (made.thickness, made.density) == pytest.approx((8 * T, RHO), rel=1e-12)
    alone = symmetric(0)
    same = fd.Sheet(thickness=2 * T, density=RHO, direction=(1, 0, 0), **CARBON)
    np.testing.assert_allclose(alone.stretching, same.stretching, rtol=1e-12)
    np.testing.assert_allclose(alone.bending, same.bending, rtol=1e-12)
    assert alone.moduli == pytest.approx(same.moduli, rel=1e-12)
    assert fd.Sheet(plies=made.plies, direction=0.0, thickness=8 * T) == symmetric(
        0, 45, -45, 90, direction=0.0
    )


@pytest.mark.matrix
@pytest.mark.parametrize("kind", ["shell", "superelements"])
@pytest.mark.parametrize("angles", [(0, 90), (90, 0, 0)])
def test_a_cantilever_bends_and_vibrates_by_lamination_theory(kind, angles):
    """P L^3 / 3 EI and 1.8751^2 sqrt(EI / m L^4), with EI = b / (D^-1)_11."""
    length, width, push = 0.5, 0.025, 1e-3
    made = symmetric(*angles)
    bent = width / np.linalg.inv(made.bending)[0, 0]
    pattern = strip(length, width)
    structure = (
        fd.shell(pattern, made, divisions=16, clamped=[(0, 3)])
        if kind == "shell"
        else fd.superelements(pattern, made, clamped=[(0, 3)])
    )
    held = fd.Fix([0, 3], "xyz", along=True)
    path = fd.trace(fd.Case(structure, [held], [fd.Force([1, 2], (0, 0, 0.5 * push))]), steps=1)
    low = float(path.displacement[-1].sel(node=[1, 2], axis="z").mean())
    assert low == pytest.approx(push * length**3 / (3.0 * bent), rel=0.01)
    first = 1.8751**2 * np.sqrt(bent / (made.areal_density * width * length**4)) / (2.0 * np.pi)
    assert float(modes(fd.Case(structure, [held]), count=1).frequency[0]) == pytest.approx(
        first, rel=0.01
    )


@pytest.mark.parametrize("criterion", CRITERIA)
@pytest.mark.parametrize("angle", [0.0, 40.0])
def test_a_single_stress_fails_a_ply_at_its_strength(criterion, angle):
    """Along, across and in shear, whatever the direction of the fibers in the panel."""
    made = symmetric(0, strength=STRENGTH)
    t, turn = made.thickness, np.radians(angle)
    c, s = np.cos(turn), np.sin(turn)
    for stress, strength in (
        ((1, 0, 0), STRENGTH[0]), ((-1, 0, 0), STRENGTH[1]), ((0, 1, 0), STRENGTH[2]),
        ((0, -1, 0), STRENGTH[3]), ((0, 0, 1), STRENGTH[4]), ((0, 0, -1), STRENGTH[4]),
    ):  # fmt: skip
        xx, yy, xy = stress
        tensor = np.array([[c, -s], [s, c]]) @ [[xx, xy], [xy, yy]] @ np.array([[c, s], [-s, c]])
        along = np.array([[[tensor[0, 0], tensor[1, 1], tensor[0, 1]]]])
        found = ply_factors(made, t * along, 0.0 * along, np.array([turn]), criterion)
        assert found.item() == pytest.approx(strength, rel=1e-9)
        bent = ply_factors(made, 0.0 * along, t**2 / 6.0 * along, np.array([turn]), criterion)
        weaker = min(STRENGTH[:2] if xx else STRENGTH[2:4] if yy else STRENGTH[4:])
        assert bent.item() == pytest.approx(weaker, rel=1e-9)  # both faces have this stress


def test_stresses_times_the_factor_of_tsai_and_wu_fail():
    rng = np.random.default_rng(4)
    made = fd.Sheet(plies=plies(0, strength=STRENGTH), direction=0.0)
    stress = 1e6 * rng.standard_normal((20, 1, 3))
    factor = ply_factors(made, made.thickness * stress, 0.0 * stress, np.zeros(1), "tsai_wu")
    one, two, both = np.moveaxis(factor[..., None] * stress, -1, 0)[..., 0]
    xt, xc, yt, yc, shear = STRENGTH
    used = one**2 / (xt * xc) + two**2 / (yt * yc) + both**2 / shear**2
    used += one * (1 / xt - 1 / xc) + two * (1 / yt - 1 / yc)
    used -= one * two / np.sqrt(xt * xc * yt * yc)
    np.testing.assert_allclose(used, 1.0, rtol=1e-9)


@pytest.mark.parametrize("kind", ["shell", "superelements"])
def test_margins_of_a_pulled_laminate(kind):
    """Cross-ply: both layers stretch alike, and the one across its fibers fails first."""
    made = symmetric(0, 90, strength=STRENGTH)
    pattern = strip(0.1, 0.1)
    make = {"shell": lambda: fd.shell(pattern, made, divisions=4),
            "superelements": lambda: fd.superelements(pattern, made, divisions=4)}  # fmt: skip
    held = [fd.Fix("xmin", "x", along=True), fd.Fix([0], "yz"), fd.Fix([1, 2, 3], "z")]
    case = fd.Case(make[kind](), held, [fd.LineLoad("xmax", (1e3, 0.0, 0.0))])
    path = fd.trace(case, steps=1)
    strain = np.linalg.solve(made.stretching, [1e3, 0.0, 0.0])
    layer = np.array([1.0, 1.0, 0.0]) * strain[[1, 0, 2]]  # along and across fibers of 90 degrees
    across = (made.plies[1].fibers @ layer)[1]
    found = fd.margins(path, criterion="maximum_stress", factor_of_safety=1.5)
    least = STRENGTH[2] / across / 1.5 - 1.0
    center = fd.stresses(path)
    rough = 0.02 if kind == "shell" else 0.1  # forces concentrate about the rigid corners
    assert found.attrs["least_margin"] == pytest.approx(least, rel=rough)
    assert np.abs(center.membrane_force.values[-1, 0, 0] / 1e3 - 1.0) < rough
    assert fd.margins(path).attrs["least_margin"] != pytest.approx(least, rel=1e-6)


def test_plies_are_stored_and_read(tmp_path):
    text = f"""{SHELL_MODES}
        [sheet]
        direction = 0
        [[sheet.plies]]
        thickness = 1e-4
        youngs_modulus = [140e9, 10e9]
        poissons_ratio = 0.3
        shear_modulus = 5e9
        angle = 20
        density = 1600
        strength = [1500e6, 1200e6, 50e6, 200e6, 70e6]
        [[sheet.panels]]
        panels = [1]
        [[sheet.panels.plies]]
        thickness = 1e-3
        youngs_modulus = 3e9
        poissons_ratio = 0.3
        density = 1000
        """
    (tmp_path / "case.toml").write_text(text)
    made = fd.read_case(tmp_path / "case.toml")
    sheet = made.case().structure.sheet
    assert sheet.plies[0].angle == 20.0
    assert sheet.of(1).thickness == 1e-3
    assert fd.case_of(made.run()).structure.sheet == sheet
    assert sheet.has_strength


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: fd.Sheet(plies=plies(0, 90), direction=0.0),
            "sheet: plies: stretching bends them",
        ),
        (lambda: fd.Sheet(plies=plies(0)), "sheet: direction: missing; two moduli need it"),
        (lambda: fd.Sheet(thickness=1e-3), "sheet: youngs_modulus: missing; or give plies"),
        (
            lambda: fd.Sheet(plies=plies(0), direction=0.0, thickness=2e-4),
            "sheet: thickness = 0.0002: follows from the plies, 0.000125; leave it out",
        ),
        (
            lambda: fd.Sheet(plies=[*plies(0), fd.Ply(T, **CARBON), *plies(0)], direction=0.0),
            "sheet: plies: some have a density and some have none",
        ),
        (lambda: fd.Ply(T, (2e9, 1e9), 0.3), "shear_modulus: missing; two moduli need it"),
        (
            lambda: fd.Ply(T, 1e9, 0.3, strength=[1, 2]),
            r"strength = \[1, 2\]: must be five numbers",
        ),
        (lambda: fd.Ply(T, 1e9, 0.3, strength=[1, 2, 3, 4, -5]), "strength = .*above 0"),
    ],
)
def test_bad_laminates_get_one_message(make, message):
    with pytest.raises(InputError, match=message):
        make()
