"""Pictures of loads that follow the sheet, along edges and over panels, of heat and of dashpots."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from pictures import keys

import foldyn as fd
from foldyn.plots import draw_structure, load_curves, plot_load_history, style
from foldyn.plots.attachments import REACH, dashpot_lines
from foldyn.plots.scene import View

SHEET = fd.Sheet(1e6, 0.25, 0.01, 1.0)
PATTERN = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60)


def models():
    return [fd.discretize(PATTERN, SHEET, preset="plate"), fd.shell(PATTERN, SHEET, divisions=4)]


def heads(figure) -> int:
    """Number of the heads of arrows of loads."""
    color = to_rgb(style.LOAD)
    return sum(
        len(item.get_paths())
        for item in figure.axes[0].collections
        if isinstance(item, Poly3DCollection) and to_rgb(item.get_facecolor()[0]) == color
    )


@pytest.mark.parametrize("s", models(), ids=["bars", "shell"])
def test_pressure_is_an_arrow_normal_to_each_panel(s) -> None:
    case = fd.Case(s, loads=[fd.Pressure(3.0), fd.Pressure(-2.0, [1], fd.Ramp(1.0))])
    first, second = load_curves.on_panels(case, fd.Pressure)
    assert first.numbers.tolist() == [0, 1]
    middles, vectors = load_curves.panel_arrows(case, s.nodes, first)
    centers = [PATTERN.vertices[list(face)].mean(axis=0) for face in PATTERN.faces]
    np.testing.assert_allclose(middles, centers, atol=1e-12)
    np.testing.assert_allclose(vectors, 3.0 * PATTERN.face_normals, atol=1e-12)
    _, vectors = load_curves.panel_arrows(case, s.nodes, second)
    np.testing.assert_allclose(vectors, [-2.0 * PATTERN.face_normals[1]], atol=1e-12)
    found = keys(draw_structure(case))
    assert "pressure 3 Pa on panels 0, 1" in found
    assert "pressure -2 Pa on panel 1" in found


@pytest.mark.parametrize("s", models(), ids=["bars", "shell"])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_arcs_of_a_moment_lie_on_the_front_and_point_to_the_panels_it_opens(s, sign) -> None:
    case = fd.Case(s, loads=[fd.CreaseMoment([0], sign * 0.25)])
    (share,) = load_curves.moments(case)
    assert share.value.tolist() == pytest.approx([sign * 0.25])
    arcs = load_curves.crease_arcs(case, s.nodes, share, 0.1)
    middle = PATTERN.vertices[PATTERN.creases[0]].mean(axis=0)
    assert arcs.shape == (2, load_curves.STEPS, 3)
    np.testing.assert_allclose(np.linalg.norm(arcs - middle, axis=2), 0.1, rtol=1e-12)
    for arc in arcs:
        ends = [
            min(abs((point - middle) @ normal) for normal in PATTERN.face_normals)
            for point in (arc[0], arc[-1])
        ]
        assert (ends[1] < ends[0]) == (sign > 0.0)
        assert any(((arc - middle) @ normal > -1e-9).all() for normal in PATTERN.face_normals)
    text = f"moment {sign * 0.25:g} N m of crease 0"
    figure = draw_structure(case)
    assert text in keys(figure)
    figure.canvas.draw()
    assert heads(figure) == 2


def test_moments_of_their_own_are_told_by_their_range() -> None:
    pattern = fd.patterns.miura(cells=(1, 1), panel_angle=60, dihedral=60)
    s = fd.discretize(pattern, SHEET, preset="plate")
    case = fd.Case(s, loads=[fd.CreaseMoment([0, 2], [0.2, -0.1])])
    assert "moments -0.1 to 0.2 N m of creases 0, 2" in keys(draw_structure(case))


@pytest.mark.matrix
def test_a_crowd_of_nodes_has_fewer_arrows_than_nodes() -> None:
    s = fd.shell(PATTERN, SHEET, divisions=32)
    figure = draw_structure(fd.Case(s, loads=[fd.LineLoad("xmax", (0, 0, 1.0))]), numbers=False)
    figure.canvas.draw()
    few = heads(figure)
    assert 2 < few < 20
    figure = draw_structure(fd.Case(s, loads=[fd.TotalForce((0, 0, 1), panels="all")]))
    figure.canvas.draw()
    assert few < heads(figure) < 60
    reduced = fd.discretize(PATTERN, SHEET, preset="plate")
    figure = draw_structure(fd.Case(reduced, loads=[fd.LineLoad("xmax", (0, 0, 1.0))]))
    figure.canvas.draw()
    assert heads(figure) == 2


def test_histories_of_pressure_and_moments_have_axes_of_their_own() -> None:
    s = models()[0]
    loads = [fd.Pressure(3.0, history=fd.Ramp(1.0)), fd.CreaseMoment([0], -0.25)]
    figure = plot_load_history(fd.Case(s, loads=loads), 2.0)
    pressure, moment = figure.axes
    assert pressure.get_ylabel() == "pressure (Pa)"
    assert moment.get_ylabel() == "moment of a crease (N m)"
    assert pressure.lines[0].get_ydata()[-1] == 3.0
    assert moment.lines[0].get_ydata()[0] == -0.25


MIURA = fd.patterns.miura(cells=(1, 1), panel_angle=60, dihedral=100)
HEAT = [
    fd.Temperature(20.0, 1e-4, panels=[0, 3], history=fd.Ramp(0.5)),
    fd.Temperature(-5.0, curvature=0.1),
]


def heated() -> fd.Case:
    structure = fd.discretize(MIURA, SHEET, preset="plate")
    return fd.Case(structure, [fd.Fix("xmin")], HEAT)


def test_warm_panels_have_stars_in_their_middles() -> None:
    figure = fd.plots.draw_structure(heated())
    assert "20 K warmer on panels 0, 3" in keys(figure)
    assert any(text.startswith("5 K colder on panels 0, 1, 2") for text in keys(figure))
    share, _ = load_curves.on_panels(heated(), fd.Temperature)
    middles = load_curves.panel_middles(heated().structure, heated().structure.nodes, share)
    expected = [MIURA.vertices[list(MIURA.faces[panel])].mean(axis=0) for panel in (0, 3)]
    np.testing.assert_allclose(middles, expected)
    (axes,) = figure.axes
    stars = [line.get_data_3d() for line in axes.lines if line.get_marker() == "*"]
    assert [len(x) for x, _, _ in stars] == [2, 4]


def test_temperatures_over_time() -> None:
    figure = fd.plots.plot_load_history(heated(), 1.0)
    (axes,) = [axes for axes in figure.axes if axes.get_ylabel() == "temperature (K)"]
    ramp, constant = (line.get_ydata() for line in axes.lines[:2])
    assert ramp[-1] == 20.0
    assert ramp[len(ramp) // 4] == 20.0 * 0.25 / 0.5
    assert (np.asarray(constant) == -5.0).all()


DASHPOTS = [
    fd.Dashpot(0.1, nodes=[8]),
    fd.Dashpot(0.2, nodes=[7], direction="x"),
    fd.Dashpot(0.05, between=[(1, 7), (0, 6)]),
]


@pytest.mark.parametrize("model", ["bars", "shell"])
def test_dashpots_have_lines_and_a_legend(model):
    pattern = fd.patterns.miura()
    s = (
        fd.discretize(pattern, SHEET, preset="plate")
        if model == "bars"
        else fd.shell(pattern, SHEET, divisions=2)
    )
    case = fd.Case(s, [fd.Fix("xmin"), *DASHPOTS])
    lines = dashpot_lines(case, s.nodes, 0.1, View(28.0, -60.0))
    ends = {tuple(np.round(point, 9)) for point in lines.reshape(-1, 3)}
    wanted = [s.nodes[8], s.nodes[8] - [0, 0, 0.1 * REACH], s.nodes[7] + [0.1 * REACH, 0, 0]]
    for point in [*wanted, *s.nodes[[0, 1, 6, 7]]]:
        assert tuple(np.round(point, 9)) in ends
    told = keys(draw_structure(case))
    assert "dashpot 0.1 N s/m to the ground" in told
    assert "dashpot 0.05 N s/m between nodes" in told


def test_none_without_dashpots():
    case = fd.Case(fd.discretize(fd.patterns.miura(), SHEET, preset="plate"), [fd.Fix("xmin")])
    assert not len(dashpot_lines(case, case.structure.nodes, 0.1, View(28.0, -60.0)))
