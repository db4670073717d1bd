"""Waves of given frequencies, damped bands and gaps."""

from __future__ import annotations

import numpy as np
import pytest
from cells import chain, kresling, miura, squares

import foldyn as fd
from foldyn.errors import InputError
from foldyn.linear import attenuation, band_gaps, damped_bands


@pytest.mark.parametrize(
    ("cell", "phase", "direction"),
    [(kresling, [0.9], 0), (chain, [0.8], 0), (miura, [0.9, 0.4], 0), (squares, [0.4, 0.9], 1)],
)
def test_waves_of_a_band_are_found_at_its_frequency(cell, phase, direction):
    """Of a square panel a polynomial of a higher degree, as creases reach beyond the next cell."""
    b = fd.bands(cell(), [phase], count=3)
    other = sum(phase) - phase[direction]
    found = attenuation(cell(), b.frequency.values[0], along=direction, phase=other, count=40)
    off = np.nanmin(np.abs(found.phase.values - phase[direction]), axis=1)
    assert off.max() < 1e-9
    assert (found.attenuation.values == 0.0).all()


def test_chains_of_masses_and_springs_decay_as_their_formula_says():
    """2 k (1 - cos q) = m w^2 of a chain along x, above its band q = pi + i acosh(...)."""
    side, k, m = 0.02, 400.0, 0.01
    pattern = fd.Pattern([[0, 0], [side, 0], [side, side], [0, side]], [(0, 1, 2, 3)])
    light = fd.Sheet(1e3, 0.3, 1e-5, density=1e-6)
    structure = fd.discretize(pattern, light, preset="plate")
    supports = [fd.Fix(range(len(structure.nodes)), axes="yz"), fd.Fix([2, 3, 4], axes="x")]
    supports.append(fd.Spring(k, between=[(0, 1)], direction="x"))
    case = fd.Case(structure, supports, masses=[fd.PointMass([0, 1], m)])
    cell = fd.UnitCell(case, vectors=[(side, 0.0, 0.0)])
    top = np.sqrt(4.0 * k / m) / (2.0 * np.pi)
    found = attenuation(cell, [0.5 * top, 1.2 * top], count=1)
    exact = [np.arccos(1.0 - 0.5 * 4.0 * 0.25), np.pi + 1j * np.arccosh(2.0 * 1.44 - 1.0)]
    stiff = 1e3 * 1e-5 / k  # of the sheet beside the spring
    assert found.phase.values[:, 0] == pytest.approx(exact, rel=10.0 * stiff)
    assert found.attenuation.values == pytest.approx([0.0, exact[1].imag], rel=10.0 * stiff)


@pytest.mark.matrix
def test_attenuation_is_above_zero_in_gaps_alone():
    cell, phase = miura(), np.pi
    ky = np.full(81, phase)
    b = fd.bands(cell, np.column_stack([np.linspace(-np.pi, np.pi, 81), ky]), count=8)
    gaps = band_gaps(b).where(lambda g: g.below > 0, drop=True)
    assert gaps.sizes["gap"] >= 1
    inside = gaps["middle"].values
    edges = np.concatenate([0.99 * gaps["bottom"].values, 1.01 * gaps["top"].values])
    frequency = np.sort(b.frequency.values, axis=1)
    reached = [f for f in edges if ((frequency.min(0) < f) & (f < frequency.max(0))).any()]
    assert (attenuation(cell, inside, phase=phase).attenuation.values > 0.01).all()
    assert (attenuation(cell, reached, phase=phase).attenuation.values == 0.0).all()


def test_rayleigh_damping_has_its_closed_form():
    alpha, beta = 50.0, 1e-6
    case = fd.Case(miura().case.structure, damping=fd.Rayleigh(alpha, beta))
    phases = [[0.9, 0.4], [2.0, 1.0]]
    found = damped_bands(fd.UnitCell(case), phases, count=4)
    omega = np.sqrt(fd.bands(miura(), phases, count=4, track=False).eigenvalue.values)
    half = 0.5 * (alpha + beta * omega**2)
    assert found.rate.values == pytest.approx(-half + 1j * np.sqrt(omega**2 - half**2), rel=1e-8)
    assert found.damping_ratio.values == pytest.approx(half / omega, rel=1e-6)


def test_damped_creases_and_dashpots_damp_waves():
    case = fd.Case(
        miura().case.structure, [fd.Dashpot(0.1, nodes=[4])], damping=fd.CreaseDamping(1e-4)
    )
    cell = fd.UnitCell(case)
    assert (damped_bands(cell, [[0.9, 0.4]], count=4).damping_ratio.values > 1e-6).all()
    assert attenuation(cell, [600.0]).attenuation.values[0] > 0.0


@pytest.mark.matrix
def test_gaps_are_listed():
    cell = miura()
    b = fd.bands(cell, cell.path("G-X-M-G", 61), count=10)
    table = band_gaps(b)
    frequency = np.sort(b.frequency.values, axis=1)
    for row in table.to_dataframe().itertuples():
        assert row.top > row.bottom
        rows = slice(None) if row.direction == "all" else None
        if rows is not None:
            assert not ((frequency > row.bottom + 1e-9) & (frequency < row.top - 1e-9)).any()
    assert set(table.direction.values) <= {"all", "G-X", "X-M", "M-G"}
    assert (band_gaps(b, least=0.3).relative_width.values >= 0.3).all()
    held = fd.Case(cell.case.structure, [fd.Spring(1e4, nodes=[4])])
    grounded = band_gaps(fd.bands(fd.UnitCell(held), cell.grid(4), count=3))
    assert grounded.below.values[0] == 0
    assert float(grounded.bottom[0]) == 0.0
    with pytest.raises(InputError, match=r"bands: got dict; give what foldyn\.bands returns"):
        band_gaps({})


def test_damped_bands_are_as_many_as_there_are_motions():
    cell = fd.UnitCell(fd.Case(miura().case.structure, damping=fd.Rayleigh(alpha=50.0)))
    found = damped_bands(cell, [[0.9, 0.4]], count=24)
    every = fd.bands(cell, [[0.9, 0.4]], count=24).eigenvalue.values
    assert np.sort(np.abs(found.rate.values) ** 2) == pytest.approx(np.sort(every), rel=1e-6)
    with pytest.raises(InputError, match=r"count = 25: .* leave 24 motions at the phases"):
        damped_bands(cell, [[0.9, 0.4]], count=25)
    with pytest.raises(InputError, match="cell: got Case, give a UnitCell"):
        damped_bands(cell.case, [[0.9, 0.4]])


def test_attenuation_refuses_what_is_not_there():
    for given, match in (
        ({"frequencies": [0.0]}, "frequencies: give numbers above 0"),
        ({"frequencies": [1.0], "along": 1}, "along = 1: the cell has 1 period, 0"),
        ({"frequencies": [1.0], "phase": 1.0}, "phase = 1: the cell has no other period"),
    ):
        with pytest.raises(InputError, match=match):
            attenuation(kresling(), **given)
