"""Mode shapes side by side and in motion, and MAC matrices: the data in them."""

from __future__ import annotations

import numpy as np
import pytest
from mpl_toolkits.mplot3d.art3d import Line3DCollection
from pictures import assert_white_rim, frames, keys

import foldyn as fd
from foldyn import cases, patterns, structures
from foldyn.errors import InputError
from foldyn.plots import animate_modes, draw_modes, plot_mac
from foldyn.plots.modes import describe_mode
from foldyn.plots.readings import chosen_modes
from foldyn.plots.scene import Sheet3D
from foldyn.plots.sheet import DrawnSheet
from foldyn.results import modes_dataset

EIGENVALUE = np.array([0.0, -4.0, 0.0, (2 * np.pi * 3.8) ** 2, (2 * np.pi * 12.0) ** 2])
RIGID = np.array([True, False, False, False, False])
RATIO = np.array([np.nan, np.nan, np.nan, 0.135, 0.0])


def made(case, state=None, eigenvalue=EIGENVALUE, rigid=RIGID, ratio=RATIO):
    """Modes in which node 7 goes along x, 6 along y, 8 along z, all of them, and node 7 alone."""
    nodes = len(case.structure.nodes)
    shape = np.zeros((5, nodes, 3))
    shape[0, 7, 0] = shape[1, 6, 1] = shape[2, 8, 2] = 2.0
    shape[3] = 0.5
    shape[3, 7] = [0.5, 0.5, 0.0]
    shape[4, 7, 2] = -30.0
    with np.errstate(invalid="ignore"):
        frequency = np.sqrt(eigenvalue) / (2 * np.pi)
    values = {
        "frequency": frequency,
        "eigenvalue": eigenvalue,
        "shape": shape,
        "rigid": rigid,
        "rigid_share": rigid.astype(float),
        "damping_ratio": ratio,
        "participation": np.zeros((5, 3)),
        "effective_mass": np.zeros((5, 3)),
        "displacement": np.zeros((nodes, 3)) if state is None else state,
    }
    return modes_dataset(case, values, {"state": "rest"})


@pytest.fixture
def modes(case):
    return made(case)


def drawn(axes):
    """Boundary of the sheet in front and of the gray one behind it, corners (k, 3) of each."""
    lines = [c for c in axes.collections if isinstance(c, Line3DCollection)]
    (front,) = [line for line in lines if line.get_label() == "boundary"]
    gray = min(lines, key=lambda line: line.get_zorder())
    corners = [np.round(np.reshape(line._segments3d, (-1, 3)), 9) for line in (front, gray)]
    return [set(map(tuple, each.tolist())) for each in corners]


def texts(figure):
    return [text.get_text() for text in figure.texts]


def test_a_picture_shows_the_shape_over_the_sheet_at_rest(case, modes):
    figure = draw_modes(case, modes, which=[5, 1], amplitude=0.1, names={5: "node 7 goes down"})
    rest = case.structure.nodes
    assert texts(figure) == ["mode 5: 12.00 Hz\nnode 7 goes down", "mode 1: rigid motion"]
    for axes, way in zip(figure.axes, ([0, 0, -0.1], [0.1, 0, 0]), strict=True):
        front, gray = drawn(axes)
        assert tuple(np.round(rest[7] + way, 9).tolist()) in front
        assert tuple(np.round(rest[7], 9).tolist()) not in front
        assert {tuple(np.round(rest[k], 9).tolist()) for k in (0, 6, 7, 8)} <= gray
    assert keys(figure)[0] == "undeformed"


def test_modes_about_a_state_are_drawn_over_it(case):
    state = np.zeros((len(case.structure.nodes), 3))
    state[8] = [0.0, 0.2, 0.0]
    figure = draw_modes(case, made(case, state), which=[5], amplitude=0.1)
    front, gray = drawn(figure.axes[0])
    moved = tuple(np.round(case.structure.nodes[8] + state[8], 9).tolist())
    assert moved in gray and moved in front
    assert keys(figure)[0] == "equilibrium"


def test_the_scale_is_one_at_which_shapes_can_be_read(case):
    """12 % of the sheet where all nodes move, less where one of them leaves its neighbors."""
    large = structures.discretize(
        patterns.miura(cells=(4, 4)), case.structure.sheet, preset="plate"
    )
    modes = made(cases.Case(large))
    modes["shape"][3] = [0.0, 0.5, 0.0]
    figure = draw_modes(large, modes, which=[4, 5])
    whole, alone = (drawn(axes)[0] for axes in figure.axes)
    rest, size = large.nodes, Sheet3D.of(large).size
    assert tuple(np.round(rest[7] + [0.0, 0.12 * size, 0.0], 9).tolist()) in whole
    assert tuple(np.round(rest[7] - [0.0, 0.0, 0.2], 9).tolist()) in alone  # spokes of 0.5 m
    assert size * 0.12 > 0.9


def test_captions_tell_what_a_mode_is(modes):
    assert describe_mode(modes, 1) == "mode 1: rigid motion"
    assert describe_mode(modes, 2) == "mode 2: unstable, grows e-fold in 0.5 s"
    assert describe_mode(modes, 3) == "mode 3: 0 Hz, nothing resists it"
    assert describe_mode(modes, 4) == "mode 4: 3.800 Hz, damping 13.5 %"
    assert describe_mode(modes, 4, "axial") == "mode 4: 3.800 Hz, damping 13.5 %\naxial"


def test_rigid_modes_are_left_out_unless_asked_for(case, modes):
    assert chosen_modes(modes, None) == [2, 3, 4, 5]
    assert chosen_modes(modes, [1, 4]) == [1, 4]
    assert chosen_modes(made(case, rigid=np.ones(5, bool)), None) == [1, 2, 3, 4, 5]


@pytest.mark.matrix
@pytest.mark.parametrize("count", [1, 2, 4, 5])
def test_captions_of_two_lines_have_room(case, modes, count):
    names = {k: "first bending along y (93 %)" for k in range(1, 6)}
    figure = draw_modes(case, modes, which=list(range(1, count + 1)), names=names, title="Modes")
    assert_white_rim(figure)
    boxes = [text.get_window_extent() for text in figure.texts]
    boxes.append(figure.legends[0].get_window_extent())
    assert not any(a.overlaps(b) for k, a in enumerate(boxes) for b in boxes[:k])


@pytest.fixture(scope="module")
def cantilever():
    """A long sheet held at one end, and its modes: what they do is found from their shapes."""
    sheet = structures.Sheet(1e6, 0.25, 0.01, density=1.0)
    pattern = patterns.miura(cells=(5, 1), dihedral=120)
    structure = structures.discretize(pattern, sheet, bend_law="linear", fold_law="linear")
    case = cases.Case(structure, [cases.Fix("xmin")], damping=cases.Rayleigh(alpha=0.1))
    return case, fd.linear.modes(case, count=4)


@pytest.mark.matrix
def test_what_modes_do_is_told_with_its_share(cantilever):
    case, modes = cantilever
    character = fd.linear.character(modes, "x")
    figure = draw_modes(case, modes)
    assert texts(figure) == texts(draw_modes(case.structure, modes, names=character))
    for text, name, share, frequency in zip(
        texts(figure),
        character["name"].values,
        character["share"].max("kind").values,
        modes["frequency"].values,
        strict=True,
    ):
        first, second = text.split("\n")
        assert second == f"{name} ({100 * share:.0f} %)"
        assert float(first.split()[2]) == pytest.approx(frequency, rel=1e-3)
        ratio = 0.1 / (4 * np.pi * frequency)  # alpha / (2 w)
        assert float(first.split()[5]) == pytest.approx(100 * ratio, rel=1e-2)


@pytest.mark.matrix
def test_a_film_is_a_period_without_a_seam(case, modes, tmp_path, monkeypatch):
    positions = []
    monkeypatch.setattr(DrawnSheet, "move", lambda _, points: positions.append(points))
    file = animate_modes(
        case, modes, path=tmp_path / "modes.gif", which=[4, 5], amplitude=0.1, frames=8
    )
    assert file.exists()
    rest = case.structure.nodes
    first, second = positions[::2], positions[1::2]
    assert len(first) == len(second) == 8
    for k, (a, b) in enumerate(zip(first, second, strict=True)):
        swing = 0.1 * np.cos(2 * np.pi * k / 8)
        np.testing.assert_allclose(b[7], rest[7] + [0, 0, -swing], atol=1e-12)
        np.testing.assert_allclose(np.linalg.norm(a - rest, axis=1).max(), abs(swing), atol=1e-12)


@pytest.mark.matrix
def test_a_film_shows_both_extremes_within_its_frame(case, modes, tmp_path):
    file = animate_modes(case, modes, path=tmp_path / "modes.gif", which=[4, 5], frames=4, fps=10)
    pictures = frames(file)
    for picture in pictures:
        assert picture.shape[1] == 600
        assert_white_rim(picture)
    assert np.abs(pictures[0] - pictures[2]).max() > 100


def test_a_mac_matrix_has_its_values_and_labels():
    values = np.array([[1.0, 0.004, 0.25], [0.0, 0.997, 0.5]])
    figure = plot_mac(
        values,
        ["4 Hz", "9 Hz"],
        columns=["a", "b", "c"],
        row_title="shell",
        column_title="bars",
        title="MAC",
    )
    axes, bar = figure.axes
    np.testing.assert_array_equal(axes.images[0].get_array(), values)
    assert [t.get_text() for t in axes.get_yticklabels()] == ["4 Hz", "9 Hz"]
    assert [t.get_text() for t in axes.get_xticklabels()] == ["a", "b", "c"]
    assert (axes.get_ylabel(), axes.get_xlabel()) == ("shell", "bars")
    cells = {t.get_position()[::-1]: t.get_text() for t in axes.texts}
    assert cells[0, 0] == "1.00" and cells[0, 1] == "0" and cells[1, 2] == "0.50"
    assert axes.images[0].get_clim() == (0.0, 1.0)
    assert bar.get_ylabel() == "MAC"
    down, across = np.array(axes.images[0].get_extent())[[3, 0]]
    assert (down, across) == (-0.5, -0.5)  # the first mode of both at the top left


def test_a_large_mac_matrix_has_no_numbers():
    figure = plot_mac(np.eye(17))
    assert not figure.axes[0].texts
    assert [t.get_text() for t in figure.axes[0].get_xticklabels()][:2] == ["1", "2"]


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda case, modes: draw_modes(case, modes, which=[]), "which: empty"),
        (
            lambda case, modes: draw_modes(case, modes, which=[6]),
            "which: 6; there are modes 1 to 5",
        ),
        (
            lambda case, modes: draw_modes(case, modes, which=[0]),
            "which: 0; there are modes 1 to 5",
        ),
        (
            lambda case, modes: draw_modes(case, modes, which=[1] * 13),
            "13 modes; one figure shows at",
        ),
        (lambda case, modes: draw_modes(case, modes, amplitude=0.0), "amplitude = 0.0: must be"),
        (lambda case, modes: draw_modes(case, modes.isel(node=slice(9)), names={}), "9 nodes, the"),
        (lambda case, modes: draw_modes(case, modes.drop_vars("shape")), "has no shape"),
        (lambda case, modes: plot_mac([1.0]), "shape .1,.; give a matrix"),
        (lambda case, modes: plot_mac([[1.5]]), "not between 0 and 1"),
        (lambda case, modes: plot_mac([[1.0]], rows=["a", "b"]), "rows: 2 labels for 1 modes"),
    ],
)
def test_bad_input(case, modes, call, words):
    with pytest.raises(InputError, match=words):
        call(case, modes)


def test_bad_films(case, modes, tmp_path):
    with pytest.raises(InputError, match=r"\.gif or \.mp4"):
        animate_modes(case, modes, path=tmp_path / "modes.avi")
    with pytest.raises(InputError, match="frames = 1"):
        animate_modes(case, modes, path=tmp_path / "modes.gif", frames=1)
    assert not list(tmp_path.iterdir())


@pytest.mark.matrix
def test_modes_bring_their_case(case, modes, tmp_path):
    """By its place or its name, with the other arguments behind it as they are."""
    expected = draw_modes(case, modes, which=[5, 1], amplitude=0.1)
    for figure in (
        draw_modes(modes, which=[5, 1], amplitude=0.1),
        draw_modes(modes=modes, which=[5, 1], amplitude=0.1),
        draw_modes(modes=modes, case_or_structure=case, which=[5, 1], amplitude=0.1),
    ):
        assert texts(figure) == texts(expected)
        for axes, own in zip(figure.axes, expected.axes, strict=True):
            assert drawn(axes) == drawn(own)
    film = animate_modes(modes, tmp_path / "m.gif", which=[5], frames=2)
    assert (
        film.read_bytes()
        == animate_modes(case, modes, path=tmp_path / "n.gif", which=[5], frames=2).read_bytes()
    )
    with pytest.raises(InputError, match="case_or_structure = 3: give a case, a structure"):
        draw_modes(3, modes)
