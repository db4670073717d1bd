"""Figures of designs: colors of creases and panels, and the course of a search."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import foldyn as fd
from foldyn.plots.design_charts import convergence_charts, slope_chart

PATTERN = fd.patterns.miura(cells=(1, 1), panel_angle=60, dihedral=120)


@pytest.fixture
def history():
    count = 7
    data = {
        "search": ("evaluation", np.array([0, 0, 0, 0, 1, 1, 1])),
        "objective": ("evaluation", np.linspace(3.0, 1.0, count), {"long_name": "mass"}),
        "violation": ("evaluation", np.array([1.0, 0.1, np.nan, 0.0, 1e-2, 1e-3, 0.0])),
        "best": ((), 3),
    }
    coordinates = {"evaluation": np.arange(count), "constraint": ["mass <= 1"]}
    return xr.Dataset(data, coordinates, {"slack": 1e-4})


def colored(figure):
    """Colors of lines that are as wide as colored creases."""
    return [
        tuple(collection.get_colors()[0])
        for collection in figure.axes[0].collections
        if hasattr(collection, "get_colors") and 3.5 in collection.get_linewidths()
    ]


def test_creases_and_panels_have_the_colors_of_their_values():
    values = np.linspace(-1.0, 1.0, len(PATTERN.creases))
    figure = fd.plots.draw_sensitivity(PATTERN, values, label="label")
    assert figure.axes[1].get_xlabel() == "label"
    assert len({color[:3] for color in colored(figure)}) == len(values)
    sheet = fd.discretize(PATTERN, fd.Sheet(1e6, 0.25, 0.01), preset="plate")
    panels = fd.plots.draw_sensitivity(sheet, [0, 1, 2, 3], on="panel")
    figures = fd.plots.draw_structure(sheet), panels
    plain, painted = (
        sum(len(c.get_facecolor()) for c in figure.axes[0].collections if hasattr(c, "set_verts"))
        for figure in figures
    )
    assert painted == plain + len(sheet.triangles)
    assert not colored(panels)
    with pytest.raises(fd.errors.InputError, match="did you mean 'panel'"):
        fd.plots.draw_sensitivity(sheet, [0, 1, 2, 3], on="panels")


@pytest.mark.parametrize("values", [[1.0], [], [[1.0, 2.0]], np.ones(50)])
def test_another_number_of_values_is_refused(values):
    with pytest.raises(fd.errors.InputError, match="give one value for each of the"):
        fd.plots.draw_sensitivity(PATTERN, values)


def test_nothing_but_zeros_can_be_drawn():
    assert fd.plots.draw_sensitivity(PATTERN, np.zeros(len(PATTERN.creases)))


def test_each_search_has_its_curve_and_the_best_is_marked(history):
    objective, violation = convergence_charts(history)
    assert [curve.name for curve in objective.curves] == ["search 1", "search 2", "best"]
    assert objective.ylabel == "mass"
    assert (objective.curves[2].x, objective.curves[2].y) == ([4], [2.0])
    np.testing.assert_allclose(violation.curves[0].y, [0.0, -1.0, np.nan, -5.0])
    assert len(fd.plots.plot_convergence(history).axes) == 2
    free = history.drop_dims("constraint")
    assert len(convergence_charts(free)) == 1


def test_slopes_of_arrays_are_their_norms():
    chart = slope_chart({"a": -2.0, "b": np.array([3.0, 4.0])}, "mass")
    assert chart.words == ["a", "b"]
    np.testing.assert_allclose(chart.curves[0].y, [-2.0, 5.0])
