"""The picture of a structure: what is drawn, and where."""

from __future__ import annotations

import numpy as np
import pytest
from mpl_toolkits.mplot3d.proj3d import proj_transform
from pictures import assert_white_rim, keys, pixels, shafts

from foldyn import cases, patterns, structures
from foldyn.errors import InputError
from foldyn.plots import attachments, draw_structure, plot_load_history, style
from foldyn.plots.scene import View


def _texts(figure):
    return [text.get_text() for text in figure.axes[0].texts]


def _segments(figure, name):
    """The visible segments of one kind of edge, in space."""
    (lines,) = [c for c in figure.axes[0].collections if c.get_label() == name]
    return np.array(lines._segments3d)


def test_numbers_of_vertices_and_inner_nodes(structure):
    assert _texts(draw_structure(structure)) == [str(k) for k in range(9)]
    assert _texts(draw_structure(structure, numbers="all")) == [str(k) for k in range(13)]
    assert _texts(draw_structure(structure, numbers=False)) == []


def test_axes_have_units_and_equal_scale(case):
    figure = draw_structure(case, title="Miura cell")
    (axes,) = figure.axes
    assert [axes.get_xlabel(), axes.get_ylabel(), axes.get_zlabel()] == ["x (m)", "y (m)", "z (m)"]
    assert figure.get_suptitle() == "Miura cell"
    figure.canvas.draw()
    # A meter is as long on the screen as the orthographic view says, along each axis.
    pixels = []
    for direction, seen in zip(np.eye(3), View().flat(np.eye(3)), strict=True):
        flat = np.array(
            [proj_transform(*p, axes.get_proj())[:2] for p in (0 * direction, direction)]
        )
        a, b = axes.transData.transform(flat)
        pixels.append(np.linalg.norm(b - a) / np.linalg.norm(seen))
    np.testing.assert_allclose(pixels, pixels[0], rtol=1e-9)


@pytest.mark.parametrize("view", [(28.0, -60.0), (5.0, 20.0), (80.0, -135.0)])
def test_nothing_is_cut_off(case, view):
    figure = draw_structure(case, title="Miura cell", numbers="all", view=view)
    assert_white_rim(figure)
    assert (pixels(figure) < 255).any(axis=2).mean() > 0.2


def test_creases_are_drawn_by_assignment(structure):
    figure = draw_structure(structure)
    pattern = structure.pattern
    for letter, name in (("M", "mountain crease"), ("V", "valley crease")):
        of_kind = [
            c for c, k in zip(pattern.creases, pattern.assignments, strict=True) if k == letter
        ]
        assert of_kind  # a Miura cell has both
        drawn = [c for c in figure.axes[0].collections if c.get_label() == name]
        assert len(drawn) == 1
        visible = _segments(figure, name)
        ends = structure.nodes[np.array(of_kind)]
        # Every visible piece lies on a crease of this kind.
        for p, q in visible:
            on = [
                np.allclose(np.linalg.norm(a - x) + np.linalg.norm(x - b), np.linalg.norm(b - a))
                for a, b in ends
                for x in (0.5 * (p + q),)
            ]
            assert any(on)
        assert name in keys(figure)
    assert style.CREASES["M"] != style.CREASES["V"]


def test_supports_name_the_held_directions(case):
    figure = draw_structure(case, numbers=False)
    assert sorted(_texts(figure)) == sorted(["xz", "xy", "xz", "z", "z"])
    assert "support (directions held)" in keys(figure)
    assert "0.01 N along +x on node 7" in keys(figure)
    bare = draw_structure(case, numbers=False, supports=False, loads=False)
    assert _texts(bare) == []
    assert not any("support" in key or " N " in key for key in keys(bare))


def test_load_arrow_points_along_the_force(structure):
    force = np.array([0.0, 3.0, 4.0])
    case = cases.Case(structure, loads=[cases.Force([4], tuple(force))])
    (((start, end),),) = shafts(draw_structure(case))
    np.testing.assert_allclose(start, structure.nodes[4])
    np.testing.assert_allclose((end - start) / np.linalg.norm(end - start), force / 5.0, atol=1e-12)


def test_gravity_is_one_arrow_at_the_center_of_mass(structure):
    gravity = cases.Gravity((0.0, 0.0, -9.81))
    figure = draw_structure(cases.Case(structure, loads=[gravity, cases.Force([7], (1, 0, 0))]))
    assert keys(figure)[-2:] == ["1 N along +x on node 7", "gravity 9.81 m/s2 along -z"]
    _, ((start, end),) = shafts(figure)
    mass = structure.mass.diagonal()
    np.testing.assert_allclose(start, mass @ structure.nodes / mass.sum())
    np.testing.assert_allclose(start[:2], end[:2], atol=1e-12)
    assert end[2] < start[2]
    hidden = draw_structure(cases.Case(structure, loads=[gravity]), loads=False)
    assert not any("gravity" in key for key in keys(hidden))
    slanted = draw_structure(cases.Case(structure, loads=[cases.Gravity((3.0, 0.0, -4.0))]))
    assert keys(slanted)[-1] == "gravity 5 m/s2 along (0.6, 0, -0.8)"


def test_deformed_sheet_over_the_undeformed(structure):
    u = np.zeros_like(structure.nodes)
    u[6:9, 0] = 0.1
    figure = draw_structure(structure, displacement=u, scale=2.0)
    assert keys(figure)[:2] == ["undeformed", "displacement times 2"]
    boundary = _segments(figure, "boundary").reshape(-1, 3)
    assert boundary[:, 0].max() == pytest.approx(structure.nodes[:, 0].max() + 0.2)


def test_elements_adds_the_inner_bars(structure):
    assert "bar inside a panel" not in keys(draw_structure(structure))
    figure = draw_structure(structure, elements=True)
    assert "bar inside a panel" in keys(figure)


def test_a_pattern_alone_can_be_drawn():
    figure = draw_structure(patterns.simple_fold(a=1.0, b=1.0, dihedral=60))
    assert _texts(figure) == [str(k) for k in range(6)]
    assert keys(figure) == ["boundary", "mountain crease"]


def test_flat_sheet():
    flat = patterns.Pattern([(0, 0), (2, 0), (2, 1), (0, 1)], [(0, 1, 2, 3)])
    figure = draw_structure(
        structures.discretize(flat, structures.Sheet(1e6, 0.3, 0.01), preset="plate")
    )
    low, high = figure.axes[0].get_zlim()
    assert low < 0.0 < high
    assert keys(figure) == ["boundary"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"displacement": np.zeros((9, 3))}, "13 nodes"),
        ({"displacement": np.full((13, 3), np.nan)}, "NaN"),
        ({"numbers": "some"}, "numbers"),
    ],
)
def test_bad_input(structure, arguments, words):
    with pytest.raises(InputError, match=words):
        draw_structure(structure, **arguments)


def test_directions_and_links_are_marked(structure):
    """A triangle with its tip at the node along each direction; a dotted line for each link."""
    normal = np.array([-1.0, 0.0, 2.0]) / np.sqrt(5.0)
    supports = [
        cases.Fix([0], "xyz"),
        cases.Fix([6, 8], direction=(-1, 0, 2)),
        cases.Impose([7], direction=(1, 0, -1), value=0.05),
        cases.Link([3, 5], axes="z"),
        cases.Link([12], to=[4, 5, 7]),
    ]
    case = cases.Case(structure, supports)
    figure = draw_structure(case)
    texts = keys(figure)
    assert "link (nodes tied together)" in texts
    assert "moved 0.05 m along (0.707, 0, -0.707) on node 7" in texts
    held = attachments.direction_triangles(case, cases.Fix, structure.nodes, 0.1, View())
    np.testing.assert_allclose(held[:, 0], structure.nodes[[6, 8]])
    inward = held[:, 0] - held[:, 1:].mean(axis=1)
    np.testing.assert_allclose(inward, np.tile(0.1 * normal, (2, 1)), atol=1e-12)
    pushed = attachments.direction_triangles(case, cases.Impose, structure.nodes, 0.1, View())
    pushes = (pushed[0, 0] - pushed[0, 1:].mean(axis=0)) / 0.1
    np.testing.assert_allclose(pushes, np.array([1.0, 0.0, -1.0]) / np.sqrt(2.0), atol=1e-12)
    (drawn,) = attachments.links(case, structure.nodes)
    assert len(drawn.lines[0]) == 1 + 3
    labels = [t.get_text() for t in plot_load_history(case, 1.0).legends[0].get_texts()]
    assert labels[0].startswith("moved 0.05 m along (0.707, 0, -0.707) on node 7")
