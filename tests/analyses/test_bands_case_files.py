"""Case files of bands: what `bands` gives, in all states of a file, with gaps and attenuation."""

from __future__ import annotations

import tomllib
from itertools import product

import numpy as np
import pytest
from matplotlib.figure import Figure

import foldyn as fd
from case_texts import MIURA_TEXT, PLATE
from foldyn import plots
from foldyn.analyses.bands import BandsAnalysis
from foldyn.analyses.reading import case_of_document, read_as
from foldyn.errors import FoldynWarning, InputError
from foldyn.linear.band_structure import legs
from foldyn.live.case_session import computed, offered
from foldyn.report.album import Album
from foldyn.report.sections import Picture

BANDS_TEXT = f"""{MIURA_TEXT}{PLATE}[analysis]
kind = "bands"
count = 5
points = 17
zone = 6
attenuation = 40
vary = {{ "pattern.dihedral" = [60, 100] }}
"""


def case_file(tmp_path, text: str = BANDS_TEXT, **analysis):
    document = tomllib.loads(text)
    document["analysis"] |= analysis
    document["analysis"] = {k: v for k, v in document["analysis"].items() if v is not None}
    return case_of_document(tmp_path / "case.toml", document)


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    return case_file(tmp_path_factory.mktemp("bands")).run()


def cell_at(dihedral: float) -> fd.UnitCell:
    pattern = fd.patterns.miura(dihedral=dihedral)
    return fd.UnitCell(
        fd.Case(fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.01, 1.0), preset="plate"))
    )


@pytest.mark.matrix
def test_states_have_the_bands_of_their_cells(found):
    assert found["state"].values.tolist() == [60, 100]
    assert found["state"].attrs["units"] == "degrees"
    for dihedral in (60, 100):
        cell, here = cell_at(dihedral), found.sel(state=dihedral)
        own = fd.bands(cell, cell.path("G-X-M-Y-G", 17), count=5)
        np.testing.assert_array_equal(here["frequency"], own["frequency"])
        zone = fd.bands(cell, cell.grid(6), count=5, track=False)
        noise = 1e-6 * float(zone["frequency"].max())
        np.testing.assert_allclose(here["zone_frequency"], zone["frequency"], rtol=0, atol=noise)
        np.testing.assert_array_equal(here["zone_wave_vector"], zone["wave_vector"])
        np.testing.assert_array_equal(here["position"], cell.case.structure.nodes)
        np.testing.assert_allclose(here["vectors"], cell.vectors)


@pytest.mark.matrix
def test_figures_show_each_state(tmp_path, found, monkeypatch):
    drawn = []
    monkeypatch.setattr(plots, "plot_bands", lambda bands: drawn.append(bands) or Figure())
    album = Album(tmp_path, "png")
    rule = next(iter(case_file(tmp_path).masses))
    shown = [*BandsAnalysis.sections(case_file(tmp_path), {rule: found}, album)]
    captions = [one.caption for one in shown if isinstance(one, Picture)]
    assert [bands["state"].item() for bands in drawn] == [60, 100]
    for k, name in enumerate(("bands.png", "bands-2.png")):
        assert (tmp_path / name).exists()
        assert f"dihedral {(60, 100)[k]} degrees" in captions[-2 + k]


@pytest.mark.matrix
def test_gaps_are_those_of_the_whole_zone_and_of_legs(found):
    """In a full gap there is no frequency of path or zone, and bands touch both of its ends."""
    rows = zip(
        *(found[f"gap_{key}"].values for key in ("state", "direction", "below", "bottom", "top")),
        strict=True,
    )
    directions = set()
    for state, direction, below, bottom, top in rows:
        here = found.isel(state=int(state))
        values = np.sort(here["frequency"].values, axis=1)
        if direction == "all":
            values = np.vstack([values, np.sort(here["zone_frequency"].values, axis=1)])
        else:
            values = values[legs(here)[direction]]
        assert ((values <= bottom) | (values >= top)).all()
        assert values[:, below].min() == top
        assert below == 0 or values[:, below - 1].max() == bottom
        directions.add(direction)
    assert {"X-M", "M-Y"} <= directions


@pytest.mark.matrix
def test_waves_decay_where_no_band_is_and_there_alone(found):
    """Without damping, a frequency that a band passes along a leg has a wave that travels."""
    checked = 0
    for state, leg in product((0, 1), found["leg"].values):
        here = found.isel(state=state)
        values = np.sort(here["frequency"].values[legs(here)[leg]], axis=1)
        low, high = values.min(axis=0), values.max(axis=0)
        for level, decay in zip(
            here["level_frequency"].values, here["attenuation"].sel(leg=leg).values, strict=True
        ):
            inside = ((level > low) & (level < high)).any()
            if inside:
                assert decay == 0.0
            elif level < high.max():  # nor is it a band that was not computed
                near = np.abs(np.concatenate([low, high]) - level).min() < 1e-3 * level
                assert near or decay > 0.0
            checked += not inside
    assert checked > 10


@pytest.mark.matrix
def test_stretched_periods_are_those_of_the_state(tmp_path):
    """A factor of 1 changes nothing, and others stretch the shifts from cell to cell."""
    few = {"zone": None, "attenuation": None, "points": 5}
    vary = {"analysis.stretch": [1.0, 1.005]}
    rest, pulled = (
        case_file(tmp_path, **few, vary=each).run() for each in ({"pattern.dihedral": 60}, vary)
    )
    top = float(rest["frequency"].max())
    np.testing.assert_allclose(
        pulled["frequency"][0], rest["frequency"][0], rtol=0, atol=1e-6 * top
    )
    shifts = pulled["vectors"].values
    np.testing.assert_allclose(shifts[1], 1.005 * shifts[0], rtol=1e-9, atol=1e-12)
    assert (np.abs(pulled["frequency"][1] - pulled["frequency"][0]).max() > 1e-3 * top).item()


@pytest.mark.matrix
def test_one_of_the_periods_makes_a_chain(tmp_path):
    few = {"zone": None, "points": 5, "vary": None, "attenuation": None}
    chain = case_file(tmp_path, periods=[1], **few).run()
    cell = cell_at(60.0)
    given = case_file(tmp_path, vectors=cell.vectors[1:].tolist(), **few).run()
    np.testing.assert_array_equal(chain["frequency"], given["frequency"])
    assert chain.sizes["period"] == 1
    tower = '[pattern]\nkind = "kresling"\n' + MIURA_TEXT.partition('miura"')[2]
    tower += PLATE + '[analysis]\nkind = "bands"\nperiods = [0]\npoints = 3\n'
    assert case_file(tmp_path, tower).run()["angles"].values == pytest.approx(np.pi / 6.0)


def test_a_screw_of_the_file_is_that_of_the_generator(tmp_path):
    tower = fd.patterns.kresling(sides=4, radius=0.05, height=0.05, twist=30)
    text = f"""[pattern]
vertices = {tower.vertices.tolist()}
faces = {[list(face) for face in tower.faces]}
{MIURA_TEXT.partition("miura" + chr(34))[2]}{PLATE}[analysis]
kind = "bands"
points = 5
screw = {{ axis = "z", angle = 30, shift = 0.05 }}
"""
    own = case_file(tmp_path, text).run()
    sheet = fd.Sheet(1e6, 0.25, 0.01, 1.0)
    cell = fd.UnitCell(fd.Case(fd.discretize(tower, sheet, preset="plate")))
    marked = fd.bands(cell, cell.path("G-X", 5))["eigenvalue"].values
    noise = 1e-9 * np.abs(marked).max()
    np.testing.assert_allclose(np.sort(own["eigenvalue"]), np.sort(marked), rtol=0, atol=noise)
    assert own["angles"].values == pytest.approx(np.pi / 6.0)


@pytest.mark.parametrize(
    ("analysis", "message"),
    [
        ({"path": "G-Z"}, r'analysis\.path = "G-Z": "Z" is no point'),
        ({"points": 2}, r"analysis\.points = 2: must be a whole number, at least 5"),
        ({"periods": [2]}, r"analysis\.periods = .*: the pattern has the periods 0 to 1"),
        ({"periods": [0], "vectors": [[1.0, 0, 0]]}, r"analysis\.periods: chooses among"),
        ({"zone": 1}, r"analysis\.zone = 1: must be at least 2"),
        ({"count": 0}, r"analysis\.count = 0: must be at least 1"),
        ({"count": 900}, r"analysis\.count = 900: .*\(with pattern\.dihedral = 60\)"),
        ({"vectors": [[1.0, 0.0, 0.0]], "vary": None}, r"analysis\.vectors: motion 0 brings no"),
        ({"vary": {"pattern.dihedral": [60], "pattern.a": [1]}}, r"analysis\.vary = .* 2 keys"),
        ({"vary": {"analysis.count": [2]}}, r"analysis\.vary: analysis\.count does not change"),
        ({"vary": {"pattern.kind": "miura"}}, r"analysis\.vary = .*: give numbers"),
        ({"vary": {"pattern.dihedral": [60, 400]}}, r"dihedral.*\(with pattern\.dihedral = 400\)"),
        ({"stretch": [1.0, 1.0, 1.0], "vary": None}, r"analysis\.stretch"),
        ({"stretch": -1.0}, r"analysis\.stretch = -1"),
        ({"turn": 3.0, "vary": None}, r"analysis\.turn = 3: the cell repeats without a screw"),
        ({"screw": {"axis": "z", "angle": 30}}, r"analysis\.screw\.shift: missing"),
        ({"attenuation": 5, "path": "G-M"}, r"analysis\.attenuation: no leg"),
    ],
)
def test_what_a_file_gets_wrong_is_named(tmp_path, analysis, message):
    with pytest.raises(InputError, match=message):
        case_file(tmp_path, **{"zone": None, "attenuation": None, **analysis}).run()


def test_bands_have_no_derivatives(tmp_path):
    (tmp_path / "case.toml").write_text(BANDS_TEXT)
    with pytest.raises(InputError, match='= "bands": bands have no derivatives; sweep'):
        fd.sensitivity(tmp_path / "case.toml", {"sheet.thickness": 0.01}, measures="band_gap[4]")


@pytest.mark.matrix
def test_the_viewer_shows_one_state(tmp_path):
    document = tomllib.loads(BANDS_TEXT)
    assert next(iter(offered(document))) == "bands"
    document["analysis"] |= {"zone": 2, "points": 5}
    _, result = computed(tmp_path / "case.toml", document, "bands")
    assert "state" not in result.dims


def test_loads_other_than_folds_are_refused(tmp_path):
    text = BANDS_TEXT + "[[loads]]\nnodes = [0]\nforce = [0, 0, 1]\n"
    with pytest.raises(InputError, match=r"loads\[0\]: the equilibrium of a cell"):
        case_file(tmp_path, text, state="equilibrium")


def test_files_of_other_kinds_are_cells_without_supports_and_loads(tmp_path):
    text = BANDS_TEXT.partition("[analysis]")[0] + (
        '[[supports]]\nnodes = "xmin"\n[[loads]]\nnodes = [8]\nforce = [0, 0, 1e-4]\n'
        '[analysis]\nkind = "dynamics"\nduration = 1.0\n'
    )
    (tmp_path / "case.toml").write_text(text)
    with pytest.warns(FoldynWarning, match=r"leaves out \[\[supports\]\], \[\[loads\]\]"):
        read = read_as(tmp_path / "case.toml", "bands", {"count": 3, "points": 4, "path": "G-X"})
    cell = cell_at(60.0)
    own = fd.bands(cell, cell.path("G-X", 4), count=3)
    np.testing.assert_array_equal(read.run()["frequency"], own["frequency"])


@pytest.mark.matrix
def test_a_stored_state_that_does_not_repeat_is_named(tmp_path):
    """One corner that is pushed up moves no other one."""
    cell = cell_at(60.0)
    held = [fd.Fix([0, 2, 6], "xyz"), fd.Impose([8], "z", 0.02)]
    path = fd.trace(fd.Case(cell.case.structure, held), load_factors=[0.0, 1.0])
    fd.save(path, tmp_path / "path.nc")
    text = BANDS_TEXT + '[initial]\nfile = "path.nc"\n'
    few = {"zone": None, "attenuation": None, "points": 5}
    found = case_file(tmp_path, text, vary={"initial.at": [0]}, **few).run()
    own = fd.bands(cell, cell.path("G-X-M-Y-G", 5), count=5)
    np.testing.assert_allclose(found["frequency"][0], own["frequency"], rtol=1e-6, atol=1e-9)
    with pytest.raises(InputError, match=r"initial: does not repeat.*\(with initial\.at = 1\)"):
        case_file(tmp_path, text, vary={"initial.at": [0, 1]}, **few).run()
