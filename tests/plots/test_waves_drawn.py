"""Figures of waves in chains: what they show is what was computed."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from foldyn import plots
from foldyn.errors import InputError
from foldyn.linear import wave_spectrum
from verification.waves.kresling import Unit

CELLS, TIMES = 9, 40


@pytest.fixture(scope="module")
def chain():
    """A cell, and a motion of a chain of them: a wave along it."""
    unit = Unit()
    nodes = unit.structure(CELLS - 1).nodes
    time = np.arange(TIMES) / TIMES
    ring = np.repeat(np.arange(CELLS), 6)
    moved = np.zeros((TIMES, len(nodes), 3))
    moved[..., 2] = 1e-3 * np.cos(2.0 * np.pi * (8.0 * time[:, None] - 2.0 * ring / CELLS))
    place = ("time", "node", "axis")
    motion = xr.Dataset(
        {"displacement": (place, moved), "velocity": (place, moved),
         "rest_position": (("node", "axis"), nodes)},
        {"time": time, "node": np.arange(len(nodes)), "axis": list("xyz")},
    )  # fmt: skip
    return unit.cell, motion


def test_colors_are_the_motion_of_the_cells(chain):
    cell, motion = chain
    figure = plots.plot_space_time(motion, cell, title="a wave")
    mesh = figure.axes[0].collections[0]
    values = np.asarray(mesh.get_array()).reshape(TIMES, CELLS)
    np.testing.assert_allclose(values, motion.displacement[:, ::6, 2], rtol=1e-12)
    assert mesh.get_clim() == pytest.approx((-1e-3, 1e-3))
    assert figure.axes[1].get_ylabel() == "z displacement (m)"
    strain = plots.plot_space_time(motion, cell, quantity="strain", limit=0.5)
    assert strain.axes[0].collections[0].get_clim() == (-0.5, 0.5)
    assert strain.axes[1].get_ylabel() == "strain"


def test_a_spectrum_is_drawn_with_bands_on_both_sides(chain):
    cell, motion = chain
    spectrum = wave_spectrum(motion, cell)
    phases = np.linspace(0.0, np.pi, 7)
    bands = xr.Dataset(
        {"frequency": (("phase", "band"), np.stack([phases, 2.0 * phases], axis=1))},
        {"wave_vector": (("phase", "period"), phases[:, None])},
    )
    figure = plots.plot_wave_spectrum(spectrum, bands, max_frequency=12.0)
    axes = figure.axes[0]
    assert len(axes.lines) == 4
    assert sorted(line.get_xdata().min() < -3.0 for line in axes.lines) == [False] * 2 + [True] * 2
    assert axes.get_ylim() == (0.0, 12.0)
    level = np.asarray(axes.collections[0].get_array())
    assert level.max() == 0.0
    assert level.min() >= -3.0


def test_transmissions_are_drawn_beside_the_attenuation():
    f = np.linspace(1.0, 5.0, 9)
    one = xr.Dataset({"decay": ("f", 0.1 * f), "ratio": ("f", np.exp(-f))}, {"frequency": ("f", f)})
    waves = np.stack([0.1j * f, np.pi + 0.2j * f, np.full(9, np.nan + 0j)], axis=1)
    bands = xr.Dataset({"phase": (("frequency", "wave"), waves)}, {"frequency": f})
    figure = plots.plot_transmission({"a": one, "b": one}, bands)
    upper, lower = figure.axes
    assert upper.get_yscale() == "log"
    drawn = [line.get_ydata() for line in lower.lines]
    np.testing.assert_allclose(drawn[0], 0.1 * f)
    np.testing.assert_allclose(drawn[3], 0.2 * f)
    assert np.isnan(drawn[4]).all()


def test_what_is_none_of_these_is_refused(chain):
    cell, motion = chain
    for call, words in (
        (lambda: plots.plot_space_time(motion, cell, quantity="stress"), "quantity"),
        (lambda: plots.plot_space_time(motion, cell, limit=0.0), "limit"),
        (lambda: plots.plot_wave_spectrum(motion), "wave_spectrum"),
        (lambda: plots.plot_wave_spectrum(wave_spectrum(motion, cell), motion), "one period"),
        (lambda: plots.plot_transmission(motion), "transmission"),
        (lambda: plots.plot_transmission({"a": motion}), "'a'"),
    ):
        with pytest.raises(InputError, match=words):
            call()
