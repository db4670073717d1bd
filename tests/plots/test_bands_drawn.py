"""Figures of bands."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError
from foldyn.linear.band_structure import ALL


@pytest.fixture(scope="module")
def cell():
    sheet = fd.Sheet(1e9, 0.3, 1e-3, density=1000.0)
    structure = fd.discretize(fd.patterns.miura(a=0.03, b=0.03), sheet, preset="plate")
    return fd.UnitCell(fd.Case(structure, [fd.Spring(1e3, nodes=[4])]))


def test_bands_are_lines_over_a_path(cell):
    b = fd.bands(cell, cell.path("G-X-M", 9), count=4)
    axes = fd.plots.plot_bands(b).axes[0]
    lines = [line for line in axes.get_lines() if len(line.get_xdata()) == 9]
    assert len(lines) == 4
    for line, frequency in zip(lines, b.frequency.values.T, strict=True):
        assert np.array_equal(line.get_ydata(), frequency)
    assert [label.get_text() for label in axes.get_xticklabels()] == ["Γ", "X", "M"]
    assert axes.get_xticks() == pytest.approx(b.attrs["ticks"])
    full = int((fd.linear.band_gaps(b).direction == ALL).sum())
    assert full >= 1
    assert len(axes.patches) == full
    assert not fd.plots.plot_bands(b, gaps=False).axes[0].patches
    with pytest.raises(InputError, match="title: got int, give a str"):
        fd.plots.plot_bands(b, title=3)


def test_polarized_bands_are_colored(cell):
    b = fd.bands(cell, cell.path("G-X", 5), count=3, polarization=True)
    figure = fd.plots.plot_bands(b)
    pieces = figure.axes[0].collections[0]
    assert len(pieces.get_segments()) == 4 * 3
    share = b.polarization.values[..., 2]
    assert np.asarray(pieces.get_array()) == pytest.approx((0.5 * (share[1:] + share[:-1])).ravel())


def test_lines_of_one_frequency_fill_the_zone(cell):
    b = fd.bands(cell, cell.grid(6), count=2, track=False)
    axes = fd.plots.plot_iso_frequency(b, 2).axes[0]
    lines = axes.collections[0]
    inside = b.frequency.values[:, 1]
    levels = [v for v in lines.levels if inside.min() < v < inside.max()]
    assert levels
    assert axes.get_xlim() == pytest.approx((-np.pi, np.pi))


def test_figures_of_bands_refuse_other_phases(cell):
    grid = fd.bands(cell, cell.grid(3), count=1)
    path = fd.bands(cell, cell.path("G-X", 3), count=1)
    with pytest.raises(InputError, match="its phases lie on no path"):
        fd.plots.plot_bands(grid)
    with pytest.raises(InputError, match="need phases of cell"):
        fd.plots.plot_iso_frequency(path)
    with pytest.raises(InputError, match="band = 2: there are 1 bands"):
        fd.plots.plot_iso_frequency(grid, 2)
    with pytest.raises(InputError, match="bands: got list"):
        fd.plots.plot_bands([])
    with pytest.raises(InputError, match="title: got int, give a str"):
        fd.plots.plot_bands(path, title=3)
    with pytest.raises(InputError, match="gaps = 3: must be True or False"):
        fd.plots.plot_bands(path, gaps=3)
