"""Pictures of loads that follow the sheet, and of forces along edges and over panels."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from pictures import keys

import foldyn as fd
from foldyn.plots import draw_structure, following, plot_load_history, style

SHEET = fd.Sheet(1e6, 0.25, 0.01, 1.0)
PATTERN = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60)


def models():
    return [fd.discretize(PATTERN, SHEET), fd.shell(PATTERN, SHEET, divisions=4)]


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
    first, second = following.on_panels(case, fd.Pressure)
    assert first.numbers.tolist() == [0, 1]
    middles, vectors = following.panel_arrows(case, s.nodes, first)
    centers = [PATTERN.vertices[list(face)].mean(axis=0) for face in PATTERN.faces]
    np.testing.assert_allclose(middles, centers, atol=1e-12)
    np.testing.assert_allclose(vectors, 3.0 * PATTERN.face_normals, atol=1e-12)
    _, vectors = following.panel_arrows(case, s.nodes, second)
    np.testing.assert_allclose(vectors, [-2.0 * PATTERN.face_normals[1]], atol=1e-12)
    found = keys(draw_structure(case))
    assert "pressure 3 Pa on panels 0, 1" in found
    assert "pressure -2 Pa on panel 1" in found


@pytest.mark.parametrize("s", models(), ids=["bars", "shell"])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_arcs_of_a_moment_lie_on_the_front_and_point_to_the_panels_it_opens(s, sign) -> None:
    case = fd.Case(s, loads=[fd.CreaseMoment([0], sign * 0.25)])
    (share,) = following.moments(case)
    assert share.value.tolist() == pytest.approx([sign * 0.25])
    arcs = following.crease_arcs(case, s.nodes, share, 0.1)
    middle = PATTERN.vertices[PATTERN.creases[0]].mean(axis=0)
    assert arcs.shape == (2, following.STEPS, 3)
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
    s = fd.discretize(pattern, SHEET)
    case = fd.Case(s, loads=[fd.CreaseMoment([0, 2], [0.2, -0.1])])
    assert "moments -0.1 to 0.2 N m of creases 0, 2" in keys(draw_structure(case))


def test_a_crowd_of_nodes_has_fewer_arrows_than_nodes() -> None:
    s = fd.shell(PATTERN, SHEET, divisions=32)
    figure = draw_structure(fd.Case(s, loads=[fd.LineLoad("xmax", (0, 0, 1.0))]), numbers=False)
    figure.canvas.draw()
    few = heads(figure)
    assert 2 < few < 20
    figure = draw_structure(fd.Case(s, loads=[fd.TotalForce((0, 0, 1), panels="all")]))
    figure.canvas.draw()
    assert few < heads(figure) < 60
    reduced = fd.discretize(PATTERN, SHEET)
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
