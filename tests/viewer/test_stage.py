"""What pages hold of results: positions to the accuracy promised, all parts that are drawn."""

from __future__ import annotations

import json
import re
from importlib import import_module
from importlib.resources import files

import numpy as np
import pytest
from decode import changing, decoded
from page_samples import page, results

import foldyn as fd
from foldyn.errors import InputError
from foldyn.live.files import live_page
from foldyn.plots.style import CREASE_NAMES, CREASES
from foldyn.report import Chart, Charts, Curve
from foldyn.viewer import stage
from foldyn.viewer.sheet import KINDS, edge_pieces
from foldyn.viewer.stage import OF_SIZE

CORNERS, TRIANGLES = [(0, 0), (1, 0), (1, 1), (0, 1)], [(0, 1, 2), (0, 2, 3)]


def staged(kind):
    shown = results(kind)
    cases = {name: fd.case_of(result) for name, result in shown.items()}
    return stage(shown, cases, "title", [0]), shown, cases


@pytest.mark.parametrize("kind", ["motion", "path"])
def test_positions_are_those_of_the_result(kind):
    part, shown, cases = staged(kind)
    for about, (name, result) in zip(part.about["results"], shown.items(), strict=True):
        u = changing(part.arrays, about["displacement"])
        true = result["displacement"].transpose(..., "node", "axis").values
        size = cases[name].structure.pattern.size
        assert about["name"] == name
        assert np.abs(u - true).max() <= OF_SIZE * size
    sheet = part.about["sheets"][part.about["results"][0]["sheet"]]
    nodes = next(iter(cases.values())).structure.nodes.astype(np.float32)
    assert np.array_equal(decoded(part.arrays, sheet["nodes"]), nodes)


def test_large_sheets_have_values_of_panels_alone(monkeypatch):
    monkeypatch.setattr(import_module("foldyn.viewer.stage"), "MOST_LINES", 0)
    part, _, _ = staged("motion")
    assert [field["on"] for field in part.about["results"][0]["fields"].values()] == ["panel"]


def test_strains_and_moments_are_those_of_the_structure():
    part, shown, cases = staged("motion")
    about = part.about["results"][0]
    case, u = next(iter(cases.values())), next(iter(shown.values()))["displacement"].values
    structure = case.structure
    x = structure.nodes + u[37]
    i, j = structure.bars.T
    strain = np.linalg.norm(x[j] - x[i], axis=1) / structure.bar_length - 1.0
    found = changing(part.arrays, about["fields"]["bar_strain"]["values"])
    assert np.abs(found[37] - strain).max() <= 5e-3 * np.abs(found).max()
    turn = structure.dihedrals(u[37])[0] - structure.fold_rest
    moment = changing(part.arrays, about["fields"]["fold_moment"]["values"])[37]
    assert np.allclose(moment, structure.fold_stiffness * turn, atol=5e-3 * np.abs(moment).max())


def test_a_response_holds_its_real_and_imaginary_parts():
    part, shown, _ = staged("response")
    values = changing(part.arrays, part.about["results"][0]["displacement"])
    true = next(iter(shown.values()))["receptance"].transpose("frequency", "node", "axis").values
    assert np.abs(values[:, 0] + 1j * values[:, 1] - true).max() < 2e-4 * np.abs(true).max()


def test_modes_say_what_they_do_and_how_alike_they_are():
    part, shown, _ = staged("modes")
    frequencies = [about["frequency"] for about in part.about["results"]]
    wanted = np.concatenate([modes["frequency"].values for modes in shown.values()])
    assert np.array_equal(frequencies, wanted)
    assert all(about["what"] for about in part.about["results"])

    first, second = (modes["shape"].values[:, :6] for modes in shown.values())
    found = np.array(part.about["mac"])
    assert np.abs(found[:4, 4:] - fd.mac(first, second)).max() < 1e-3
    assert np.array_equal(np.diag(found), np.ones(8))


def scripted(text):
    """Data of a page that are written as scripts."""
    found = re.findall(r'<script type="application/json"[^>]*>(.*?)</script>', text)
    assert "<" not in "".join(found)
    return [json.loads(one) for one in found]


def test_pages_name_all_their_arrays_and_let_nothing_in(tmp_path):
    for kind in ("motion", "path", "modes", "response"):
        text = page(kind, tmp_path).read_text("utf-8")
        (about,) = scripted(text)
        held = set(re.findall(r'data-array="stage-1\.([^"]+)"', text))
        assert held == set(about["arrays"])
        policy = re.search(r'http-equiv="Content-Security-Policy" content="([^"]*)"', text)[1]
        assert "default-src 'none'" in policy and "unsafe" not in policy
        assert "http://" not in re.sub(r"http://www\.w3\.org\S*", "", text)


def test_other_datasets_are_refused():
    with pytest.raises(InputError, match="no motion, path, folding, modes, frequency response, b"):
        stage({"a": results("motion")["panel"].isel(time=0)}, {}, "t", [0])


def test_kinds_of_edges_are_those_of_the_script_and_of_figures():
    text = files("foldyn.viewer").joinpath("static/colors.js").read_text("utf-8")
    rows = re.findall(r'{ name: "(.*?)(?: crease)?", light: "(#\w+)"', text)
    assert [name for name, _ in rows] == [*(CREASE_NAMES[k] for k in KINDS[:4]), "boundary", "bar"]
    for letter in "MVF":
        assert rows[KINDS.index(letter)][1].upper() == CREASES[letter]


def test_welds_are_not_drawn():
    square = fd.welded(fd.Pattern(CORNERS, TRIANGLES), join=False)
    made = fd.discretize(square, fd.Sheet(1e9, 0.3, 1e-3, 700.0))
    pairs, kind, _, _ = edge_pieces(made.pattern, made.nodes, made.edge_nodes)
    assert len(pairs) == len(kind) == len(made.pattern.boundary)


def test_where_supports_move_their_force_is_charted():
    """The load factor is their displacement; at every point their force is minus the springs'."""
    strip = fd.patterns.simple_fold(0.1, 0.1, dihedral=150)
    made = fd.discretize(strip, fd.Sheet(1e9, 0.3, 1e-3), crease_stiffness=0.2)
    supports = [fd.Fix([4, 5]), fd.Fix([0, 1], "z"), fd.Impose([0, 1], "x", -0.02)]
    path = fd.trace(fd.Case(made, supports), method="displacement", steps=3)
    part = stage({"path": path}, {"path": fd.case_of(path)}, "title", [2])
    (about,) = part.about["results"]
    pulled = path["reaction"].sel(support=path["support_node"].isin([0, 1])).values
    wanted = pulled[:, path["support_axis"].values[path["support_node"].isin([0, 1])] == "x"].sum(1)
    assert about["way"] == "-x" and part.about["axis"] == 0
    np.testing.assert_allclose(decoded(part.arrays, about["force"]), -wanted, rtol=1e-6)
    np.testing.assert_allclose(decoded(part.arrays, about["load"]), path["load_factor"])
    loaded = results("path")
    part = stage(loaded, {name: fd.case_of(result) for name, result in loaded.items()}, "t", [0])
    assert all("force" not in about for about in part.about["results"])


def test_a_folding_is_shown_without_a_case():
    """Its geometry alone: no moments, as there is no sheet."""
    flat = fd.Pattern(CORNERS, TRIANGLES, ["M"])
    way = fd.fold(flat, 90, steps=4).path
    part = stage({"folding": way}, {}, "title", [1])
    (about,) = part.about["results"]
    assert part.about["kind"] == "folding" and set(about["fields"]) == {"bar_strain", "turn"}
    u = changing(part.arrays, about["displacement"])
    true = way["position"].values - flat.vertices
    assert np.abs(u - true).max() <= OF_SIZE * flat.size
    np.testing.assert_allclose(decoded(part.arrays, about["load"]), way["share"])
    turn = changing(part.arrays, about["fields"]["turn"]["values"])
    np.testing.assert_allclose(turn[:, 0], [0, -22.5, -45, -67.5, -90], atol=0.4)


def test_a_folding_may_begin_and_end_closed():
    shut = fd.fold(fd.Pattern(CORNERS, TRIANGLES, ["V"]), 180, steps=2).pattern
    way = fd.fold(shut, 90, steps=2).path
    (about,) = stage({"folding": way}, {}, "title", [1]).about["results"]
    assert about["fields"]["turn"]["on"] == "crease"


BREAKING = '<!--<script>"</script><b>&'


def test_no_title_can_end_a_script_element_or_open_a_comment_in_it():
    """After "<!--<script" a browser looks for two ends of the script."""
    result = next(iter(results("motion").values()))
    text = stage({BREAKING: result}, {BREAKING: fd.case_of(result)}, BREAKING, [0]).html()
    assert [about["title"] for about in scripted(text)] == [BREAKING]
    live = live_page(BREAKING, {"name": BREAKING}, "key")
    assert scripted(live) == [{"name": BREAKING, "key": "key"}]
    chart = Chart("x", "y", [Curve(BREAKING, [0.0, 1.0], [0.0, 1.0])], BREAKING, BREAKING)
    chart = Charts([chart], BREAKING).html()
    for whole in (live.partition("<main")[0], chart):
        assert "<!--" not in whole


def test_what_is_released_vanishes_from_the_sheet():
    """Samples from which lines and held nodes are gone; nodes that others hold stay."""
    sheet = fd.discretize(fd.patterns.simple_fold(dihedral=60), fd.Sheet(1e6, 0.25, 0.01, 1.0))
    supports = [
        fd.Fix([4, 5]), fd.Fix([0, 1], "z"), fd.Fix([1, 2, 3], "xy", until=0.0045),
        fd.Bar([(2, 4)], 1.0), fd.Cable([3, (0.0, 0.0, 3.0)], 5.0, until=0.008),
        fd.Spring(1.0, nodes=[2], until={"crease": 0, "angle": 320.0}),
    ]  # fmt: skip
    case = fd.Case(sheet, supports, [fd.Gravity((0, 0, -9.81))])
    motion = fd.simulate(case, 0.01, method="rk4", interval=0.002)
    found = stage({"": motion}, {"": case}, "flap", [2]).whole()["results"][0]["gone"]
    assert found == {"held": {2: 3, 3: 3}, "lines": [None, 4]}
    assert motion.attrs["released_from"].tolist() == [3, 4]
    path = fd.trace(case.altered(supports=[*supports[:2], supports[5]]), steps=2)
    assert "gone" not in stage({"": path}, {"": case}, "flap", [2]).whole()["results"][0]
