"""Patterns side by side."""

from __future__ import annotations

import numpy as np
import pytest
from mpl_toolkits.mplot3d.proj3d import proj_transform

import foldyn as fd
from foldyn.errors import InputError

STATES = [fd.patterns.miura((2, 2), dihedral=angle) for angle in (180, 100, 40)]


def seen(figure, axes, points):
    """Where points are in the picture, in inches."""
    figure.canvas.draw()
    x, y, _ = proj_transform(*points.T, axes.get_proj())
    return axes.transData.transform(np.column_stack([x, y])) / figure.dpi


def test_each_has_its_place_and_view():
    figure = fd.plots.draw_patterns(STATES, ["a", "b", "c"], views=[None, (50, -30)], width=9.0)
    assert len(figure.axes) == 3
    looks = [(axes.elev, axes.azim) for axes in figure.axes]
    assert looks == [(90, -90), (50, -30), (28, -60)]  # the flat one from above
    assert {"a", "b", "c"} <= {text.get_text() for text in figure.texts}
    legend = {text.get_text() for text in figure.legends[0].get_texts()}
    assert legend == {"boundary", "mountain crease", "valley crease"}
    for k, (axes, pattern) in enumerate(zip(figure.axes, STATES, strict=True)):
        x, y = seen(figure, axes, pattern.vertices).T
        assert 3.0 * k < x.min() < x.max() < 3.0 * (k + 1)
        assert 0.0 < y.min() < y.max() < figure.get_figheight()
        # as large as the place allows: up to its margins, or the tallest
        assert max(np.ptp(x) / 2.7, np.ptp(y) / 2.6) == pytest.approx(1.0, abs=0.03)


def test_lengths_are_to_scale():
    figure = fd.plots.draw_patterns(STATES[:1])
    x = seen(figure, figure.axes[0], STATES[0].vertices)
    shown = np.linalg.norm(np.diff(x[STATES[0].creases], axis=1)[:, 0], axis=1)
    true = np.linalg.norm(np.diff(STATES[0].vertices[STATES[0].creases], axis=1)[:, 0], axis=1)
    np.testing.assert_allclose(shown / true, shown[0] / true[0], rtol=1e-3)


def test_no_pattern_is_refused():
    with pytest.raises(InputError, match="patterns is empty: give at least one pattern"):
        fd.plots.draw_patterns([])
