"""The figure of a comparison with the shell shows its numbers."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError
from foldyn.plots.style import BLACK
from foldyn.results import fidelity_dataset


def made(frequency, error, limit):
    """A comparison of two models with made-up numbers."""
    sheet = fd.Sheet(1e6, 0.25, 0.01, density=1.0)
    case = fd.Case(fd.discretize(fd.patterns.simple_fold(), sheet, preset="plate"))
    values = {"frequency": frequency, "error": error, "mac": np.where(np.isinf(error), 0.2, 0.9)}
    return fd.Fidelity(
        fidelity_dataset(case, ["own", "plate"], values, {"limit": limit, "reference": "shell"})
    )


def points(axes, marker):
    """Points of a marker."""
    lines = [line for line in axes.lines if line.get_marker() == marker]
    return np.concatenate([np.column_stack(line.get_data()) for line in lines])


def test_errors_and_likeness():
    frequency = np.array([1.0, 2.0, 4.0])
    error = np.array([[0.3, 0.01], [np.inf, -0.02], [1.8, -0.5]])
    figure = fd.plots.plot_fidelity(made(frequency, error, 3.0))
    upper, lower = figure.axes
    np.testing.assert_allclose(points(upper, "s"), [[1, 1], [2, -2], [4, -50]])
    np.testing.assert_allclose(points(upper, "o"), [[1, 30]])  # one lost, one beyond
    np.testing.assert_allclose(points(upper, "$\\uparrow$")[:1], [[4, 107]])
    np.testing.assert_allclose(points(lower, "o")[:, 1], [0.9, 0.2, 0.9])
    assert upper.get_ylim()[1] > 107 and upper.get_ylim()[0] < -50
    (text,) = [t.get_text() for t in figure.legends[0].get_texts() if "plate freq" in t.get_text()]
    assert text == "0.6 of the plate frequency, 3.000 Hz"
    assert [line.get_xdata()[0] for line in upper.lines if line.get_color() == BLACK] == [3.0]
    assert upper.get_xscale() == "linear"


@pytest.mark.parametrize(("limit", "shown"), [(100.0, False), (5.0, True)])
def test_a_limit_far_above_is_not_shown(limit, shown):
    figure = fd.plots.plot_fidelity(made(np.array([1.0, 4.0]), np.zeros((2, 2)), limit))
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert any("plate frequency" in text for text in texts) == shown
    assert figure.axes[0].get_xlim()[1] < 6.0


@pytest.mark.matrix
def test_wide_ranges_are_logarithmic():
    figure = fd.plots.plot_fidelity(made(np.array([1.0, 40.0]), np.zeros((2, 2)), 20.0))
    assert figure.axes[0].get_xscale() == "log"
    assert figure.axes[0].get_ylim() == pytest.approx((-11.5, 11.5))


def test_only_comparisons_are_drawn():
    with pytest.raises(InputError, match=r"give what foldyn.fidelity returns"):
        fd.plots.plot_fidelity({})  # type: ignore[arg-type]
