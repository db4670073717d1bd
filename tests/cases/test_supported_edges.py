"""Supports along edges: the same words hold a shell and bars and hinges."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import foldyn as fd
from case_texts import MIURA_TEXT
from foldyn.analyses.reading import read_as
from foldyn.errors import FoldynWarning, InputError
from named_models import named

SHEET = fd.Sheet(2e11, 0.3, 1e-3, density=7850.0)
MIURA = fd.patterns.miura(cells=(2, 2), a=0.04, b=0.04, panel_angle=60, dihedral=110)
FOLD = fd.patterns.simple_fold(a=0.05, b=0.05, dihedral=120)
ALONG = fd.Fix("xmin", along=True)


def frequencies(structure, *supports, count=3):
    return fd.modes(fd.Case(structure, supports), count).frequency.values


def on_edges(shell, nodes):
    """Nodes of a shell on the edges between some vertices."""
    rows = shell.edge_nodes[np.isin(shell.edge_nodes[:, [0, -1]], nodes).all(axis=1)]
    return np.unique(rows)


@pytest.fixture(params=[None, 1e-3])
def shell(request):
    return fd.shell(MIURA, SHEET, divisions=4, vertex_radius=request.param)


@pytest.mark.matrix
def test_a_shell_is_held_on_the_whole_edge(shell):
    case = fd.Case(shell, [ALONG])
    held = on_edges(shell, np.flatnonzero(fd.Case(shell, [fd.Fix("xmin")]).fixed.all(axis=1)))
    assert len(held) > 10
    assert np.array_equal(np.flatnonzero(case.fixed.all(axis=1)), held)
    by_number = frequencies(shell, fd.Fix(held.tolist()))
    assert frequencies(shell, ALONG) == pytest.approx(by_number, rel=1e-9)
    assert (frequencies(shell, ALONG) > 1.001 * frequencies(shell, fd.Fix("xmin"))).all()


@pytest.mark.matrix
def test_axes_and_directions_say_the_same(shell):
    one = frequencies(shell, fd.Fix("xmin", "z", along=True), fd.Fix("xmin", "xy", along=True))
    assert one == pytest.approx(frequencies(shell, ALONG), rel=1e-9)
    by_direction = [fd.Fix("xmin", direction=axis, along=True) for axis in "xyz"]
    assert frequencies(shell, *by_direction) == pytest.approx(one, rel=1e-6)


@pytest.mark.parametrize("options", [{"direction": "z"}, {"axis": "z"}])
def test_a_moved_edge_is_linear_between_its_ends(options):
    s = fd.shell(FOLD, SHEET, divisions=4, vertex_radius=1e-3)
    low, high = sorted(np.flatnonzero(s.nodes[: len(FOLD.vertices), 0] < 1e-9).tolist())
    moved = fd.Impose([low, high], value=[0.0, 1e-4], along=True, **options)
    far = np.flatnonzero(np.isclose(s.nodes[: len(FOLD.vertices), 0], s.nodes[:, 0].max()))
    case = fd.Case(s, [moved, fd.Fix([low, high], "xy", along=True), fd.Fix(far.tolist(), "z")])
    u = fd.trace(case).displacement.values[-1]
    (row,) = s.edge_nodes[(s.edge_nodes[:, 0] == low) & (s.edge_nodes[:, -1] == high)]
    x = np.linalg.norm(s.nodes[row] - s.nodes[row[0]], axis=1)
    assert u[row, 2] == pytest.approx(1e-4 * x / x[-1], rel=1e-9, abs=1e-15)
    assert np.abs(u[row, :2]).max() < 1e-15


def test_a_base_shakes_the_whole_edge(shell):
    case = fd.Case(shell, [ALONG, fd.BaseMotion("z", fd.Harmonic(10.0))])
    ((moved, _),) = case.base_terms
    held = case.fixed.all(axis=1)
    assert held.sum() > 10
    assert np.array_equal(moved[:, 2], held.astype(float))


MODELS: dict[str, Any] = {
    "membrane": {"preset": "plate", "membrane": "panel", "bar_law": "linear"},
    "n5b8e": {"preset": "n5b8e", "membrane": "bars"},
    "both": {"preset": "n5b8e", "membrane": "panel", "bar_law": "linear"},
}


@pytest.mark.parametrize("name", sorted(MODELS))
def test_edges_of_bars_and_hinges_must_be_straight(name):
    bowed = fd.discretize(MIURA, SHEET, **named(MODELS[name]))
    with pytest.raises(InputError, match=r"supports\[0\].along: the edge \(0, 1\) may bow .* "
                       'make the structure with straight = "xmin"'):  # fmt: skip
        fd.Case(bowed, [ALONG])
    straight = fd.discretize(MIURA, SHEET, **named(MODELS[name]), straight="xmin")
    held = frequencies(straight, ALONG)
    assert np.array_equal(held, frequencies(straight, fd.Fix("xmin")))
    assert (held >= frequencies(bowed, fd.Fix("xmin"))).all()
    paper = fd.discretize(MIURA, SHEET, preset="herkal")  # always straight
    one, other = (fd.Case(paper, [support]) for support in (ALONG, fd.Fix("xmin")))
    assert np.array_equal(one.fixed, other.fixed)


@pytest.mark.matrix
def test_a_shell_and_bars_and_hinges_agree():
    shell = fd.shell(MIURA, SHEET, divisions=8, mass="consistent", vertex_radius=1e-3)
    reduced = fd.discretize(MIURA, SHEET, **named(MODELS["both"]), straight="xmin")
    assert frequencies(reduced, ALONG) == pytest.approx(frequencies(shell, ALONG), rel=0.05)


def bare():
    """A structure without a pattern."""
    made = fd.discretize(FOLD, SHEET, preset="plate")
    return fd.Structure(made.nodes, made.bars, made.bar_area, SHEET)


CREASE = FOLD.creases[0].tolist()
NONE = r"along: no edge .* nodes = \[0, 8\]; name them"


@pytest.mark.parametrize(
    ("make", "nodes", "text"),
    [
        (
            lambda: fd.discretize(FOLD, SHEET, **named(MODELS["both"])),
            CREASE,
            "the crease .* take a shell",
        ),
        (lambda: fd.shell(MIURA, SHEET, divisions=4), [0, 8], NONE),
        (bare, [0, 1], "along: this structure has no pattern with edges"),
    ],
)
def test_refusals(make, nodes, text):
    with pytest.raises(InputError, match=text):
        fd.Case(make(), [fd.Fix(nodes, along=True)])
    with pytest.raises(InputError, match='along = "yes": must be True or False'):
        fd.Fix([0, 1], along="yes")  # pyright: ignore[reportArgumentType]
    held = fd.Case(fd.shell(FOLD, SHEET, divisions=4), [fd.Fix(CREASE, along=True)])
    assert held.fixed.sum() == 15


# ------------------------------------------------------------------ case files and comparisons

TEXT = f"""{MIURA_TEXT}[model]
MODEL
[[supports]]
nodes = "xmin"
along = true
[analysis]
kind = "modes"
count = 2
"""
SHELL = 'kind = "shell"\ndivisions = 4\n'


@pytest.mark.parametrize("model", ['preset = "n5b8e"', 'membrane = "panel"', 'preset = "herkal"'])
def test_case_files_make_held_edges_straight(read, model):
    case = read(TEXT.replace("MODEL", model)).case()
    bowed = "herkal" not in model
    assert case.structure.options.straight == (((0, 1), (1, 2)) if bowed else ())
    assert not {(0, 1), (1, 2)} & set(case.structure.bowed_edges)
    shell = read(TEXT.replace("MODEL", model), "shell", 4).case()
    assert len(np.flatnonzero(shell.fixed.all(axis=1))) == 9
    assert shell.supports == case.supports


def test_case_files_guide_edges_held_along_one_axis(read):
    text = TEXT.replace("MODEL", 'preset = "n5b8e"').replace("along =", 'axes = "x"\nalong =')
    options = read(text).case().structure.options
    assert options.guided == ((0, 1, "x"), (1, 2, "x")) and options.straight == ()
    stiff = text.replace('"n5b8e"', '"n5b8e"\nstraight = "xmin"')
    assert read(stiff).case().structure.options.straight == ((0, 1), (1, 2))
    assert read(stiff).case().structure.options.guided == ()


def test_what_a_case_file_names_stays(read):
    case = read(TEXT.replace("MODEL", 'preset = "n5b8e"\nstraight = [[0, 3]]')).case()
    assert case.structure.options.straight == ((0, 3), (0, 1), (1, 2))
    graded = TEXT.replace("MODEL", SHELL + "vertex_radius = 0.01")
    made = read(graded).case().structure
    assert made.options.vertex_radius == made.graded.radius == 0.01
    other = read(graded, "bars_and_hinges").case().structure
    assert not hasattr(other.options, "vertex_radius")


def test_files_read_as_small_vibrations_keep_it(tmp_path):
    moved = """[[supports]]
nodes = "xmax"
axis = "x"
displacement = 1e-3
along = true
[analysis]
kind = "statics"
"""
    text = TEXT.replace("MODEL", SHELL)
    (tmp_path / "case.toml").write_text(text[: text.index("[analysis]")] + moved)
    with pytest.warns(FoldynWarning, match=r"the displacement of supports\[1\]"):
        case = read_as(tmp_path / "case.toml", "modes", {"state": "rest"}).case()
    assert case.supports == (ALONG, fd.Fix("xmax", "x", along=True))


@pytest.mark.matrix
def test_stored_cases_keep_it(kept):
    shell = fd.shell(FOLD, SHEET, divisions=4, vertex_radius=1e-3)
    again = kept(fd.modes(fd.Case(shell, [ALONG]), 2))
    assert again.supports == (ALONG,) and again.structure.options.vertex_radius == 1e-3


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
def test_models_that_stand_beside_the_own_one_hold_it_too():
    case = fd.Case(fd.discretize(FOLD, SHEET, preset="plate", membrane="bars"), [ALONG])
    result = fd.fidelity(
        case, count=2, reference="shell", divisions=(2, 4), models=["n5b8e", "bars"]
    )
    assert np.abs(result.result["error"].values).max() < 0.2
