"""Cellular solids as materials: stiffness, sound, and any choice of the cell."""

import numpy as np
import pytest
from test_bands_of_solids import ABOUT_B, HEIGHT, MODELS, PERIODS, SIDE, honeycomb, layers

import foldyn as fd
from foldyn.errors import InputError
from foldyn.sweeps.measure import asked
from foldyn.sweeps.measures import MEASURES

SOLID = [*PERIODS.tolist(), [0.0, 0.0, HEIGHT]]
NUMBERS = ("xx", "yy", "zz", "yz", "xz", "xy")


@pytest.mark.matrix
@pytest.mark.parametrize("model", ["n5b8e", "superelements"])
def test_a_honeycomb_of_thin_walls(model):
    """Across the walls they bend, 4/sqrt(3) (t/l)^3 E; along them they stretch, 2/sqrt(3) t/l E.

    L. J. Gibson, M. F. Ashby, Cellular Solids, 2nd ed., 1997, sections 4.3 and 4.4.
    """
    slender = 0.01
    sheet = fd.Sheet(1e9, 0.0, thickness=slender * SIDE, density=1000.0)
    open_ = honeycomb(ABOUT_B)
    pattern = fd.Pattern(open_.vertices, open_.faces, welds=open_.creases[:1])
    stiff = {"crease_stiffness": 1e6}  # between cells
    make = fd.superelements if model == "superelements" else fd.discretize
    found = fd.effective(fd.UnitCell(fd.Case(make(pattern, sheet, **stiff)), SOLID))
    share, across = 2.0 / np.sqrt(3.0) * slender, 4.0 / np.sqrt(3.0) * slender**3 * 1e9
    np.testing.assert_allclose(found.density, 1000.0 * share, rtol=1e-12)
    np.testing.assert_allclose(found.modulus, [across, across, 1e9 * share], rtol=2e-3)
    np.testing.assert_allclose(found.poissons_ratio.sel(pair="xy"), 1.0, rtol=2e-3)
    rough = 5e-4 if model == "superelements" else 5e-3  # walls are 5000 times as soft across
    np.testing.assert_allclose(found.poissons_ratio.sel(pair="zx"), 0.0, atol=rough)
    np.testing.assert_allclose(found.shear_modulus.sel(plane="xy"), 0.25 * across, rtol=2e-3)


def of_layers(model, k=0):
    *patterns, steps = layers()
    return fd.UnitCell(fd.Case(MODELS[model](patterns[k])), steps)


@pytest.mark.matrix
@pytest.mark.parametrize("model", MODELS)
def test_long_waves_have_the_speeds_of_sound(model):
    """Of a wave along n the stiffness n . C . n (Christoffel) has the eigenvalues rho c^2."""
    cell = of_layers(model)
    if model == "superelements":  # with the shapes that `effective` takes
        cell = fd.UnitCell(fd.Case(cell.case.structure.for_stresses), cell.vectors)
    found, phase = fd.effective(cell), 1e-3 * np.array([0.6, -0.3, 0.8])
    voigt = np.array([[0, 5, 4], [5, 1, 3], [4, 3, 2]])
    stiffness = found.stiffness.values[voigt][:, :, voigt]
    wave = np.linalg.solve(cell.vectors, phase)  # rad/m
    square = np.einsum("j,ijkl,l->ik", wave, stiffness, wave) / found.density.item()
    bands = fd.bands(cell, [phase], count=3, check_model=False).frequency.values[0]
    omega = np.sqrt(np.linalg.eigvalsh(square))
    np.testing.assert_allclose(2.0 * np.pi * np.sort(bands), omega, rtol=2e-5)


def test_any_cell_of_a_solid():
    one, other = (fd.effective(of_layers("plate", k)) for k in (0, 1))
    size = np.abs(one.stiffness).max().item()
    np.testing.assert_allclose(other.stiffness, one.stiffness, atol=1e-9 * size)
    np.testing.assert_allclose(one.stiffness, one.stiffness.T, atol=1e-12 * size)
    assert np.linalg.eigvalsh(one.stiffness).min() > 0.0
    assert list(one["load"].values) == list(NUMBERS)
    eased = np.linalg.inv(one.stiffness.values)
    np.testing.assert_allclose(one.poissons_ratio.sel(pair="xz"), -eased[2, 0] / eased[0, 0])
    np.testing.assert_allclose(one.shear_modulus.sel(plane="xz"), 1.0 / eased[4, 4])


def test_the_numbers_of_a_solid_are_stored(tmp_path):
    cell = of_layers("plate")
    found = fd.effective(cell)
    fd.save(found, tmp_path / "solid.nc")
    again = fd.load(tmp_path / "solid.nc")
    np.testing.assert_array_equal(again.stiffness, found.stiffness)
    assert again.density.units == "kg/m3"
    for text, own in (
        ("poissons_ratio[xz]", found.poissons_ratio.sel(pair="xz")),
        ("shear_modulus[yz]", found.shear_modulus.sel(plane="yz")),
        ("coupling[xx,zz]", found.stiffness[0, 2]), ("modulus[z]", found.modulus[2]),
    ):  # fmt: skip
        assert asked(text, MEASURES).of(found, cell.case, {}) == own
    for text, reason in (("shear_modulus", "by plane"), ("poissons_ratio[x]", "choose one of xy")):
        with pytest.raises(InputError, match=reason):
            asked(text, MEASURES).of(found, cell.case, {})
