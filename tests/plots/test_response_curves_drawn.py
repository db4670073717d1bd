"""Response curves and backbones as they are drawn."""

import numpy as np
import pytest
import xarray as xr

from foldyn.errors import InputError
from foldyn.periodic.response import LARGEST
from foldyn.plots import plot_backbone, plot_response_curve
from foldyn.plots.response_curves import UNSTABLE

FREQUENCY = np.array([1.0, 2.0, 2.5, 2.2, 2.0, 3.0, 2.0, 2.1])
NAMES = ["", "", "fold", "", "fold", "", "", ""]


def curve(**attributes):
    along = {"frequency": ("point", FREQUENCY)}
    data = {
        "amplitude": ("point", np.arange(8.0), {"units": "m"}),
        "level": ("point", np.ones(8)),
        "stable": ("point", [True, True, True, False, False, True, True, True]),
        "bifurcation": ("point", NAMES),
        "branch": ("point", [0] * 6 + [1] * 2),
    }
    own = {"foldyn_result": "response_curve", "by": "frequencies", "measure": "displacement"}
    return xr.Dataset(data, along, own | attributes)


def spine(**data):
    """A node that moves along a diagonal, about 5."""
    size = np.array([0.1, 1.0, 2.0])
    swung = np.multiply.outer(size, [[[5.0, 5.0, 5.0]], [[0.6, 0.8, 0.0]]]).astype(complex)
    points = {
        "amplitude": ("point", size),
        "coefficient": (("point", "harmonic", "node", "axis"), swung),
        **data,
    }
    along = {"frequency": ("point", [1.0, 1.5, 2.0])}
    return xr.Dataset(points, along, {"foldyn_result": "backbone", "mode": 1})


def test_unstable_motions_are_dashed_from_fold_to_fold():
    axes = plot_response_curve(curve()).axes[0]
    lines = [line for line in axes.lines if line.get_marker() == "None"]
    parts = [line.get_xdata().tolist() for line in lines]
    assert parts == [[1.0, 2.0, 2.5], [2.5, 2.2, 2.0], [2.0, 3.0], [2.0, 2.1]]
    dashes = [line._unscaled_dash_pattern for line in lines]
    assert [dash == UNSTABLE for dash in dashes] == [False, True, False, False]
    (marks,) = (line for line in axes.lines if line.get_marker() == "o")
    assert marks.get_xdata().tolist() == [2.5, 2.0]
    assert axes.get_ylabel() == "amplitude of the displacement (m)"


def test_backbone_does_not_change_the_range():
    curves = dict.fromkeys(["one", "other"], curve(measure=LARGEST))
    alone = plot_response_curve(curves).axes[0]
    both = plot_response_curve(curves, spine()).axes[0]
    assert both.get_xlim() == alone.get_xlim()
    assert len(both.lines) == len(alone.lines) + 1


def test_backbone_is_drawn_by_what_curves_show():
    """Displacements along one axis, where its own amplitude is that in space."""
    axes = plot_response_curve(curve(measure=LARGEST), spine()).axes[0]
    (line,) = (one for one in axes.lines if one.get_label() == "backbone")
    np.testing.assert_allclose(line.get_ydata(), [0.08, 0.8, 1.6], rtol=1e-12)
    with pytest.raises(InputError, match="backbone: the curves show the displacement, a backbone"):
        plot_response_curve(curve(), spine())


def test_curves_along_the_drive_show_its_factor():
    assert plot_response_curve(curve(by="amplitudes")).axes[0].get_xlabel() == "factor on the drive"


def test_backbones_show_the_energy_where_they_have_it():
    both = plot_backbone(spine(energy=("point", [0.01, 1.0, 4.0])))
    assert [axes.get_xlabel() for axes in both.axes] == ["amplitude (m)", "energy (J)"]
    assert both.axes[1].lines[0].get_xdata().tolist() == [0.01, 1.0, 4.0]
    assert len(plot_backbone({"damped": spine()}).axes) == 1


def test_other_results_are_refused():
    for call in (
        lambda: plot_response_curve(spine()),
        lambda: plot_response_curve({}),
        lambda: plot_response_curve({"a": curve(), "b": curve(by="amplitudes")}),
        lambda: plot_response_curve(curve(), curve()),
        lambda: plot_backbone(curve()),
    ):
        with pytest.raises(InputError, match=r"^(curves|backbone)"):
            call()
