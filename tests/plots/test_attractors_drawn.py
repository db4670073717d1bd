"""Figures of long motions: what they show is what the results hold."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import foldyn as fd
from foldyn.errors import InputError
from foldyn.plots import (
    plot_amplitudes,
    plot_basins,
    plot_bifurcation_diagram,
    plot_lyapunov_exponent,
    plot_poincare_section,
)


def result(kind: str, data: dict, coords: dict | None = None) -> xr.Dataset:
    return xr.Dataset(data, coords, {"foldyn_result": kind})


@pytest.fixture(scope="module")
def diagram():
    """A sweep up that falls between 2 and 3 Hz."""
    sides = ("jump", "side")
    return result(
        "bifurcation_diagram",
        {
            "amplitude": (("sweep", "frequency"), [[1.0, 2.0, 0.5]], {"units": "m"}),
            "section": (("sweep", "frequency", "record"), np.arange(12.0).reshape(1, 3, 4)),
            "jump_sweep": ("jump", ["up"]),
            "jump_between": (sides, [[2.2, 2.3]]),
            "jump_amplitude": (sides, [[2.1, 0.7]]),
        },
        {"sweep": ["up"], "frequency": [1.0, 2.0, 3.0]},
    )


def test_the_curve_goes_up_to_the_jump_and_is_broken_there(diagram):
    figure = plot_amplitudes(diagram, "Sweep")
    (line,) = (one for one in figure.axes[0].get_lines() if len(one.get_xdata()))
    np.testing.assert_array_equal(line.get_xdata(), [1.0, 2.0, 2.2, 2.2, 2.3, 3.0])
    np.testing.assert_array_equal(line.get_ydata(), [1.0, 2.0, 2.1, np.nan, 0.7, 0.5])
    texts = [text.get_text() for text in figure.axes[0].texts]
    assert "2.25" in texts
    assert figure.axes[0].get_ylabel() == "amplitude (m)"


def test_a_sweep_down_is_broken_at_its_jump(diagram):
    down = diagram.assign_coords(sweep=["down"]).assign(
        jump_sweep=("jump", ["down"]), jump_between=(("jump", "side"), [[1.6, 1.5]])
    )
    (line,) = (one for one in plot_amplitudes(down).axes[0].get_lines() if len(one.get_xdata()))
    np.testing.assert_array_equal(line.get_xdata(), [1.0, 1.5, 1.5, 1.6, 2.0, 3.0])
    np.testing.assert_array_equal(line.get_ydata(), [1.0, 0.7, np.nan, 2.1, 2.0, 0.5])


def test_a_bifurcation_diagram_has_a_dot_a_period(diagram):
    line = plot_bifurcation_diagram(diagram).axes[0].get_lines()[0]
    np.testing.assert_array_equal(line.get_xdata(), np.repeat([1.0, 2.0, 3.0], 4))
    np.testing.assert_array_equal(line.get_ydata(), np.arange(12.0))


def test_a_section_shows_velocity_over_displacement():
    place = ("time", "node", "axis")
    states = np.arange(12.0).reshape(2, 2, 3)
    section = result(
        "poincare_section",
        {"displacement": (place, states), "velocity": (place, 10.0 * states)},
        {"time": [0.0, 1.0], "node": [0, 1], "axis": ["x", "y", "z"]},
    )
    line = plot_poincare_section(section, 1, axis="y").axes[0].get_lines()[0]
    np.testing.assert_array_equal(line.get_xdata(), [4.0, 10.0])
    np.testing.assert_array_equal(line.get_ydata(), [40.0, 100.0])
    with pytest.raises(InputError, match="axis"):
        plot_poincare_section(section, 1, axis="w")


def test_basins_have_a_color_each():
    basins = result(
        "basins",
        {"basin": (("x", "v"), [[0, 1, -1], [1, 1, 0]]), "periods": ("attractor", [1, 3])},
        {"x": [0.0, 1.0], "v": [0.0, 1.0, 2.0]},
    )
    figure = plot_basins(basins)
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels == ["attractor 0", "attractor 1 (repeats after 3 periods)", "does not repeat"]
    mesh = figure.axes[0].collections[0]
    colors = mesh.to_rgba(mesh.get_array()).reshape(3, 2, -1)  # upward, across
    assert (colors[0, 0] == colors[2, 1]).all() and (colors[0, 1] == colors[1, 0]).all()
    assert len(np.unique(colors.reshape(6, -1), axis=0)) == 3
    assert plot_basins(basins, x="v").axes[0].get_xlabel() == "v"
    with pytest.raises(InputError, match="a grid of 1 parameters"):
        plot_basins(basins.isel(x=0))


def test_an_exponent_shows_how_it_converges():
    found = result(
        "lyapunov_exponent",
        {"estimate": ("time", [0.3, 0.2]), "exponent": ((), 0.2), "error": ((), 0.01)},
        {"time": [1.0, 2.0]},
    )
    axes = plot_lyapunov_exponent(found).axes[0]
    np.testing.assert_array_equal(axes.get_lines()[-1].get_ydata(), [0.3, 0.2])
    assert axes.get_title(loc="right") == "0.2 ± 0.01 1/s"


def test_other_results_are_refused(diagram):
    for draw in (plot_basins, plot_lyapunov_exponent):
        with pytest.raises(InputError, match=r"give a result of fd\."):
            draw(diagram)
    with pytest.raises(InputError, match="give a result"):
        plot_amplitudes(fd.Sheet(1.0, 0.3, 0.1))
