"""`foldyn track` from its arguments to its files."""

from __future__ import annotations

import csv
import json
import re
from html import unescape

import numpy as np
import pytest
import xarray as xr

import foldyn as fd
from case_texts import HELD_MIURA_TEXT, changed
from foldyn.cli.main import main
from foldyn.experiment.tracking import matching
from foldyn.experiment.tracking.tracks_page import filled
from foldyn.structures.discretize import PER_NODE

cv2 = pytest.importorskip("cv2")

CASE = changed(
    HELD_MIURA_TEXT,
    "pattern.cells = [2, 2]; pattern.a = 0.025; pattern.b = 0.025; pattern.dihedral = 75; "
    "sheet = { youngs_modulus = 1.2e9, poissons_ratio = 0.2, thickness = 0.24e-3, density = 667 }; "
    'supports[0].nodes = [20, 22, 24]; analysis = { kind = "dynamics", duration = 0.1 }',
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A film of a sheet at rest that shakes as a whole, photographs of it, and its case."""
    from foldyn.experiment import Camera, Look, Sensor, SyntheticFilm, write_film
    from foldyn.experiment.rendering.picture import Studio

    folder = tmp_path_factory.mktemp("track")
    (folder / "case.toml").write_text(CASE, "utf-8")
    structure = fd.read_case(folder / "case.toml").case().structure
    middle = 0.5 * (structure.nodes.min(axis=0) + structure.nodes.max(axis=0))
    camera = Camera.looking_at(middle, 0.4, metres_per_pixel=1.7e-4, size=(560, 600))
    studio = Studio.of(structure, camera, Look(), Sensor(samples=4), 0)

    def motion(times):
        shift = 0.003 * np.sin(2 * np.pi * 10.0 * np.asarray(times))
        return structure.nodes + shift[:, np.newaxis, np.newaxis] * [1.0, 0.0, 0.0]

    film = SyntheticFilm(studio, np.arange(12) / 120.0, motion, 120.0)
    write_film(film, folder / "film.mkv")
    for k in (0, 3):
        cv2.imwrite(str(folder / f"photo{k}.png"), film.frame(k))
    return folder


@pytest.fixture
def inside(folder, monkeypatch):
    monkeypatch.chdir(folder)
    monkeypatch.setattr(matching, "_BEST", 2)  # placements that are refined
    return folder


@pytest.mark.matrix
def test_a_film_becomes_histories(inside, capsys):
    command = "track film.mkv --model case.toml --out a/run.nc --figures png"
    assert main(command.split()) == 0
    said = capsys.readouterr().out
    assert "nodes recognized" in said and "wrote a/run.nc" in said
    tracks = fd.experiment.load_tracks("a/run.nc")
    moved = tracks["displacement"].sel(node=11, axis="x").values
    expected = 0.003 * np.sin(2 * np.pi * 10.0 * np.arange(12) / 120.0)
    assert np.abs((moved - moved[0]) - expected).max() < 6e-5
    with open("a/run.csv", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    assert rows[0][0] == "time [s]" and "node 11 x [m]" in rows[0]
    assert not any(name.endswith("z [m]") for name in rows[0])  # along the line of sight
    column = rows[0].index("node 11 x [m]")
    assert float(rows[4][column]) == pytest.approx(moved[3], rel=1e-6)
    for name in ("run-overlay.png", "run-history.png"):
        assert (inside / "a" / name).stat().st_size > 10_000
    page = (inside / "a" / "run.html").read_text("utf-8")
    assert page.index("data-foldyn=") < page.index("data-plot=") < page.index("<img ")
    plots = [json.loads(unescape(text)) for text in re.findall(r'data-plot="(.*?)"', page)]
    assert [curve["name"] for curve in plots[0]["curves"]] == ["x", "y"]  # z: the line of sight
    for told in ("along the line of sight, z.", "<td>foldyn track film.mkv --model case.toml"):
        assert told in page


@pytest.mark.matrix
def test_photographs_with_loads(inside):
    given = ["track", "photo0.png", "photo3.png", "--model", "case.toml", "--loads", "0,0.5"]
    assert main([*given, "--out", "photos.nc", "--quiet", "--no-figures"]) == 0
    tracks = fd.experiment.load_tracks("photos.nc")
    moved = tracks["displacement"].sel(axis="x", node=[6, 8, 11, 13]).values
    assert np.nanmedian(moved[1] - moved[0]) == pytest.approx(0.003, abs=1e-4)
    assert (inside / "photos.csv").read_text("utf-8").startswith("photo,load [N],node")
    assert not [*inside.glob("photos*.png"), *inside.glob("photos*.html")]
    assert main([*given, "--scale", "1.7e-4", "--out", "shown.nc", "--quiet"]) == 0
    page = (inside / "shown.html").read_text("utf-8")
    assert '"kind": "path"' in page and page.count("data:image/jpeg") == 2  # the photographs
    assert not list(inside.glob("shown*.png"))


def test_gaps_of_tracks_are_filled_for_the_picture():
    """In time by straight lines, over the sheet by neighbors, 0 along the line of sight."""
    moved = np.full((3, 4, 3), np.nan)
    moved[:, 0, :2] = [[0.0, 0.0], [np.nan, np.nan], [2.0, 4.0]]
    moved[:, 3, :2] = 3.0
    edges = (("edge", "end"), [[0, 1], [1, 2], [2, 3]])
    tracks = xr.Dataset({"displacement": (("time", "node", "axis"), moved), "edges": edges})
    found = filled(tracks)
    assert found[1, 0].tolist() == [1.0, 2.0, 0.0]
    np.testing.assert_allclose(found[:, 1, 0], [1.0, 5.0 / 3.0, 7.0 / 3.0], rtol=1e-6)
    np.testing.assert_allclose(found[:, 2, 0], [2.0, 7.0 / 3.0, 8.0 / 3.0], rtol=1e-6)


@pytest.mark.matrix
def test_without_a_model_there_are_pixels(inside):
    given = ["track", "film.mkv", "--scale", "1.7e-4", "--out", "pixels.nc", "--quiet"]
    assert main(given) == 0
    tracks = fd.experiment.load_tracks("pixels.nc")
    assert tracks.attrs["metres_per_pixel"] == 1.7e-4
    assert (inside / "pixels.csv").read_text("utf-8").startswith("time [s],point 0 u [px]")
    assert (inside / "pixels-overlay.png").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("photo0.png", "one photograph alone"),
        ("photo0.png photo3.png", "--model: photographs need one"),
        ("film.mkv photo0.png", "not both"),
        ("film.mkv film.mkv", "one film at a time"),
        ("missing.mp4", "no such file"),
        ("case.toml", "codec is unknown"),
        ("film.mkv --scale 0", "--scale = 0.0: must be greater than 0"),
        ("film.mkv --scale wide", "give numbers"),
        ("film.mkv --scale 1 --reference 0,0,1,1,1", "give one or the other"),
        ("film.mkv --reference 0,0,1,1", "4 numbers; 5 are needed"),
        ("film.mkv --roi 0,0,9999,10", "--roi 0,0,9999,10: must lie in the image"),
        ("film.mkv --roi 0,0,60,60", "no corners"),
        ("film.mkv --nodes 1", "--nodes"),
        ("film.mkv --loads 1", "--loads"),
        ("film.mkv --out tracks.csv", "ends in .nc"),
        ("film.mkv --model nothing.toml", "no such file"),
        ("film.mkv --up=z", "same axis"),
    ],
)
def test_bad_input_gets_one_message_and_nothing_written(inside, capsys, arguments, message):
    before = sorted(inside.rglob("*"))
    given = arguments.split()
    if "--out" not in given:
        given += ["--out", "never/bad.nc"]
    assert main(["track", *given]) == 2
    said = capsys.readouterr()
    assert message in said.err
    assert (len(said.err.strip().splitlines()), said.out) == (1, "")
    assert sorted(inside.rglob("*")) == before


@pytest.mark.matrix
def test_more_than_half_of_the_memory_is_taken_when_forced(inside, monkeypatch, capsys):
    monkeypatch.setattr("foldyn.ram_limit.memory", lambda: 1.5 * PER_NODE * (25 + 16))
    command = ["track", "film.mkv", "--model", "case.toml", "--out", "forced.nc", "--no-figures"]
    assert main(command) == 2
    assert "a structure of 41 nodes needs about" in capsys.readouterr().err
    assert not (inside / "forced.nc").exists()
    assert main([*command, "--force"]) == 0
