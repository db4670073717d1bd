"""Main effects and Sobol indices of sweeps against known functions, and figures of sweeps."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from scipy import stats

import foldyn as fd
from case_texts import HELD_MIURA_TEXT, PLATE
from foldyn.errors import InputError
from foldyn.plots import plot_main_effects, plot_sobol_indices, plot_sweep_lines, plot_sweep_map
from foldyn.results import main_effects, sobol_indices


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    path = tmp_path_factory.mktemp("case") / "case.toml"
    path.write_text(HELD_MIURA_TEXT + PLATE + '[analysis]\nkind = "modes"\ncount = 2\n')
    return fd.read_case(path).case()


def sweep_of(case, parameters, values, method="grid", **facts) -> xr.Dataset:
    """A sweep with made-up numbers."""
    grid = method == "grid"
    dims = tuple(parameters) if grid else ("point",)
    coordinates = {
        name: (name if grid else "point", array, {"key": f"sheet.{name}", "long_name": name})
        for name, array in parameters.items()
    }
    shape = np.shape(values)[: len(dims)]
    own = tuple(["mode"] if np.ndim(values) > len(dims) else [])
    data = {
        "value": ((*dims, *own), values, {"measure": "value", "units": "Hz", "long_name": "value"}),
        "failure": (dims, np.full(shape, "")),
    }
    if own:
        coordinates["mode"] = 1 + np.arange(np.shape(values)[-1])
    facts = {"method": method, "points": int(np.prod(shape)), "failed": 0, **facts}
    return fd.results.sweep_dataset.sweep_dataset(case, data, coordinates, facts)


@pytest.fixture(scope="module")
def plane(case):
    """value = 2 a - 3 b, twice as much in mode 2; a point without a value."""
    a, b = np.linspace(0.0, 1.0, 5), np.array([1.0, 10.0, 100.0])
    values = 2.0 * a[:, None] - 3.0 * b[None]
    values = np.stack([values, 2.0 * values], axis=-1)
    values[4, 2] = np.nan
    return sweep_of(case, {"a": a, "b": b}, values)


def ishigami(x):
    """Ishigami and Homma (1990), on (-pi, pi)^3, with a = 7 and b = 0.1."""
    return np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


@pytest.fixture(scope="module")
def design(case):
    from foldyn.analyses.ranges import varied
    from foldyn.sweeps.points import samples

    keys = varied(dict.fromkeys(["x1", "x2", "x3"], f"{-np.pi}:{np.pi}"), True)
    x = np.array(samples(keys, 4096, "saltelli", 0))
    parameters = {f"x{k + 1}": x[:, k] for k in range(3)}
    return sweep_of(case, parameters, ishigami(x), "saltelli", samples=4096, seed=0)


def test_main_effects_of_a_plane_are_its_slopes(plane):
    a, b = main_effects(plane, "value")
    assert (a.name, b.name) == ("a", "b")
    np.testing.assert_allclose(a.mean[:4], 2.0 * a.values[:4] - 3.0 * 37.0)
    assert a.mean[4] == pytest.approx(2.0 - 3.0 * 5.5)  # of the points that have a value
    np.testing.assert_allclose(b.mean[:2], 1.0 - 3.0 * b.values[:2])
    (second, _) = main_effects(plane, "value", at={"mode": 2})
    np.testing.assert_allclose(second.mean, 2.0 * a.mean)
    (alone,) = main_effects(plane, "value", at={"b": 10.0})
    np.testing.assert_allclose(alone.mean, 2.0 * a.values - 30.0)
    np.testing.assert_allclose(alone.deviation, 0.0, atol=1e-12)


def test_sobol_indices_of_the_ishigami_function(design):
    """Variances by Ishigami and Homma (1990): V1 = (1 + b pi^4/5)^2/2, V2 = a^2/8."""
    b = 0.1
    v1, v2, v13 = (1.0 + b * np.pi**4 / 5.0) ** 2 / 2.0, 49.0 / 8.0, 8.0 * b**2 * np.pi**8 / 225.0
    whole = v1 + v2 + v13
    found = sobol_indices(design, "value", resamples=200)
    np.testing.assert_allclose(found.first, np.array([v1, v2, 0.0]) / whole, atol=0.01)
    np.testing.assert_allclose(found.total, np.array([v1 + v13, v2, v13]) / whole, atol=0.01)
    low, high = found.first_interval.T
    assert (low <= found.first).all() and (found.first <= high).all()
    assert (high - low < 0.1).all()


def test_sobol_indices_are_those_of_scipy(design):
    rows = design["value"].values.reshape(5, -1)
    known = stats.sobol_indices(
        func={"f_A": rows[None, 0], "f_B": rows[None, 1], "f_AB": rows[2:, None]}, n=rows.shape[1]
    )
    found = sobol_indices(design, "value", resamples=1)
    np.testing.assert_allclose(found.first, known.first_order, rtol=1e-10)
    np.testing.assert_allclose(found.total, known.total_order, rtol=1e-10)


def test_rows_that_failed_are_left_out(design):
    broken = design.copy(deep=True)
    broken["value"].values[[5, 4096 + 7, 3 * 4096 + 5]] = np.nan
    found = sobol_indices(broken, "value", resamples=1)
    assert found.points == 4094
    np.testing.assert_allclose(found.first, sobol_indices(design, "value", resamples=1).first,
                               atol=0.01)  # fmt: skip


def test_indices_need_their_design_and_a_value_that_varies(plane, design):
    with pytest.raises(InputError, match='method is "grid"'):
        sobol_indices(plane, "value")
    with pytest.raises(InputError, match="does not vary"):
        sobol_indices(design.assign(value=1.0 + 0.0 * design["value"].assign_attrs(
            design["value"].attrs)).assign_attrs(design.attrs).map(
            lambda one: one.assign_attrs(design[one.name].attrs)), "value")  # fmt: skip


def test_a_map_has_its_values_and_marks_what_has_none(plane):
    figure = plot_sweep_map(plane, "value", at={"mode": 2})
    axes, bar = figure.axes
    assert axes.get_yscale() == "log" and axes.get_xscale() == "linear"
    (mesh,) = [one for one in axes.collections if hasattr(one, "_coordinates")]
    shown = np.ma.filled(mesh.get_array(), np.nan).reshape(3, 5)
    np.testing.assert_array_equal(shown, plane["value"].sel(mode=2).values.T)
    crosses = axes.lines[-1]
    np.testing.assert_array_equal(crosses.get_xydata(), [[1.0, 100.0]])
    assert bar.get_ylabel() == "value, mode 2 (Hz)"
    turned = plot_sweep_map(plane, "value", x="b")
    assert turned.axes[0].get_xlabel() == "b"


def test_lines_go_through_the_points(plane):
    figure = plot_sweep_lines(plane, "value")
    (axes,) = figure.axes
    assert len(axes.lines) == 3
    np.testing.assert_array_equal(axes.lines[1].get_ydata(), plane["value"][:, 1, 0])
    modes = plot_sweep_lines(plane, "value", x="a", by="mode", at={"b": 10.0})
    np.testing.assert_array_equal(modes.axes[0].lines[1].get_ydata(), plane["value"][:, 1, 1])
    assert modes.axes[0].get_ylabel() == "value, b 10 (Hz)"


@pytest.mark.matrix
def test_samples_are_dots_and_texts_have_their_words(case, design):
    figure = plot_sweep_map(design, "value", x="x1", y="x3")
    offsets = figure.axes[0].collections[0].get_offsets()
    assert len(offsets) == design.sizes["point"]
    words = sweep_of(case, {"rule": np.array(["panel", "centroid"])}, np.array([2.0, 1.0]))
    axes = plot_sweep_lines(words, "value").axes[0]
    assert [one.get_text() for one in axes.get_xticklabels()] == ["panel", "centroid"]
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), [2.0, 1.0])
    effects = plot_main_effects(design, "value")
    assert [axes.get_xlabel() for axes in effects.axes] == ["x1", "x2", "x3"]


def test_bars_of_indices_stand_at_their_values(design):
    found = sobol_indices(design, "value", resamples=20)
    axes = plot_sobol_indices(found).axes[0]
    heights = [bar.get_height() for bar in axes.patches]
    np.testing.assert_allclose(heights, [*found.first, *found.total])


@pytest.mark.parametrize(
    ("draw", "given", "message"),
    [
        (plot_sweep_map, {"measure": "valu"}, "did you mean 'value'"),
        (plot_sweep_map, {"measure": "value", "x": "c"}, "choose one of a, b"),
        (plot_sweep_map, {"measure": "value", "at": {"a": 0.0}}, "needs two parameters"),
        (plot_sweep_map, {"measure": "value", "at": {"mode": 3}}, r"at\['mode'\] = 3"),
        (plot_sweep_lines, {"measure": "valu"}, "did you mean 'value'"),
        (plot_sweep_lines, {"measure": "value", "by": "mode"}, "has several values"),
        (plot_main_effects, {"measure": "value", "at": {"x": 3}}, "choose one of"),
    ],
)
def test_what_cannot_be_drawn_is_refused(plane, draw, given, message):
    with pytest.raises(InputError, match=message):
        draw(plane, **given)


def test_other_results_and_sweeps_without_values_are_refused(plane):
    empty = plane.copy(deep=True)
    empty["value"].values[:] = np.nan
    with pytest.raises(InputError, match="has no value at any point"):
        plot_sweep_map(empty, "value")
    with pytest.raises(InputError, match=r"give a result of foldyn\.sweep"):
        plot_sweep_map(plane.assign_attrs(foldyn_result="modes"), "value")
    with pytest.raises(InputError, match="sobol_indices returns"):
        plot_sobol_indices(plane)
