"""Imposed displacements, motions of the base and actuated creases in the figures."""

from __future__ import annotations

import numpy as np
import pytest
from pictures import assert_white_rim, keys, shafts

from foldyn import cases, patterns, structures
from foldyn.plots import draw_structure, plot_load_history, style


@pytest.fixture(scope="module")
def sheet():
    pattern = patterns.miura(cells=(2, 2), a=1.0, b=1.0, panel_angle=60, dihedral=60)
    return structures.discretize(
        pattern, structures.Sheet(1e6, 0.25, 0.01, density=1.0), preset="plate"
    )


@pytest.fixture(scope="module")
def moved(sheet):
    """A sheet that is pulled, lifted unevenly, and flattens itself."""
    return cases.Case(
        sheet,
        [
            cases.Fix("xmin"),
            cases.Impose("xmax", "x", 0.3, cases.Ramp(1.0, smooth=True)),
            cases.Impose([10, 14], "z", [-0.2, -0.1], cases.Harmonic(1.0)),
            cases.Impose(12, "y", 0.0),
        ],
        [cases.Actuate("all", 180, cases.Ramp(2.0))],
    )


@pytest.fixture(scope="module")
def shaken(sheet):
    supports = [cases.Fix("xmin"), cases.BaseMotion("x", cases.Harmonic(2.0), -0.01)]
    return cases.Case(sheet, supports, [cases.Force([22], (0.01, 0, 0))])


def glowing(figure) -> list:
    return [c for c in figure.axes[0].collections if c.get_label() == "actuated crease"]


def test_imposed_displacements_have_marks_and_arrows(moved, sheet):
    figure = draw_structure(moved)
    assert keys(figure)[-4:] == [
        "support (directions held)",
        "imposed displacement (directions)",
        "moved 0.3 m along +x on nodes 20, 21, 22 and 2 more",
        "moved up to 0.2 m along -z on nodes 10, 14",
    ]
    (arrows,) = shafts(figure)  # none at node 12, which does not move
    np.testing.assert_allclose(arrows[:, 0], sheet.nodes[[20, 21, 22, 23, 24, 10, 14]])
    way = arrows[:, 1] - arrows[:, 0]
    np.testing.assert_allclose(way[:5] / way[:5, :1], [[1, 0, 0]] * 5, atol=1e-12)
    assert (way[5:, 2] < 0).all()
    names = [(t.get_text(), t.get_color()) for t in figure.axes[0].texts if t.get_text().isalpha()]
    assert names.count(("xyz", style.SUPPORT)) == 5
    assert sorted(name for name, color in names if color == style.IMPOSED_TEXT) == [*"xxxxxyzz"]
    assert keys(draw_structure(moved, supports=False))[-1] == "valley crease"


@pytest.mark.matrix
def test_actuated_creases_glow(moved, sheet):
    figure = draw_structure(moved, numbers=False, view=(90.0, -90.0))
    assert keys(figure)[0] == "actuated crease"
    (glow,) = glowing(figure)
    assert glow.get_color()[0][:3] == pytest.approx((0xF0 / 255, 0xE4 / 255, 0x42 / 255))
    length = np.linalg.norm(np.diff(np.array(glow._segments3d), axis=1), axis=2).sum()
    assert length == pytest.approx(len(sheet.folds), rel=1e-9)  # seen from above none is hidden
    some = cases.Case(sheet, loads=[cases.Actuate([3], 100)])
    (glow,) = glowing(draw_structure(some, view=(90.0, -90.0)))
    ends = np.array(glow._segments3d).reshape(-1, 3)
    crease = sheet.nodes[sheet.pattern.creases[3]]
    np.testing.assert_allclose([ends.min(axis=0), ends.max(axis=0)], np.sort(crease, axis=0))
    assert "actuated crease" not in keys(draw_structure(moved, loads=False))


def test_a_moving_base_is_one_arrow(shaken, sheet):
    figure = draw_structure(shaken)
    assert keys(figure)[-2:] == ["base moved 0.01 m along -x", "0.01 N along +x on node 22"]
    base, force = shafts(figure)
    ((start, end),) = base
    np.testing.assert_allclose(start, sheet.nodes[:5].mean(axis=0))
    assert end[0] < start[0] and end[1:] == pytest.approx(start[1:])
    assert len(force) == 1


@pytest.mark.matrix
def test_nothing_is_cut_off(moved, shaken):
    for figure in (draw_structure(moved), draw_structure(shaken), plot_load_history(moved, 3.0)):
        assert_white_rim(figure)
        box = figure.legends[0].get_window_extent()
        assert box.x0 >= 0 and box.x1 <= figure.bbox.x1 and box.y0 >= 0


def test_the_histories_of_imposed_motions_and_rest_angles(moved, sheet):
    figure = plot_load_history(moved, 2.0)
    moves, angles = figure.axes
    labels = [a.get_ylabel() for a in figure.axes]
    assert labels == ["imposed displacement (m)", "rest angle (degrees)"]
    pull, first, second, none = moves.get_lines()[:4]
    t = pull.get_xdata()
    np.testing.assert_allclose(pull.get_ydata(), 0.3 * cases.Ramp(1.0, smooth=True)(t))
    np.testing.assert_allclose(first.get_ydata(), -0.2 * np.sin(2 * np.pi * t), atol=1e-12)
    np.testing.assert_allclose(second.get_ydata(), -0.1 * np.sin(2 * np.pi * t), atol=1e-12)
    assert not np.any(none.get_ydata())
    lines = angles.get_lines()
    rests = np.unique(np.round(np.degrees(sheet.fold_rest), 4))
    assert len(lines) == len(rests) == 4
    np.testing.assert_allclose(sorted(line.get_ydata()[0] for line in lines), rests, atol=1e-3)
    for line in lines:
        start = line.get_ydata()[0]
        np.testing.assert_allclose(line.get_ydata(), start + (180 - start) * t / 2, atol=1e-4)
    texts = keys(figure)
    assert (
        texts[0] == "moved 0.3 m along x on nodes 20, 21, 22 and 2 more: smooth ramp (duration 1)"
    )
    assert texts[1] == "moved -0.2 m along z on node 10: harmonic (frequency 1, phase 0)"
    assert texts[4].startswith("rest angle 300 to 180 degrees on creases 0, 2, 5 and 5 more: ramp")


def test_the_history_of_the_base(shaken):
    figure = plot_load_history(shaken, 1.0)
    assert [a.get_ylabel() for a in figure.axes] == ["force at a node (N)", "base displacement (m)"]
    line = figure.axes[1].get_lines()[0]
    t = line.get_xdata()
    np.testing.assert_allclose(line.get_ydata(), -0.01 * np.sin(4 * np.pi * t), atol=1e-12)
    assert keys(figure)[1] == "base moved -0.01 m along x: harmonic (frequency 2, phase 0)"


def test_a_motion_that_starts_later_has_its_own_time_axis(shaken):
    axes = plot_load_history(shaken, 1.0, start=2.25).axes[1]
    assert axes.get_xlim() == (2.25, 3.25)
    t, moved = axes.get_lines()[0].get_data()
    np.testing.assert_allclose(moved, -0.01 * np.sin(4 * np.pi * t), atol=1e-12)


def test_many_different_displacements_are_counted(sheet):
    nodes = list(range(20, 25))
    case = cases.Case(sheet, [cases.Impose(nodes, "x", [0.1, 0.2, 0.3, 0.4, 0.5])])
    figure = plot_load_history(case, 1.0)
    texts = keys(figure)
    assert len(texts) == 4
    assert texts[3] == "moved 0.4 m along x on node 23 (and 1 more, not drawn): constant"
