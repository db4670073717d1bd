"""Shells in figures: sheets that bend between their vertices, folds alone as laws, own energies."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.colors import to_hex
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection
from pictures import keys
from PIL import Image

import foldyn as fd
from foldyn.errors import InputError
from foldyn.plots import (
    animate,
    draw_modes,
    draw_shapes,
    draw_structure,
    energy_shares,
    plot_energies,
    plot_laws,
    plot_path_energies,
)
from foldyn.plots.scene import Sheet3D, View
from foldyn.plots.sheet import split_edges

ABOVE = View(elevation=90.0, azimuth=-90.0)
DIVISIONS = 3


@pytest.fixture(scope="module")
def case():
    """The simple fold of case study 1, its crease actuated."""
    pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60)
    sheet = fd.Sheet(1e6, 0.25, 0.01, density=1.0)
    shell = fd.shell(pattern, sheet, divisions=DIVISIONS)
    return fd.Case(
        shell,
        [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "z")],
        [fd.Force([0, 1], (-1e-3, 0, 0), fd.HalfSine(0.1)), fd.Actuate([0], 290)],
    )


@pytest.fixture(scope="module")
def path(case):
    return fd.trace(case, load_factors=[0.5, 1.0])


@pytest.fixture(scope="module")
def motion(case):
    pulled = fd.Case(case.structure, case.supports, case.loads[:1])
    return fd.simulate(pulled, 0.2, method="generalized_alpha", interval=0.02)


def lines(figure, label: str) -> list[np.ndarray]:
    """Segments of the lines with a label, as given."""
    found = [
        item
        for item in figure.axes[0].collections
        if isinstance(item, Line3DCollection) and item.get_label() == label
    ]
    return [np.asarray(segment) for item in found for segment in item._segments3d]


def test_edges_bend_with_the_sheet(case, path):
    u = path.displacement[-1].values
    u = u + np.sin(np.pi * case.structure.nodes[:, :1]) * [0.0, 0.0, 0.3]  # panels that bulge
    figure = draw_structure(case, displacement=u)
    nodes = (case.structure.nodes + u)[case.structure.edge_nodes]
    crease, *boundary = nodes
    (drawn,) = lines(figure, "mountain crease")
    assert np.abs(drawn[0] - crease[0]).max() < 1e-12
    points = np.concatenate(lines(figure, "boundary")).reshape(-1, 3)
    for edge in boundary:
        if np.abs(edge[1:-1, 1] - 0.0).max() < 0.2:  # the front, which nothing hides
            apart = np.linalg.norm(points[:, None] - edge[None], axis=2).min(axis=0)
            assert apart.max() < 1e-12
    assert keys(figure) == [
        "undeformed", "actuated crease", "boundary", "mountain crease",
        "support (directions held)", "0.001 N along -x on nodes 0, 1",
    ]  # fmt: skip


def test_panels_are_shaded_by_how_they_stand(case, path):
    figure = draw_structure(case, displacement=path.displacement[-1].values)
    panels = [
        item
        for item in figure.axes[0].collections
        if isinstance(item, Poly3DCollection) and item.get_zorder() in (0.9, 1.0)
    ]
    colors = {to_hex(color) for item in panels for color in item.get_facecolor()}
    assert len(colors) > 2  # two flat panels would have two
    assert all(item.get_linewidth() == 0 for item in panels)


def test_sides_of_triangles_on_request_only(case):
    assert "side of a triangle" not in keys(draw_structure(case))
    figure = draw_structure(case, elements=True)
    assert "side of a triangle" in keys(figure) and "bar inside a panel" not in keys(figure)
    sheet = Sheet3D.of(case)
    assert len(sheet.inner_bars) + len(sheet.pieces) == len(case.structure.bars)
    assert len(sheet.pieces) == DIVISIONS * 7  # a crease and six boundary edges


def test_vertices_alone_are_numbered(case):
    texts = [text.get_text() for text in draw_structure(case).axes[0].texts]
    assert [text for text in texts if text.isdigit()] == [str(k) for k in range(6)]


def test_a_bent_edge_is_one_line_until_a_panel_hides_it():
    # along y = 0.25 the triangle covers 0 < x < 0.75, one level above the edge
    vertices = np.array([(0.0, 0, 1), (1, 0, 1), (0, 1, 1)])
    line = np.array(
        [(-1, 0.25, 0), (-0.5, 0.25, 0.2), (0.0, 0.25, 0.2), (0.5, 0.25, 0), (1, 0.25, 0)]
    )
    points = np.concatenate([vertices, line])
    visible, hidden = split_edges(
        np.array([[3, 4, 5, 6, 7], [3, 3, 3, 3, 4]]), points, np.array([[0, 1, 2]]), ABOVE, 1.0
    )
    assert (visible.shape, hidden.shape) == ((3, 5, 3), (1, 3, 3))
    np.testing.assert_allclose(visible[0][:3], line[:3], atol=1e-12)
    np.testing.assert_allclose(visible[0][3:], line[[2, 2]], atol=1e-12)  # shorter than the others
    np.testing.assert_allclose(hidden[0][:, 0], [0.0, 0.5, 0.75], atol=0.5 / 6)
    np.testing.assert_allclose(visible[2][[0, -1]], line[:2], atol=1e-12)
    length = [np.linalg.norm(np.diff(part, axis=1), axis=2).sum() for part in (visible, hidden)]
    whole = np.linalg.norm(np.diff(line, axis=0), axis=1).sum()
    assert sum(length) == pytest.approx(whole + np.linalg.norm(line[1] - line[0]), rel=1e-12)


def test_laws_of_a_shell_are_those_of_its_folds(case):
    figure = plot_laws(case.structure)
    (axes,) = figure.axes
    assert axes.get_title() == "folds: enhanced"
    (label,) = [text.get_text() for text in axes.get_legend().get_texts()]
    stiffness = case.structure.fold_stiffness[0]
    assert label == f"fold 2-3: k {stiffness:.4g} N m/rad, rest 300°"


def test_a_shell_without_folds_has_no_laws():
    square = fd.Pattern([[0, 0], [1, 0], [1, 1], [0, 1]], [[0, 1, 2, 3]])
    with pytest.raises(InputError, match="without folds"):
        plot_laws(fd.shell(square, fd.Sheet(1e6, 0.25, 0.01), divisions=2))


@pytest.mark.matrix
def test_energies_of_a_motion(motion):
    figure = plot_energies(motion)
    upper, lower = figure.axes
    assert [line.get_label() for line in upper.get_lines()] == [
        "kinetic", "strain, membrane", "strain, bending", "strain, folds", "dissipated",
        "work of the loads",
    ]  # fmt: skip
    bending = upper.get_lines()[2].get_ydata()
    np.testing.assert_array_equal(bending, motion.strain_bending)
    parts = [motion[f"strain_{name}"] for name in ("membrane", "bending", "folds")]
    balance = motion.kinetic + sum(parts) + motion.dissipated - motion.work
    drawn = lower.get_lines()[0].get_ydata()
    np.testing.assert_allclose(drawn, balance - balance[0], atol=1e-18)


def test_energies_of_a_path(path):
    shares = energy_shares(path)
    assert list(shares) == ["membrane", "bending", "folds"]
    np.testing.assert_allclose(sum(shares.values())[1:], 1.0, rtol=1e-12)
    assert shares["membrane"][-1] < 0.01 < shares["bending"][-1]  # sheets bend, hardly stretch
    figure = plot_path_energies(path)
    assert set(keys(figure)) == {"membrane", "bending", "folds", "at the start + work done"}


@pytest.mark.matrix
def test_shapes_and_films(case, path, motion, tmp_path):
    assert len(draw_shapes(case, path, points=[0, -1]).axes) == 2
    with Image.open(animate(case, motion, path=tmp_path / "m.gif", frames=3)) as film:
        assert film.n_frames == 3
    modes = fd.modes(fd.Case(case.structure, case.supports), count=2)
    figure = draw_modes(fd.Case(case.structure, case.supports), modes)
    assert len(figure.axes) == 2
