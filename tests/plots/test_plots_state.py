"""Plots leave matplotlib's global state alone and are imported on demand."""

from __future__ import annotations

import inspect
import subprocess
import sys

import matplotlib
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import foldyn as fd
from foldyn import plots
from foldyn.errors import InputError


@pytest.mark.matrix
def test_matplotlib_is_imported_on_first_use():
    code = (
        "import sys, foldyn, foldyn.plots, foldyn.report\n"
        "assert 'matplotlib' not in sys.modules\n"
        "foldyn.plots.plot_history, foldyn.plots.animate, foldyn.plots.draw_structure\n"
        "assert 'matplotlib' in sys.modules and 'matplotlib.pyplot' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_every_public_name_is_there():
    assert set(plots.__all__) <= set(dir(plots))
    for name in set(plots.__all__) - {"ANIMATIONS", "FIGURES"}:
        assert callable(getattr(plots, name))
    with pytest.raises(AttributeError, match="no_such"):
        plots.no_such  # noqa: B018


def _figures(case, trajectory):
    yield plots.draw_structure(case)
    yield plots.plot_history({"run": trajectory}, [6])
    yield plots.plot_load_history(case, 1.0)
    yield plots.plot_laws(case.structure)
    yield plots.plot_energies(trajectory)
    shaken = fd.Case(case.structure, case.supports, damping=fd.Rayleigh(alpha=1.0))
    modes = fd.modes(shaken, count=2, secant=1.0)
    yield plots.draw_modes(shaken, modes)
    yield plots.plot_mac(fd.mac(modes, modes), ["a", "b"])
    drive = [fd.Force([7], (0.01, 0, 0))]
    response = fd.frf(shaken, drive, frequencies=np.linspace(0.1, 2.0, 60), secant=1.0)
    yield plots.plot_frf({"one": response}, [6, 7])
    yield plots.plot_nyquist(response, 7)


@pytest.mark.matrix
def test_global_settings_are_neither_changed_nor_followed(case, trajectory):
    before = dict(matplotlib.rcParams)
    usual = [_pixels(figure) for figure in _figures(case, trajectory)]
    assert dict(matplotlib.rcParams) == before
    odd = {"font.family": "monospace", "font.size": 20, "lines.linewidth": 9.0}
    odd |= {"lines.markersize": 1.0, "axes.grid": False, "figure.autolayout": True}
    colors = ("figure.facecolor", "axes.facecolor", "text.color", "grid.color", "axes.labelcolor")
    odd |= dict.fromkeys((*colors, "axes.edgecolor", "legend.labelcolor"), "red")
    with matplotlib.rc_context(odd):
        unusual = [_pixels(figure) for figure in _figures(case, trajectory)]
    assert [a == b for a, b in zip(usual, unusual, strict=True)] == [True] * 9


def _pixels(figure):
    assert isinstance(figure, Figure)
    assert isinstance(figure.canvas, FigureCanvasAgg)
    assert figure.dpi == 150
    figure.canvas.draw()
    return bytes(figure.canvas.buffer_rgba())


REST = {"path": "x.gif", "nodes": [0], "node": 0, "measure": "m", "duration": 1.0}
NEEDED = inspect.Parameter.empty


WRONG = [3, "x", {}, [], None, object()]


@pytest.mark.parametrize("wrong", WRONG, ids=lambda one: type(one).__name__)
def test_what_a_figure_cannot_show_is_refused(wrong, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    for name in plots.__all__:
        if name.startswith(("plot_", "draw_", "animate")):
            draw = getattr(plots, name)
            others = [*inspect.signature(draw).parameters.values()][1:]
            more = {one.name: REST.get(one.name, wrong) for one in others if one.default is NEEDED}
            with pytest.raises(InputError):
                draw(wrong, **more)


@pytest.mark.matrix
def test_a_result_stands_for_its_case(case, trajectory):
    for draw in (
        plots.draw_structure, plots.plot_laws, lambda given: plots.plot_load_history(given, 1.0),
    ):  # fmt: skip
        assert _pixels(draw(trajectory)) == _pixels(draw(case))
