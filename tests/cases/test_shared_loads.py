"""Total forces, line loads, pressure and crease moments: shares, checks, files, storage."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import FoldynWarning, InputError

SHEET = fd.Sheet(1e6, 0.25, 0.01, 1.0)
MIURA = fd.patterns.miura(cells=(2, 1), a=1.0, b=1.3, panel_angle=60, dihedral=60)
TOTAL = np.array([1.0, -2.0, 3.0])
CASE = """
[pattern]
kind = "miura"
[sheet]
youngs_modulus = 1e6
poissons_ratio = 0.25
thickness = 0.01
density = 2.0
[model]
{model}
[[supports]]
nodes = "xmin"
[[loads]]
{load}
[analysis]
kind = "statics"
load_factors = [1]
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


def moment(x, force):
    return np.cross(x, force).sum(axis=0)


@pytest.mark.parametrize("make", MODELS)
def test_a_total_force_is_the_sum_of_its_parts(make) -> None:
    s = make()
    for place in ({"nodes": "xmax"}, {"edges": "xmax"}, {"panels": "all"}, {"panels": [0, 2]}):
        found = forces(s, fd.TotalForce(TOTAL, **place))
        np.testing.assert_allclose(found.sum(axis=0), TOTAL, rtol=1e-14)


@pytest.mark.parametrize("make", MODELS)
def test_vertices_share_by_the_area_that_belongs_to_them_whatever_the_model(make) -> None:
    s = make()
    row = fd.cases.select(MIURA, "xmax")
    found = forces(s, fd.TotalForce((0, 0, 4.0), nodes="xmax"))[:, 2]
    # of panels that are all alike, the end vertices touch one and the middle one touches two
    np.testing.assert_allclose(found[row], [1.0, 2.0, 1.0], rtol=1e-12)
    assert np.flatnonzero(found).tolist() == row.tolist()
    found = forces(s, fd.TotalForce((0, 0, 4.0), nodes=[12, 14]))[:, 2]
    np.testing.assert_allclose(found[[12, 14]], 2.0, rtol=1e-12)


@pytest.mark.parametrize("make", MODELS)
def test_edges_and_panels_have_the_moment_of_the_even_distribution(make) -> None:
    s, x = make(), MIURA.vertices
    edges = [(0, 1), (1, 2), (4, 7)]
    lengths = np.array([np.linalg.norm(x[b] - x[a]) for a, b in edges])
    middles = np.array([0.5 * (x[a] + x[b]) for a, b in edges])
    center = lengths @ middles / lengths.sum()
    found = forces(s, fd.TotalForce(TOTAL, edges=edges))
    np.testing.assert_allclose(moment(s.nodes, found), np.cross(center, TOTAL), atol=1e-13)
    line = forces(s, fd.LineLoad(edges, TOTAL))
    np.testing.assert_allclose(line, found * lengths.sum(), atol=1e-13)
    panels = [1, 2]
    areas = MIURA.face_areas[panels]
    middles = np.array([x[list(MIURA.faces[k])].mean(axis=0) for k in panels])  # parallelograms
    center = areas @ middles / areas.sum()
    found = forces(s, fd.TotalForce(TOTAL, panels=panels))
    np.testing.assert_allclose(moment(s.nodes, found), np.cross(center, TOTAL), atol=1e-13)


def test_a_selection_means_edges_of_which_it_has_both_ends() -> None:
    flat = fd.Pattern(
        [[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]], [[0, 1, 4, 3], [1, 2, 5, 4]]
    )
    s = fd.shell(flat, SHEET, divisions=4)
    found = forces(s, fd.LineLoad("ymax", (0, 0, 1.0)))[:, 2]
    on = np.abs(s.nodes[:, 1] - 1.0) < 1e-9
    assert (found[on] > 0.0).all()
    assert not found[~on].any()
    np.testing.assert_allclose(np.unique(found[on].round(12)), [0.125, 0.25])
    assert fd.TotalForce((0, 0, 1), edges="ymax").edges == "ymax"
    assert fd.LineLoad([[4, 3]], (0, 0, 1)).edges == ((3, 4),)


def test_center_nodes_get_a_third_of_their_panel() -> None:
    s = bars()
    found = forces(s, fd.TotalForce((0, 0, 1.0), panels=[3]))[:, 2]
    assert found[s.centers[3]] == pytest.approx(1.0 / 3.0)


LOADS = {
    "total force on nodes": (
        'total = [0.0, 0.0, 1e-3]\nnodes = "xmax"', fd.TotalForce((0, 0, 1e-3), nodes="xmax")
    ),
    "total force on edges": (
        "total = [0.0, 0.0, 1e-3]\nedges = [[6, 7], [7, 8]]",
        fd.TotalForce((0, 0, 1e-3), edges=[[6, 7], [7, 8]]),
    ),
    "total force on panels": (
        "total = [0.0, 0.0, 1e-3]\npanels = [2, 3]", fd.TotalForce((0, 0, 1e-3), panels=[2, 3])
    ),
    "line load": (
        'edges = "xmax"\nper_length = [0.0, 0.0, 1e-3]', fd.LineLoad("xmax", (0, 0, 1e-3))
    ),
    "pressure": ("pressure = -1e-3", fd.Pressure(-1e-3)),
    "pressure on panels": ("pressure = 1e-3\npanels = [2, 3]", fd.Pressure(1e-3, [2, 3])),
    "crease moment": (
        'creases = "valley"\nmoment = 1e-3', fd.CreaseMoment("valley", 1e-3)
    ),
    "crease moments": (
        "creases = [0, 3]\nmoment = [1e-3, -2e-3]", fd.CreaseMoment([0, 3], [1e-3, -2e-3])
    ),
}  # fmt: skip


@pytest.mark.parametrize("model", ["", 'kind = "shell"\ndivisions = 2\nfold_law = "linear"'])
@pytest.mark.parametrize("name", LOADS)
def test_case_files_and_results_hold_them(name, model, tmp_path) -> None:
    text, load = LOADS[name]
    path = tmp_path / "case.toml"
    path.write_text(CASE.format(model=model, load=text))
    case = fd.read_case(path).case()
    assert case.loads == (load,)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)
        found = fd.read_case(path).run()
        fd.save(found, tmp_path / "result.nc")
        again = fd.case_of(fd.load(tmp_path / "result.nc"))
        assert again.loads == (load,)
        np.testing.assert_array_equal(
            fd.trace(again, load_factors=[1]).displacement, found.displacement
        )
    assert np.abs(found.displacement).max() > 1e-6


def test_a_motion_keeps_their_histories(tmp_path) -> None:
    loads = [fd.Pressure(1e-3, [2, 3], fd.Ramp(0.1)), fd.CreaseMoment([0], 1e-3, fd.Pulse(0.02))]
    case = fd.Case(bars(), [fd.Fix("xmin", "xyz")], loads)
    motion = fd.simulate(case, 0.05, every=0.05)
    fd.save(motion, tmp_path / "motion.nc")
    assert fd.case_of(fd.load(tmp_path / "motion.nc")).loads == tuple(loads)
    assert float(motion.work[-1]) != 0.0


BAD = {
    "total on nodes and edges": (
        'total = [0, 0, 1]\nnodes = "xmax"\nedges = "xmax"',
        r"loads\[0\]\.total: give one of nodes, edges and panels; 2 are given, nodes and edges",
    ),
    "total without a place": (
        "total = [0, 0, 1]",
        r"loads\[0\]\.total: give one of nodes, edges and panels; none is given",
    ),
    "no such edge": (
        "total = [0, 0, 1]\nedges = [[0, 8]]",
        r"loads\[0\]\.edges = .*: the pattern has no edge from vertex 0 to 8",
    ),
    "an edge of three": (
        "per_length = [0, 0, 1]\nedges = [[0, 1, 2]]",
        r"loads\[0\]\.edges\[0\] = \[0, 1, 2\]: give pairs of vertices",
    ),
    "an edge twice": (
        "per_length = [0, 0, 1]\nedges = [[0, 1], [1, 0]]",
        r"loads\[0\]\.edges\[1\] = \[1, 0\]: is listed twice",
    ),
    "one vertex": (
        'per_length = [0, 0, 1]\nedges = "xmax and ymin"',
        r'loads\[0\]\.edges = "xmax and ymin": selects no edge',
    ),
    "line load without a force": ('edges = "xmax"\nper_lenght = [0, 0, 1]', "mean 'per_length'"),
    "no such panel": (
        "pressure = 1.0\npanels = [4]",
        r"loads\[0\]\.panels = \[4\]: panel 4 is out of range; this structure has panels 0 to 3",
    ),
    "a word for panels": (
        'pressure = 1.0\npanels = "some"', r'loads\[0\]\.panels = "some": give panel numbers'
    ),
    "pressure and force": (
        'pressure = 1.0\nforce = [0, 0, 1]\nnodes = "xmax"',
        r"loads\[0\]\.pressure: a pressure acts on panels; leave out force and nodes",
    ),
    "pressure as text": ('pressure = "1 bar"', r"loads\[0\]\.pressure = \"1 bar\""),
    "too few moments": (
        "creases = [0, 1, 2]\nmoment = [1.0, 2.0]",
        r"loads\[0\]\.moment = .*: 2 values for 3 creases",
    ),
    "no such crease": (
        "creases = [99]\nmoment = 1.0", r"loads\[0\]\.creases = \[99\]: crease 99 is out of range"
    ),
    "angle and moment": ("creases = [0]\nangle = 90\nmoment = 1.0", "leave out angle"),
    "held panels": (
        "pressure = 1.0\npanels = [0]\n[[supports]]\nnodes = [0, 1, 2, 3, 4, 5, 9, 11]",
        r"loads\[0\]\.panels = \[0\]: supports hold all nodes of these panels",
    ),
    "held edge": (
        'per_length = [0, 0, 1]\nedges = "xmin"',
        r"loads\[0\]: the force per length .* acts only where supports hold",
    ),
    "held crease": (
        "creases = [0]\nmoment = 1.0\n[[supports]]\nnodes = [0, 1, 2, 3, 4, 5, 9, 11]",
        r"loads\[0\]\.creases = \[0\]: supports hold the panels on both sides of crease 0",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_bad_loads_are_refused(name, tmp_path) -> None:
    text, message = BAD[name]
    path = tmp_path / "case.toml"
    path.write_text(CASE.format(model="", load=text))
    with pytest.raises(InputError, match=message):
        fd.read_case(path).case()


def test_a_center_has_no_area_of_its_own() -> None:
    s = bars()
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
