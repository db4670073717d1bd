"""From pictures to parameters: what was tracked goes into a fit as it was written."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fit_cases import SAME_STEPS
from miura_film import DISTANCE, SCALE, camera, cv2

import foldyn as fd
from foldyn.errors import InputError
from foldyn.experiment import (
    Parameter,
    Placing,
    Sensor,
    TrackedModel,
    Tracking,
    film_of,
    photos_of,
    save_tracks,
    track_film,
    track_photos,
    write_csv,
    write_film,
)
from foldyn.experiment.calibration.fit_file import read_fit
from foldyn.experiment.calibration.measured_files import history, recognize, shapes

pytestmark = pytest.mark.filterwarnings(SAME_STEPS)

ALPHA, RATIO = 14.0, 2.7  # the truth: 1/s, and L*/L_F
RATE, DROPPED = 240.0, 30  # frames/s, and the frame that repeats the one before
DIGITS = 5e-9  # relative rounding of nine digits
FACTORS = [0.0, 0.5, 1.0]
HOW = Tracking(placing=Placing(metres_per_pixel=SCALE, distance=DISTANCE))
SHEET = f"""
[pattern]
kind = "miura"
cells = [2, 2]
a = 0.025
b = 0.025
panel_angle = 60
dihedral = 75
[sheet]
youngs_modulus = 1.2e9
poissons_ratio = 0.2
thickness = 2.4e-4
density = 667
length_scale_ratio = {RATIO}
[model]
preset = "herkal"
[damping]
alpha = {ALPHA}
[[supports]]
nodes = [20, 21, 22, 23, 24]
axes = "x"
[[supports]]
nodes = [22]
axes = "y"
[[supports]]
nodes = [21, 23]
axes = "z"
[[loads]]
nodes = [0, 1, 2, 3, 4]
force = [0.008, 0, 0]
"""
SWAYS = SHEET + """
history = { kind = "half_sine", duration = 0.02 }
[analysis]
kind = "dynamics"
method = "newmark"
dt = 5e-4
duration = 0.25
[output]
every_steps = 2
"""  # fmt: skip
HANGS = SHEET + """
[analysis]
kind = "statics"
"""  # fmt: skip


def written(folder: Path, text: str, name: str) -> tuple[Path, fd.Case, dict]:
    """A case file, its case, and the arguments of its analysis."""
    path = folder / name
    path.write_text(text, encoding="utf-8")
    read = fd.read_case(path)
    return path, read.case(), dict(read.analysis.arguments)


@pytest.fixture(scope="module")
def filmed(tmp_path_factory):
    """A case file; beside it film.nc and film.csv, the tracks of a film of its motion."""
    folder = tmp_path_factory.mktemp("filmed")
    path, case, arguments = written(folder, SWAYS, "sways.toml")
    model = TrackedModel.of(case)
    motion = fd.simulate(case, **arguments)
    seen = camera(model.rest, k1=0.0)
    film = film_of(
        motion, seen, rate=RATE, duration=0.16, sensor=Sensor(samples=4), dropped=(DROPPED,)
    )
    write_film(film, folder / "film.mkv")
    tracks = track_film(str(folder / "film.mkv"), model, tracking=HOW)
    save_tracks(tracks, folder / "film.nc")
    write_csv(tracks, folder / "film.csv")
    return path


@pytest.fixture(scope="module")
def photographed(tmp_path_factory):
    """A case file; beside it photos.nc and photos.csv, the tracks of photographs."""
    folder = tmp_path_factory.mktemp("photographed")
    path, case, _ = written(folder, HANGS, "hangs.toml")
    bent = fd.trace(case, method="newton", load_factors=FACTORS)
    steps = [int(np.argmin(np.abs(bent["load_factor"].values - f))) for f in FACTORS]
    model = TrackedModel.of(bent)
    seen = camera(model.rest, k1=0.0)
    pictures, _ = photos_of(bent, steps, camera=seen, sensor=Sensor(samples=4))
    files = [folder / f"load{k}.png" for k in range(len(FACTORS))]
    for file, picture in zip(files, pictures, strict=True):
        cv2.imwrite(str(file), picture)
    tracks = track_photos(files, model, tracking=HOW)
    save_tracks(tracks, folder / "photos.nc")
    write_csv(tracks, folder / "photos.csv")
    return path


def same(one, other) -> None:
    """Two measurements are the same to the digits of a CSV file, gaps included."""
    assert one.nodes == other.nodes
    assert np.nanmax(np.abs(one.values)) > 1e-3  # m
    np.testing.assert_allclose(one.values, other.values, rtol=DIGITS)


@pytest.mark.matrix
def test_both_files_of_a_film_hold_the_same_histories(filmed):
    nodes = [0, 6, 7, 8]
    binary = history(filmed.with_name("film.nc"), nodes)
    text = history(filmed.with_name("film.csv"), nodes)
    same(binary, text)
    np.testing.assert_allclose(binary.time, text.time, rtol=DIGITS)
    lost = np.isnan(text.values)
    assert lost[DROPPED].all()
    assert not lost[:, 1:].all(axis=1)[:DROPPED].any()
    assert lost[:, 0].sum() > 1  # a corner of the sheet, at which fewer edges meet
    same(recognize(filmed.with_name("film.nc")), recognize(filmed.with_name("film.csv")))


@pytest.mark.matrix
def test_damping_from_the_table_of_a_film(filmed):
    seen = history(filmed.with_name("film.csv"), [6, 8])
    found = fd.fit(filmed, [seen], parameters=[Parameter("damping.alpha", 8.0, 1.0, 50.0)])
    # 0.5 % when this was written; 3e-5 m rms of tracking beside a swing of 3 mm
    assert found["damping.alpha"].value == pytest.approx(ALPHA, rel=0.02)
    assert found["damping.alpha"].determined
    assert found.scores[0].count == np.isfinite(seen.values).sum()


@pytest.mark.matrix
def test_a_spectrum_wants_no_gaps_and_a_window_leaves_them_out(filmed):
    text = 'case = "sways.toml"\n[[parameters]]\nkey = "damping.alpha"\n[[data]]\n'
    text += 'kind = "spectrum"\nfile = "film.csv"\nnodes = [6]\nband = [5, 40]\n'
    plan = filmed.with_name("fit.toml")
    plan.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match="a spectrum needs every sample"):
        read_fit(plan)
    first = (DROPPED + 0.5) / RATE
    plan.write_text(f"{text}window = [{first}, 1]\n", encoding="utf-8")
    assert np.isfinite(read_fit(plan).data[0].observed()).all()


@pytest.mark.matrix
def test_both_files_of_photographs_hold_the_same_shapes(photographed):
    known = {"load_factor": FACTORS}
    binary = shapes(photographed.with_name("photos.nc"), **known)
    text = shapes(photographed.with_name("photos.csv"), **known)
    same(binary, text)
    assert binary.axes == text.axes == "xy"
    assert binary.load_factor.tolist() == FACTORS
    chosen = [shapes(photographed.with_name(f"photos.{e}"), [7, 6], **known) for e in ("nc", "csv")]
    same(*chosen)
    assert chosen[0].nodes == (7, 6)


def test_stiffness_from_the_table_of_photographs(photographed):
    text = 'case = "hangs.toml"\n[[parameters]]\nkey = "sheet.length_scale_ratio"\nguess = 2\n'
    text += 'lower = 1\nupper = 6\n[[data]]\nkind = "shapes"\nfile = "photos.csv"\n'
    text += f"nodes = [6, 7, 8]\nload_factor = {FACTORS}\n"
    plan = photographed.with_name("fit.toml")
    plan.write_text(text, encoding="utf-8")
    told = read_fit(plan)
    found = fd.fit(told.case, told.data, parameters=told.parameters)
    # 0.2 % when this was written
    assert found["sheet.length_scale_ratio"].value == pytest.approx(RATIO, rel=0.02)


@pytest.mark.matrix
@pytest.mark.parametrize("ending", ["nc", "csv"])
def test_what_tracks_cannot_say(filmed, photographed, ending):
    film, photos = filmed.with_name(f"film.{ending}"), photographed.with_name(f"photos.{ending}")
    with pytest.raises(InputError, match="only a fit file can name: kind"):
        recognize(photos)
    with pytest.raises(InputError, match="one for each of its 3 photographs"):
        shapes(photos, load_factor=[1.0])
    with pytest.raises(InputError, match="node 70 was not measured"):
        shapes(photos, nodes=[70], load_factor=FACTORS)
    with pytest.raises(InputError, match=rf"film\.{ending}: axis = \"w\": choose"):
        history(film, [6], axis="w")
    with pytest.raises(InputError, match="z"):  # the line of sight
        recognize(film, axis="z")
    with pytest.raises(InputError, match=r"node.*70"):
        history(film, [70])
    with pytest.raises(InputError, match='photographs, which have no times; use kind = "shapes"'):
        history(photos, [6])
