"""Temperatures in pictures."""

from __future__ import annotations

import numpy as np
from pictures import keys

import foldyn as fd
from foldyn.plots import following

PATTERN = fd.patterns.miura(cells=(1, 1), panel_angle=60, dihedral=100)
LOADS = [
    fd.Temperature(20.0, 1e-4, panels=[0, 3], history=fd.Ramp(0.5)),
    fd.Temperature(-5.0, curvature=0.1),
]


def case() -> fd.Case:
    structure = fd.discretize(PATTERN, fd.Sheet(1e6, 0.25, 0.01, 1.0))
    return fd.Case(structure, [fd.Fix("xmin")], LOADS)


def test_warm_panels_have_stars_in_their_middles() -> None:
    figure = fd.plots.draw_structure(case())
    assert "20 K warmer on panels 0, 3" in keys(figure)
    assert any(text.startswith("5 K colder on panels 0, 1, 2") for text in keys(figure))
    share, _ = following.on_panels(case(), fd.Temperature)
    middles = following.panel_middles(case().structure, case().structure.nodes, share)
    expected = [PATTERN.vertices[list(PATTERN.faces[panel])].mean(axis=0) for panel in (0, 3)]
    np.testing.assert_allclose(middles, expected)
    (axes,) = figure.axes
    stars = [line.get_data_3d() for line in axes.lines if line.get_marker() == "*"]
    assert [len(x) for x, _, _ in stars] == [2, 4]


def test_temperatures_over_time() -> None:
    figure = fd.plots.plot_load_history(case(), 1.0)
    (axes,) = [axes for axes in figure.axes if axes.get_ylabel() == "temperature (K)"]
    ramp, constant = (line.get_ydata() for line in axes.lines[:2])
    assert ramp[-1] == 20.0
    assert ramp[len(ramp) // 4] == 20.0 * 0.25 / 0.5
    assert (np.asarray(constant) == -5.0).all()
