"""The figure of an energy landscape: states on the curves, barriers, ranges of falling force."""

from __future__ import annotations

import numpy as np
import pytest

from foldyn.plots import barriers, plot_landscape, with_states
from foldyn.statics import Equilibrium, Landscape

WELLS = (-1.0, 0.0, 1.0)  # of W = (x^2 - 1)^2, whose barrier is 1 and whose force is 4 x^3 - 4 x


def double_well(stroke):
    """A landscape as a path with points at these strokes gives it."""
    stroke = np.asarray(stroke, float)
    states = tuple(
        Equilibrium(np.zeros((1, 3)), x, (x * x - 1.0) ** 2, x != 0.0)
        for x in WELLS
        if stroke[0] <= x <= stroke[-1]
    )
    force = 4.0 * stroke * (stroke**2 - 1.0)
    falls = ((-1.0 / np.sqrt(3.0), 1.0 / np.sqrt(3.0)),)
    return Landscape(stroke, force, (stroke**2 - 1.0) ** 2, states, falls)


POINTS = [-1.2, -0.7, 0.3, 1.1], [-1.0, -0.5, 0.0, 0.5, 1.0], [-1.0, -0.2, 0.5, 1.3], [0.5, 0.9]


@pytest.mark.parametrize("stroke", POINTS)
def test_states_stand_on_the_curves(stroke):
    """Each once, in its place, whether or not it is a point of the path."""
    found = double_well(stroke)
    x, force, energy = with_states(found)
    inside = [one for one in WELLS if stroke[0] <= one <= stroke[-1]]
    np.testing.assert_array_equal(x, sorted({*stroke, *inside}))
    np.testing.assert_allclose(force, 4.0 * x * (x**2 - 1.0), atol=1e-12)
    np.testing.assert_allclose(energy, (x**2 - 1.0) ** 2, atol=1e-12)


def test_a_picture_shows_states_and_falling_force():
    figure = plot_landscape(double_well([-1.2, -0.7, 0.3, 1.1]), "Two wells")
    upper, lower = figure.axes
    stable, unstable = upper.get_lines()[1:]
    assert stable.get_xydata().tolist() == [[-1.0, 0.0], [1.0, 0.0]]
    assert unstable.get_xydata().tolist() == [[0.0, 1.0]]
    assert stable.get_markerfacecolor() != "white" == unstable.get_markerfacecolor()
    (band,) = lower.patches
    assert band.get_x() == pytest.approx(-1.0 / np.sqrt(3.0))
    assert band.get_width() == pytest.approx(2.0 / np.sqrt(3.0))
    (legend,) = figure.legends
    words = [text.get_text() for text in legend.get_texts()]
    assert words == ["stable state", "unstable state", "negative stiffness"]
    assert upper.get_title(loc="right") == "barrier: 1 J there, 1 J back"


def test_one_well_has_no_barrier():
    found = double_well([0.5, 0.9, 1.5])
    assert barriers(found) == ""
    assert len(plot_landscape(found).axes[0].get_lines()) == 3
