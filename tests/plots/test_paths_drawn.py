"""Curves, energies, shapes and animations of paths: the data in them."""

from __future__ import annotations

import numpy as np
import pytest
from mpl_toolkits.mplot3d.art3d import Line3DCollection
from pictures import assert_white_rim, keys
from PIL import Image

from foldyn import cases, patterns, structures
from foldyn.errors import InputError
from foldyn.plots import (
    animate,
    animation,
    draw_shapes,
    energy_shares,
    plot_load_displacement,
    plot_path_energies,
    plot_reaction,
    scene,
    style,
    total_reaction,
)
from foldyn.plots.readings import evenly, main_direction, stretches, way
from foldyn.plots.scene import Sheet3D
from foldyn.plots.sheet import DrawnSheet
from foldyn.results import path_dataset
from pairwise import beyond

FACTORS = np.array([0.0, 0.6, 1.0, 0.7, 0.2, -0.1, 0.3, 0.9])
NEGATIVE = np.array([0, 0, 0, 1, 1, 1, 0, 0])
KINDS = ["regular"] * 2 + ["limit"] + ["regular"] * 2 + ["bifurcation"] + ["regular"] * 2
DOWN = np.array([0.0, 0.1, 0.2, 0.35, 0.5, 0.6, 0.75, 0.8])  # of node 7 along -z


@pytest.fixture
def held(case):
    """The cell with two nodes moved: reactions there are known."""
    moved = cases.Impose([6, 8], "y", [0.1, 0.1])
    return cases.Case(case.structure, [*case.supports, moved], case.loads)


def made(case, factors=FACTORS, negative=NEGATIVE, kinds=KINDS, down=DOWN):
    """A path whose node 7 goes down and nodes 6, 8 along y as the load factor says."""
    count = len(factors)
    u = np.zeros((count, len(case.structure.nodes), 3))
    u[:, 7, 2] = -np.asarray(down)
    u[:, [6, 8], 1] = 0.1 * np.asarray(factors)[:, None]
    reaction = np.zeros((count, len(case.supported_dofs)))
    for column, dof in enumerate(case.supported_dofs.tolist()):
        if dof in (3 * 6 + 1, 3 * 8 + 1):
            reaction[:, column] = (2.0 if dof == 19 else 3.0) * np.asarray(factors)
    energies = {
        "strain_bars": 0.1 * np.asarray(down),
        "strain_bends": 0.3 * np.asarray(down),
        "strain_folds": 0.6 * np.asarray(down),
        "work": 1.0 * np.asarray(down),
    }
    solution = {
        "negative_eigenvalues": negative,
        "point": kinds,
        "iterations": np.full(count, 3),
        "residual": np.zeros(count),
    }
    return path_dataset(case, factors, u, reaction, energies, solution, {"method": "newton"})


@pytest.fixture
def path(case):
    return made(case)


def curves(figure):
    """The lines that are stretches of curves: solid or dashed, of one color."""
    return [
        line
        for line in figure.axes[0].get_lines()
        if line.get_linewidth() == pytest.approx(1.4) and line.get_linestyle() != "None"
    ]


def marks(figure, kind):
    return [line for line in figure.axes[0].get_lines() if line.get_label() == f"_{kind}"]


def test_stability_is_the_style_of_the_line(path):
    figure = plot_load_displacement({"one": path}, [7], direction="-z")
    first, second, third = curves(figure)
    assert [line.get_linestyle() for line in (first, second, third)] == ["-", "--", "-"]
    parts = (slice(0, 3), slice(2, 7), slice(6, 8))  # they meet in the points between them
    for line, part in zip((first, second, third), parts, strict=True):
        np.testing.assert_array_equal(line.get_xdata(), DOWN[part])
        np.testing.assert_array_equal(line.get_ydata(), FACTORS[part])
        assert line.get_color() == style.CYCLE[0]
    assert keys(figure) == ["stable", "unstable", "limit point", "bifurcation"]
    (axes,) = figure.axes
    assert axes.get_xlabel() == "displacement of node 7 along -z (m)"
    assert axes.get_ylabel() == "load factor"


def test_critical_points_are_marked(path):
    figure = plot_load_displacement({"one": path}, [7], direction="-z")
    (limit,), (bifurcation,) = marks(figure, "limit"), marks(figure, "bifurcation")
    assert (limit.get_xdata()[0], limit.get_ydata()[0]) == (0.2, 1.0)
    assert (bifurcation.get_xdata()[0], bifurcation.get_ydata()[0]) == (0.6, -0.1)
    assert limit.get_marker() != bifurcation.get_marker()


def test_a_stable_path_has_no_legend_to_explain(case):
    calm = made(case, negative=np.zeros(8, int), kinds=["regular"] * 8)
    figure = plot_load_displacement({"one": calm}, [7], direction="-z")
    (line,) = curves(figure)
    assert line.get_linestyle() == "-" and len(line.get_xdata()) == 8
    assert figure.legends == []


def test_eigenvalues_that_were_not_counted_draw_one_solid_line(case):
    blind = made(case, negative=np.full(8, -1), kinds=["regular"] * 8)
    (line,) = curves(plot_load_displacement({"one": blind}, [7]))
    assert line.get_linestyle() == "-"


def test_a_curve_for_each_path_and_node(case, path):
    other = made(case, factors=2 * FACTORS)
    figure = plot_load_displacement({"one": path, "two": other}, [7, 6], direction="z")
    assert keys(figure)[:4] == ["one, node 7", "one, node 6", "two, node 7", "two, node 6"]
    drawn = {line.get_label(): line for line in curves(figure)}
    np.testing.assert_array_equal(drawn["two, node 7"].get_xdata(), -DOWN[:3])
    np.testing.assert_array_equal(drawn["two, node 7"].get_ydata(), 2 * FACTORS[:3])
    assert not drawn["one, node 6"].get_xdata().any()
    assert len({line.get_color() for line in curves(figure)}) == 4


def test_the_direction_is_that_of_the_farthest_motion(path):
    assert main_direction({"": path}, [7]) == "-z"
    assert main_direction({"": path}, [6]) == "y"
    assert main_direction({"": path}, [6, 7]) == "-z"
    figure = plot_load_displacement({"": path}, [6])
    assert figure.axes[0].get_xlabel() == "displacement of node 6 along y (m)"
    np.testing.assert_allclose(curves(figure)[0].get_xdata(), 0.1 * FACTORS[:3])


def test_a_single_point_is_a_dot(case):
    alone = made(case, FACTORS[1:2], NEGATIVE[1:2], ["regular"], DOWN[1:2])
    (dot,) = [
        line
        for line in plot_load_displacement({"": alone}, [7]).axes[0].get_lines()
        if line.get_marker() == "."
    ]
    assert (dot.get_xdata()[0], dot.get_ydata()[0]) == (0.1, 0.6)


def test_the_force_of_moved_supports(held):
    path = made(held)
    np.testing.assert_allclose(total_reaction(path, [6, 8], direction="y"), 5.0 * FACTORS)
    np.testing.assert_allclose(total_reaction(path, [8], direction="-y"), -3.0 * FACTORS)
    figure = plot_reaction({"one": path}, [6, 8])
    (axes,) = figure.axes
    assert axes.get_xlabel() == "imposed displacement along y (m)"
    assert axes.get_ylabel() == "force along y (N)"
    x = np.concatenate([line.get_xdata()[:-1] for line in curves(figure)])
    y = np.concatenate([line.get_ydata()[:-1] for line in curves(figure)])
    np.testing.assert_allclose(x, 0.1 * FACTORS[:-1])
    np.testing.assert_allclose(y, 5.0 * FACTORS[:-1])
    backwards = plot_reaction({"one": path}, [6, 8], direction="-y")
    np.testing.assert_allclose(curves(backwards)[0].get_ydata(), -5.0 * FACTORS[:3])


def test_energies_are_stacked(path):
    figure = plot_path_energies(path)
    upper, lower = figure.axes
    names = ["bars", "bends", "folds"]
    areas = {area.get_label(): area for area in upper.collections}
    assert list(areas) == names
    length = way(path)
    tops = np.cumsum([0.1 * DOWN, 0.3 * DOWN, 0.6 * DOWN], axis=0)
    for name, top in zip(names, tops, strict=True):
        corners = areas[name].get_paths()[0].vertices
        for x, y in zip(length, top, strict=True):
            assert (np.abs(corners - [x, y]).max(axis=1) < 1e-12).any()
    work = upper.get_lines()[0]
    np.testing.assert_allclose(work.get_ydata(), DOWN)
    assert lower.get_xlabel() == "mean distance traveled by the nodes (m)"
    assert keys(figure) == ["folds", "bends", "bars", "at the start + work done"]


def test_shares_of_the_energies(case, path):
    shares = energy_shares(path)
    assert list(shares) == ["bars", "bends", "folds"]
    for name, share in (("bars", 0.1), ("bends", 0.3), ("folds", 0.6)):
        assert np.isnan(shares[name][0])  # nothing to share at rest
        np.testing.assert_allclose(shares[name][1:], share)
    still = made(case, down=np.zeros(8))
    assert all(np.isnan(share).all() for share in energy_shares(still).values())


def test_what_energies_are_drawn_over(case, path):
    straight = made(case, factors=np.linspace(0, 1, 8))
    figure = plot_path_energies(straight)
    assert figure.axes[1].get_xlabel() == "load factor"
    np.testing.assert_array_equal(figure.axes[0].get_lines()[0].get_xdata(), np.linspace(0, 1, 8))
    figure = plot_path_energies(path, [7])
    assert figure.axes[1].get_xlabel() == "displacement along -z (m)"
    np.testing.assert_array_equal(figure.axes[0].get_lines()[0].get_xdata(), DOWN)
    with pytest.raises(InputError, match="they also move back along y"):
        plot_path_energies(path, [6, 8])


def test_the_way_of_the_nodes(path):
    """By hand: node 7 moves by dz, nodes 6 and 8 by 0.1 df each, of 13 nodes."""
    steps = np.sqrt((np.diff(DOWN) ** 2 + 2 * (0.1 * np.diff(FACTORS)) ** 2) / 13)
    np.testing.assert_allclose(way(path), np.concatenate([[0.0], np.cumsum(steps)]))
    assert evenly(path, 2) == [0, 7]
    assert evenly(path, 1) == [7]
    assert evenly(path, 100) == list(range(8))
    middle = evenly(path, 3)[1]
    assert abs(way(path)[middle] - way(path)[-1] / 2) == np.abs(way(path) - way(path)[-1] / 2).min()


def test_runs_of_stability(path):
    assert [tuple(part) for part in stretches(path)] == [(0, 2, True), (2, 6, False), (6, 7, True)]


def sheets(figure):
    """Boundary lines of each shape: (shape, segments, 2, 3)."""
    found = []
    for axes in figure.axes:
        (lines,) = [
            c
            for c in axes.collections
            if isinstance(c, Line3DCollection) and c.get_label() == "boundary"
        ]
        found.append(np.array(lines._segments3d))
    return found


@pytest.mark.matrix
def test_shapes_are_the_chosen_points(case, path):
    figure = draw_shapes(case, path, points=[0, 2, -1], scale=2.0, view=(90.0, -90.0))
    assert [text.get_text() for text in figure.texts] == [
        "point 0: load factor 0",
        "point 2: load factor 1, limit point",
        "point 7: load factor 0.9",
    ]
    rest = case.structure.nodes
    for lines, point in zip(sheets(figure), (0, 2, 7), strict=True):
        corners = rest + 2.0 * path.displacement.values[point]
        boundary = {tuple(np.round(corner, 9)) for corner in lines.reshape(-1, 3)}
        for node in (6, 7, 8):  # of the loaded edge
            assert tuple(np.round(corners[node], 9)) in boundary
    assert "displacement times 2" in keys(figure)
    assert "undeformed" in keys(figure)


@pytest.mark.matrix
def test_shapes_tell_what_is_unstable(case, path):
    figure = draw_shapes(case, path, points=[3, 5])
    assert [text.get_text() for text in figure.texts] == [
        "point 3: load factor 0.7, unstable",
        "point 5: load factor -0.1, bifurcation",
    ]
    spread = draw_shapes(case, path, points=3)
    assert [text.get_text().split(":")[0] for text in spread.texts] == [
        f"point {k}" for k in evenly(path, 3)
    ]


@pytest.mark.matrix
@pytest.mark.parametrize("count", [1, 5, *beyond([8, 2, 4])])
def test_shapes_lie_in_the_figure_and_apart(case, path, count):
    figure = draw_shapes(case, path, points=list(range(count)), title="Shapes")
    assert len(figure.axes) == count
    assert_white_rim(figure)
    boxes = [text.get_window_extent() for text in figure.texts]
    assert not any(a.overlaps(b) for k, a in enumerate(boxes) for b in boxes[:k])


def test_pieces_of_panels_are_the_panels():
    vertices = np.array([[0, 0, 0], [2, 0, 0], [0, 1, 1], [3, 3, 0]], float)
    triangles = np.array([[0, 1, 2], [1, 3, 2]])
    cut = scene.pieces(vertices, triangles)
    assert len(cut) == 2 * scene._MOST_DIVISIONS**2

    def areas(corners):
        return 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])

    whole = areas(vertices[triangles])
    each = areas(cut).reshape(2, -1, 3)
    np.testing.assert_allclose(each, whole[:, None] / each.shape[1] * np.ones_like(each))
    np.testing.assert_allclose(
        cut.reshape(2, -1, 3).mean(axis=1), vertices[triangles].mean(axis=1), atol=1e-12
    )
    colors = scene.piece_colors(vertices, triangles)
    np.testing.assert_array_equal(colors[0], scene.shades(vertices, triangles)[0])
    np.testing.assert_array_equal(colors[-1], scene.shades(vertices, triangles)[1])
    many = np.repeat(triangles, 5000, axis=0)
    assert len(scene.pieces(vertices, many)) == len(many)  # large sheets are not cut


def test_hidden_panels_are_painted_first():
    """Seen along x, of two panels that are almost closed the one with the larger x hides the other.

    By the middles of whole triangles some of the hidden panel would lie before the other one.
    """
    pattern = patterns.simple_fold(a=1.0, b=1.0, dihedral=20)
    s = structures.discretize(pattern, structures.Sheet(1e6, 0.25, 0.01), preset="plate")
    sheet, view = Sheet3D.of(s), scene.View(0.0, 0.0)
    _, axes = scene.view_figure(s.nodes, view)
    hidden, visible = DrawnSheet(axes, sheet, s.nodes, view)._pieces(s.nodes)
    ridge = pattern.vertices[2, 0]
    for (corners, colors), side in ((hidden, -1.0), (visible, 1.0)):
        assert len(corners) == len(colors) == len(s.triangles) * scene._MOST_DIVISIONS**2 / 2
        assert (side * (corners.mean(axis=1)[:, 0] - ridge) > 0.0).all()


@pytest.mark.matrix
def test_an_animation_of_a_path_tells_load_factors(case, path, tmp_path, monkeypatch):
    told = []
    factors = animation._factors
    monkeypatch.setattr(animation, "_factors", lambda *a: told.extend(factors(*a)) or told)
    file = animate(case, path, path=tmp_path / "path.gif", frames=9)
    with Image.open(file) as gif:
        assert gif.n_frames == 9
    assert told[0] == "load factor 0.0"
    assert told[-1] == "load factor 0.9"
    unstable = [text.endswith(", unstable") for text in told]
    places = np.linspace(0.0, way(path)[-1], 9)
    length = way(path)
    np.testing.assert_array_equal(unstable, (places > length[2]) & (places < length[6]))


def test_pictures_of_a_path_are_spread_over_its_way(case, path):
    sheet = Sheet3D.of(case)
    places, u = animation.frame_displacements(sheet, path, 5)
    np.testing.assert_allclose(places, np.linspace(0.0, way(path)[-1], 5))
    stored = path.displacement.values
    np.testing.assert_array_equal(u[0], stored[0])
    np.testing.assert_allclose(u[-1], stored[-1], atol=1e-15)
    for place, shape in zip(places, u, strict=True):
        assert -shape[7, 2] == pytest.approx(np.interp(place, way(path), DOWN))
    # a path that rests for a while
    twice = made(case, np.repeat(FACTORS, 2), np.repeat(NEGATIVE, 2), KINDS + KINDS, DOWN.repeat(2))
    _, again = animation.frame_displacements(sheet, twice, 5)
    np.testing.assert_allclose(again, u, atol=1e-12)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda case, path: plot_load_displacement({}, [7]), "paths: give a result"),
        (lambda case, path: plot_load_displacement({"a": case}, [7]), "paths.'a'. = .*: give a"),
        (lambda case, path: plot_load_displacement({"a": path}, []), "nodes = ..: give nodes"),
        (lambda case, path: plot_load_displacement(path, "x > 99"), "selects no vertex"),
        (lambda case, path: plot_load_displacement({"a": path}, [13]), "13 is not in 'a'"),
        (
            lambda case, path: plot_load_displacement({"a": path}, [7], direction="w"),
            'direction = "w"',
        ),
        (
            lambda case, path: plot_reaction({"a": path}, [7], direction="z"),
            "no support holds node 7 along z",
        ),
        (lambda case, path: draw_shapes(case, path, points=[8]), "8; there are points 0 to 7"),
        (lambda case, path: draw_shapes(case, path, points=[]), "points: empty"),
        (lambda case, path: draw_shapes(case, path, points=0), "points: 0; give at least one"),
        (lambda case, path: draw_shapes(case, path.isel(node=slice(9))), "9 nodes, the structure"),
        (lambda case, path: plot_path_energies(path.drop_vars("point")), "path: is not a path"),
        (lambda case, path: energy_shares(path.where(path.step < 3)), "NaN"),
    ],
)
def test_bad_input(case, path, call, words):
    with pytest.raises(InputError, match=words):
        call(case, path)


def test_motions_are_no_paths(case, trajectory):
    with pytest.raises(InputError, match="is not a path"):
        plot_load_displacement({"a": trajectory}, [7])


@pytest.mark.matrix
def test_a_path_alone_needs_no_label_and_brings_its_case(held):
    path = made(held)
    nodes = np.flatnonzero(np.isclose(held.structure.nodes[:, 0], held.structure.nodes[:, 0].max()))
    for draw in (plot_load_displacement, plot_reaction):
        chosen = [7, 6] if draw is plot_load_displacement else [6, 8]
        lines = [
            [line.get_xydata() for line in curves(draw(given, chosen))]
            for given in (path, {"one": path})
        ]
        for one, other in zip(*lines, strict=True):
            np.testing.assert_array_equal(one, other)
    by_place = plot_load_displacement(path, "xmax", direction="-z")
    by_number = plot_load_displacement(path, nodes[nodes < 9].tolist(), direction="-z")
    assert keys(by_place) == keys(by_number) and keys(by_place)[0] == f"node {nodes[0]}"
    figures = draw_shapes(path, points=[0, 7]), draw_shapes(held, path, points=[0, 7])
    for one, other in zip(*(figure.axes for figure in figures), strict=True):
        for a, b in zip(one.collections, other.collections, strict=True):
            if hasattr(a, "_segments3d"):
                np.testing.assert_allclose(a._segments3d, b._segments3d, atol=1e-12)
