"""Total forces, line loads, pressure and crease moments: shares, checks, files, storage."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import foldyn as fd
from case_texts import HELD_MIURA_TEXT
from foldyn.errors import FoldynWarning, InputError
from pairwise import beyond

SHEET = fd.Sheet(1e6, 0.25, 0.01, 1.0)
MIURA = fd.patterns.miura(cells=(2, 1), a=1.0, b=1.3, panel_angle=60, dihedral=60)
TOTAL = np.array([1.0, -2.0, 3.0])
CASE = f"""{HELD_MIURA_TEXT}[analysis]
kind = "statics"
load_factors = [1]
[model]
{{model}}
[[loads]]
{{load}}
"""


def bars(pattern=MIURA, scheme="n5b8"):
    return fd.discretize(pattern, SHEET, scheme=scheme)


def triangles(pattern=MIURA):
    return bars(pattern, "n4b5")


def shell(pattern=MIURA):
    return fd.shell(pattern, SHEET, divisions=3)


MODELS = [bars, triangles, shell]


def forces(s, load):
    ((found, _),) = fd.Case(s, loads=[load]).force_terms
    return found


@pytest.mark.parametrize("make", MODELS)
def test_a_total_force_is_the_sum_of_its_parts(make) -> None:
    s = make()
    for place in ({"nodes": "xmax"}, {"edges": "xmax"}, {"panels": "all"}, {"panels": [0, 2]}):
        found = forces(s, fd.TotalForce(TOTAL, **place))
        np.testing.assert_allclose(found.sum(axis=0), TOTAL, rtol=1e-14)


@pytest.mark.parametrize("make", MODELS)
def test_vertices_share_by_the_area_that_belongs_to_them_whatever_the_model(make) -> None:
    s = make()
    row = fd.patterns.select(MIURA, "xmax")
    found = forces(s, fd.TotalForce((0, 0, 4.0), nodes="xmax"))[:, 2]
    # of panels that are all alike, the end vertices touch one and the middle one touches two
    np.testing.assert_allclose(found[row], [1.0, 2.0, 1.0], rtol=1e-12)
    assert np.flatnonzero(found).tolist() == row.tolist()
    found = forces(s, fd.TotalForce((0, 0, 4.0), nodes=[12, 14]))[:, 2]
    np.testing.assert_allclose(found[[12, 14]], 2.0, rtol=1e-12)


@pytest.mark.parametrize("make", MODELS)
def test_edges_and_panels_have_the_moment_of_the_even_distribution(make) -> None:
    s, x = make(), MIURA.vertices
    edges, panels = [(0, 1), (1, 2), (4, 7)], [1, 2]
    ends = x[np.array(edges)]
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    middles = np.array([x[list(MIURA.faces[k])].mean(axis=0) for k in panels])  # parallelograms
    for place, weights, points in (
        ({"edges": edges}, lengths, ends.mean(axis=1)),
        ({"panels": panels}, MIURA.face_areas[panels], middles),
    ):
        found = forces(s, fd.TotalForce(TOTAL, **place))
        moment = np.cross(weights @ points / weights.sum(), TOTAL)
        np.testing.assert_allclose(np.cross(s.nodes, found).sum(axis=0), moment, atol=1e-13)
    line = forces(s, fd.LineLoad(edges, TOTAL))
    total = forces(s, fd.TotalForce(TOTAL, edges=edges))
    np.testing.assert_allclose(line, total * lengths.sum(), atol=1e-13)


def test_a_selection_means_edges_of_which_it_has_both_ends() -> None:
    points = [[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]]
    s = fd.shell(fd.Pattern(points, [[0, 1, 4, 3], [1, 2, 5, 4]]), SHEET, divisions=4)
    found = forces(s, fd.LineLoad("ymax", (0, 0, 1.0)))[:, 2]
    on = np.abs(s.nodes[:, 1] - 1.0) < 1e-9
    assert (found[on] > 0.0).all() and not found[~on].any()
    np.testing.assert_allclose(np.unique(found[on].round(12)), [0.125, 0.25])
    assert fd.TotalForce((0, 0, 1), edges="ymax").edges == "ymax"
    assert fd.LineLoad([[4, 3]], (0, 0, 1)).edges == ((3, 4),)


UP = "[0.0, 0.0, 1e-3]"
EDGES = [[6, 7], [7, 8]]
LOADS = [
    (f'total = {UP}\nnodes = "xmax"', fd.TotalForce((0, 0, 1e-3), nodes="xmax")),
    (f"total = {UP}\nedges = {EDGES}", fd.TotalForce((0, 0, 1e-3), edges=EDGES)),
    (f"total = {UP}\npanels = [2, 3]", fd.TotalForce((0, 0, 1e-3), panels=[2, 3])),
    (f'edges = "xmax"\nper_length = {UP}', fd.LineLoad("xmax", (0, 0, 1e-3))),
    ("pressure = -1e-3", fd.Pressure(-1e-3)),
    ("pressure = 1e-3\npanels = [2, 3]", fd.Pressure(1e-3, [2, 3])),
    ('creases = "valley"\nmoment = 1e-3', fd.CreaseMoment("valley", 1e-3)),
    ("creases = [0, 3]\nmoment = [1e-3, -2e-3]", fd.CreaseMoment([0, 3], [1e-3, -2e-3])),
]
SHELL = 'kind = "shell"\ndivisions = 2\nfold_law = "linear"'


@pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
@pytest.mark.parametrize(
    ("model", "text", "load"),
    [*(("", *row) for row in LOADS), *beyond([(SHELL, *row) for row in LOADS], 4)],
)
def test_case_files_and_results_hold_them(text, load, model, read, kept) -> None:
    case_file = read(CASE.format(model=model, load=text))
    assert case_file.case().loads == (load,)
    found = case_file.run()
    again = kept(found)
    assert again.loads == (load,)
    same = fd.trace(again, load_factors=[1])
    np.testing.assert_array_equal(same.displacement, found.displacement)
    assert np.abs(found.displacement).max() > 1e-6


@pytest.mark.matrix
def test_a_motion_keeps_their_histories(kept) -> None:
    loads = [fd.Pressure(1e-3, [2, 3], fd.Ramp(0.1)), fd.CreaseMoment([0], 1e-3, fd.Pulse(0.02))]
    motion = fd.simulate(
        fd.Case(bars(), [fd.Fix("xmin", "xyz")], loads), 0.05, method="rk4", interval=0.05
    )
    assert kept(motion).loads == tuple(loads)
    assert float(motion.work[-1]) != 0.0


ALONG = "per_length = [0, 0, 1]\n"
HOLD = "[[supports]]\nnodes = [0, 1, 2, 3, 4, 5, 9, 11]"  # all of the panel 0, and around crease 0
BAD = [
    (
        'total = [0, 0, 1]\nnodes = "xmax"\nedges = "xmax"',
        r"\.total: give one of nodes, edges and panels; 2 are given, nodes and edges",
    ),
    ("total = [0, 0, 1]", r"\.total: give one of nodes, edges and panels; none is given"),
    ("total = [0, 0, 1]\nedges = [[0, 8]]", r"\.edges = .*: the pattern has no edge .* 0 to 8"),
    (f"{ALONG}edges = [[0, 1, 2]]", r"\.edges\[0\] = \[0, 1, 2\]: give pairs of vertices"),
    (f"{ALONG}edges = [[0, 1], [1, 0]]", r"\.edges\[1\] = \[1, 0\]: is listed twice"),
    (f'{ALONG}edges = "xmax and ymin"', r'\.edges = "xmax and ymin": selects no edge'),
    (f'{ALONG}edges = "xmin"', r": the force per length .* acts only where supports hold"),
    ('edges = "xmax"\nper_lenght = [0, 0, 1]', "mean 'per_length'"),
    (
        "pressure = 1.0\npanels = [4]",
        r"\.panels = \[4\]: panel 4 is out of range; .* panels 0 to 3",
    ),
    ('pressure = 1.0\npanels = "some"', r'\.panels = "some": give panel numbers'),
    (
        'pressure = 1.0\nforce = [0, 0, 1]\nnodes = "xmax"',
        r"\.pressure: a pressure acts on panels; leave out force and nodes",
    ),
    ('pressure = "1 bar"', r"\.pressure = \"1 bar\""),
    ("creases = [0, 1, 2]\nmoment = [1.0, 2.0]", r"\.moment = .*: 2 values for 3 creases"),
    ("creases = [99]\nmoment = 1.0", r"\.creases = \[99\]: crease 99 is out of range"),
    ("creases = [0]\nangle = 90\nmoment = 1.0", "leave out angle"),
    (
        f"pressure = 1.0\npanels = [0]\n{HOLD}",
        r"\.panels = \[0\]: supports hold all nodes of these",
    ),
    (
        f"creases = [0]\nmoment = 1.0\n{HOLD}",
        r"\.creases = \[0\]: supports hold the panels on both sides of crease 0",
    ),
]


@pytest.mark.parametrize(("text", "message"), BAD)
def test_bad_loads_are_refused(text, message, read) -> None:
    where = "" if "mean" in message or "leave out angle" in message else r"loads\[0\]"
    with pytest.raises(InputError, match=where + message):
        read(CASE.format(model='preset = "plate"', load=text)).case()


def test_centers() -> None:
    """They get a third of their panel, and have no area of their own."""
    s = bars()
    found = forces(s, fd.TotalForce((0, 0, 1.0), panels=[3]))[:, 2]
    assert found[s.centers[3]] == pytest.approx(1.0 / 3.0)
    with pytest.raises(InputError, match=r"nodes = \[0, 15\]: no part .* belongs to node 15"):
        fd.Case(s, loads=[fd.TotalForce((0, 0, 1), nodes=[0, 15])])


def test_forces_on_nodes_that_are_held_in_part_are_warned_of() -> None:
    s = bars()
    held = [fd.Fix([12], "z"), fd.Fix("xmin", "xyz")]
    with pytest.warns(FoldynWarning, match=r"acts in part where supports hold .*: 12 \(z\)"):
        fd.Case(s, held, [fd.TotalForce((0, 0, 1), nodes="xmax")])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fd.Case(s, held, [fd.TotalForce((0, 0, 1), panels="all")])
    with pytest.raises(InputError, match="acts only where supports hold"):
        fd.Case(s, held, [fd.TotalForce((0, 0, 1), nodes="xmin")])


def test_nodes_shown_where_a_file_names_none() -> None:
    s = shell()
    assert fd.Case(s, loads=[fd.LineLoad("xmax", TOTAL)]).loaded_nodes.tolist() == [12, 13, 14]
    assert not fd.Case(s, loads=[fd.Pressure(1.0)]).loaded_nodes.size
