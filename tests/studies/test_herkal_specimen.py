"""The study of the specimen: from tracked corners to parameters, each step against its truth."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest
import xarray as xr
from scipy.interpolate import CubicSpline

import foldyn as fd
from foldyn.analyses import read_case
from foldyn.analyses.reading import case_of_document, read_document
from foldyn.cli.main import main
from foldyn.errors import ComputationError, FoldynWarning, InputError
from foldyn.experiment import ForceDisplacement, TimeHistory
from foldyn.report.album import Album
from foldyn.studies.herkal import calibration
from foldyn.studies.herkal.calibration import DAMPING, FOLDS, FRONT, FULL, WATCHED
from foldyn.studies.herkal.specimen import evaluation, measured, page, prepared, synthetic, tasks
from foldyn.studies.herkal.specimen.evaluation import vibration_of
from foldyn.studies.herkal.specimen.measured import Data, data_of

pytestmark = [
    pytest.mark.filterwarnings("ignore:.*time step is too coarse"),  # as the data's
    pytest.mark.filterwarnings("ignore:the energy balance of the motion is off"),  # so it is
    pytest.mark.filterwarnings("ignore:damping. beta resists rotations"),  # as the paper's model
]

STEP = 1.0 / synthetic.PAPERS.rate
COARSER = 0.002  # s, step of the motions: half as many as in the study
COARSEST = 0.004  # s, where the model is compared with itself
FILMED = FRONT[:6]  # nodes of that film


# ---------------------------------------------------------------------- the synthetic sheet
@pytest.fixture(scope="module")
def motion(tmp_path_factory):
    """The model itself, glued, released from 5 mm."""
    folder = tmp_path_factory.mktemp("truth")
    case = calibration.released_case(folder, step=COARSEST, support="glued")
    return read_case(case).run()


@pytest.mark.matrix
def test_a_sheet_is_held_before_it_is_released(motion) -> None:
    u = motion.displacement.values
    moved = synthetic.held(motion, 0.1)
    x, time = moved.displacement.values, moved.time.values
    np.testing.assert_allclose(np.diff(time), COARSEST)
    np.testing.assert_array_equal(x[:25], np.repeat(u[:1], 25, axis=0))
    np.testing.assert_array_equal(x[25:], u)
    assert fd.case_of(moved).structure.options.mass == "circumcenter"  # it can still be filmed


def test_the_sheet_of_the_film_is_not_the_model(tmp_path) -> None:
    case = calibration.released_case(tmp_path, synthetic.OTHERWISE, support="glued")
    document = read_document(case)
    assert document["sheet"]["youngs_modulus"] == pytest.approx(0.97 * 1219e6)
    assert document["model"]["mass"] == "consistent"
    law = document["model"]["fold_law"]
    assert (law["kind"], law["law"]["theta1"]) == ("prony", FOLDS["model.fold_law.theta1"])
    softer = calibration.force_on_top(calibration.pressed([0.5], synthetic.SOFTER))
    model = calibration.force_on_top(calibration.pressed([0.5]))
    assert softer / model == pytest.approx(0.97, rel=1e-3)  # every stiffness has E as a factor


def test_supports_of_the_bottom() -> None:
    """Smooth plate: no rigid motion left. Glue on a plate: rotation about x. Glue alone: three."""
    document = read_document(fd.studies.find_case("herkal/specimen-modes"))
    free = {}
    for name, supports in calibration.SUPPORTS.items():
        document["supports"] = supports
        case = case_of_document(calibration.find_case("herkal/specimen-modes"), document).case()
        free[name] = int(fd.modes(case, count=8, secant=0.5)["rigid"].sum())
    assert free == {"plate": 0, "glued": 1, "glue alone": 3}


# ---------------------------------------------------------------------- preparation
def ringing(time, late=0.0, height=4e-3):
    """Held at `height` until `late`, then a decaying cosine about 0."""
    since = np.maximum(time - late, 0.0)
    return height * np.exp(-9.0 * since) * np.cos(2.0 * np.pi * 9.5 * since)


TIME = np.arange(240) * STEP
LATE = 20.4 * STEP


def film(**nodes):
    columns = {int(name[1:]): values for name, values in nodes.items()}
    return TimeHistory(
        nodes=list(columns), time=TIME, values=np.stack(list(columns.values()), 1), name="film"
    )


def test_preparation_starts_at_the_first_turning_point() -> None:
    offset = 7e-4
    found = prepared.prepare(film(n8=ringing(TIME, LATE) + offset, n22=0.5 * ringing(TIME, LATE)))
    assert found.nodes == [8, 22]
    start = found.released
    assert start == pytest.approx(LATE, abs=STEP)
    turn = LATE + (np.pi - np.arctan(9.0 / (2.0 * np.pi * 9.5))) / (2.0 * np.pi * 9.5)
    assert found.history.time[0] + start == pytest.approx(turn, abs=STEP)
    assert abs(found.history.time[-1] - calibration.SEEN) < 1.5 * STEP
    np.testing.assert_allclose(found.before, [4e-3, 2e-3], rtol=1e-2)  # the last 10 % still ring
    expected = ringing(found.history.time + start, LATE)
    np.testing.assert_allclose(found.history.values[:, 0], expected, atol=4e-5)
    np.testing.assert_array_equal(found.history.values, found.whole)
    assert found.history.align == 0.015 and found.history.detrend == "linear"
    assert next(iter(found.steps)) == "as tracked" and len(found.steps) == 5


@pytest.mark.parametrize("cut", [-1, 0, 2, 6])
def test_a_film_that_begins_with_the_release_or_after_it(cut) -> None:
    """The press would be taken for less than it was."""
    x = ringing(TIME + cut * STEP)
    with pytest.raises(InputError, match=r"node 8 is not still for 0.0125 s before its fastest"):
        prepared.prepare(film(n8=x))


def test_the_held_position_is_a_mean() -> None:
    """Of 12 frames or so: their noise must not become the press."""
    noise = np.where(np.arange(240) % 2, 1e-4, -1e-4) * (TIME < LATE)
    found = prepared.prepare(film(n8=ringing(TIME, LATE) + noise))
    assert found.before[0] == pytest.approx(4e-3, abs=3e-5)


@pytest.mark.parametrize("duration", [0.15, 0.4])
def test_a_film_that_shows_the_pressing_too(duration) -> None:
    """At rest, pressed within some time, held, released: what phones film."""
    time = np.arange(480) * STEP
    pressing = np.clip((time - 0.1) / duration, 0.0, 1.0) ** 2 * 4e-3
    late = 0.1 + duration + 0.2 + 0.4 * STEP
    wander = 1e-4 * np.sin(2.0 * np.pi * 0.8 * time)  # of the hand
    x = np.where(time < late, pressing + wander, ringing(time, late) + wander[-1])
    history = TimeHistory(nodes=[8], time=time, values=x[:, None], name="film")
    found = prepared.prepare(history)
    assert found.released == pytest.approx(late, abs=1.5 * STEP)
    assert found.before[0] == pytest.approx(4e-3, rel=0.05)


def test_times_of_a_table_are_rounded() -> None:
    exact = film(n8=ringing(TIME, LATE))
    found = prepared.prepare(replace(exact, time=np.round(TIME, 5)))
    np.testing.assert_allclose(np.diff(found.history.time), STEP, rtol=1e-4)
    with pytest.raises(InputError, match="not evenly spaced"):
        prepared.prepare(replace(exact, time=TIME + 1e-3 * (np.arange(240) % 2)))


def test_gaps() -> None:
    x = {f"n{n}": ringing(TIME, LATE) for n in (8, 15, 22, 29)}
    x["n8"][60:64] = np.nan  # short: filled for spectra
    x["n15"][60:75] = np.nan  # long
    x["n22"][34:] = np.nan  # lost for good
    x["n29"][30:35] = np.nan  # over the turning point, where the record begins
    found = prepared.prepare(film(**x))
    assert found.nodes == [8, 15, 29]
    missing = ~np.isfinite(found.history.values)
    assert missing.sum(axis=0).tolist()[:2] == [4, 15]
    whole = np.isfinite(found.whole).all(axis=0)
    assert whole.tolist() == [True, False, True]
    true = ringing(found.history.time + found.released, LATE)
    shift = np.nanmean(found.history.values[:, 0] - true)
    np.testing.assert_allclose(found.whole[:, 0] - shift, true, atol=3e-5)  # splined
    kept = found.whole_of(found.of([15, 29], "two"))
    assert kept.nodes == (29,) and kept.align == 0.0
    assert found.whole_of(found.of([15], "one")) is None


@pytest.mark.parametrize(
    ("nodes", "message"),
    [
        ({"n9": ringing(TIME)}, "node 8 was not measured; its motion shows the release"),
        ({"n8": np.where(np.arange(240) % 3, np.nan, ringing(TIME, LATE)), "n9": TIME}, None),
        (
            {"n8": np.where((TIME > 0.3) & (TIME < 0.6), np.nan, ringing(TIME, LATE))},
            "node 8 was lost for more than 8 frames while it swings",
        ),
        ({"n8": 1e-3 * np.exp(-np.maximum(TIME - 0.1, 0) / 0.1)}, "film: node 8 does not swing"),
    ],
)
def test_what_cannot_be_prepared(nodes, message) -> None:
    if message is None:  # two of three frames lost: still a record, by its short gaps
        assert prepared.prepare(film(**nodes)).nodes == [9]
        return
    with pytest.raises(InputError, match=message):
        prepared.prepare(film(**nodes))


# ---------------------------------------------------------------------- static test
@pytest.fixture(scope="module")
def path():
    return calibration.pressed(evaluation.FACTORS)


@pytest.mark.matrix
def test_where_on_the_path_a_shape_lies(path) -> None:
    there = calibration.pressed([0.3333])
    moved = there.displacement.sel(node=list(FRONT), axis="x").values[0]
    found = evaluation.load_factor(path, FRONT, moved)
    assert found == pytest.approx(0.3333, abs=1e-5)  # the spline between steps of 2 mm
    seen = np.where(np.arange(len(FRONT)) % 4, np.nan, moved)
    assert evaluation.load_factor(path, FRONT, seen) == pytest.approx(0.3333, abs=1e-5)
    assert evaluation.load_factor(path, [WATCHED], moved[[3]]) == pytest.approx(0.3333, abs=1e-5)
    with pytest.raises(InputError, match="no front node was measured"):
        evaluation.load_factor(path, FRONT, np.full(24, np.nan))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda u: -u, "move upwards: turn the sign of x, which points down"),
        (lambda u: 5.0 * u, "more than the 61.6 mm of the top that are tried; is the unit"),
        (lambda u: 3.5 * u, "more than the 61.6 mm of the top that are tried; is the unit"),
        (lambda u: u[::-1], "they move unlike the model pressed from above"),
    ],
)
def test_shapes_that_no_state_of_the_model_has(path, change, message) -> None:
    moved = calibration.pressed([0.3333]).displacement.sel(node=list(FRONT), axis="x").values[0]
    with pytest.raises(InputError, match=message):
        evaluation.load_factor(path, FRONT, change(moved))


@cache
def photographed(softer=False):
    """Tracks of photographs of the model under the three weights, without error."""
    changes = synthetic.SOFTER if softer else None
    there = calibration.pressed([0.0, *calibration.weighed(changes)], changes)
    moved = there.displacement.values[:, :63].copy()
    moved[..., 2] = np.nan
    return xr.Dataset(
        {"displacement": (("photo", "node", "axis"), moved)},
        {"node": np.arange(63), "axis": list("xyz"), "load": ("photo", [0, *calibration.WEIGHTS])},
        {"foldyn_tracks": 1, "match_rms_px": np.full(4, 0.2), "metres_per_pixel": 8e-5},
    ).assign(rest_position=there.rest_position[:63].drop_vars(["node", "axis"]))


def photographs(softer=False):
    """A copy of them, to be changed."""
    return photographed(softer).copy(deep=True)


@pytest.mark.matrix
def test_folds_from_tracked_photographs() -> None:
    forces, shapes = evaluation.static_test(photographs(), "synthetic")
    np.testing.assert_allclose(forces.force, calibration.WEIGHTS)
    true = FULL * calibration.weighed()
    np.testing.assert_allclose(forces.displacement, true, atol=1e-6)
    assert shapes.values.shape == (3, 24, 2)
    assert shapes.sigma == pytest.approx(0.2 * 8e-5 / np.sqrt(2.0))  # of one coordinate
    found = calibration.fit_folds([forces, shapes])
    for key, value in FOLDS.items():
        assert found[key].value == pytest.approx(value, rel=2e-3)
    with pytest.raises(InputError, match="track them with --loads"):
        evaluation.static_test(photographs().drop_vars("load"), "")


@pytest.mark.matrix
def test_a_specimen_that_slid_along_y() -> None:
    """It stands on the plate unglued."""
    straight, slid = photographs(), photographs()
    slid["displacement"][..., 1] += np.array([0.0, 1e-3, -2e-3, 3e-3])[:, None]
    shapes = [evaluation.static_test(one, "")[1].values for one in (straight, slid)]
    np.testing.assert_allclose(shapes[1], shapes[0], atol=1e-12)


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t: t.drop_vars("displacement"), "tracked without a model"),
        (lambda t: t.isel(node=slice(0, 9)), "tracked with another model"),
        (lambda t: t.assign(rest_position=1.2 * t.rest_position), "tracked with another model"),
        (lambda t: t.assign(displacement=np.nan * t.displacement), "no front node was measured"),
        (lambda t: t.assign(displacement=-t.displacement), "photograph 1: .* turn the sign"),
    ],
)
def test_tracks_that_are_not_of_the_specimen(change, message) -> None:
    with pytest.raises(InputError, match=message):
        evaluation.static_test(change(photographs()), "")


@pytest.mark.matrix
def test_a_softer_sheet_is_taken_for_softer_folds() -> None:
    """What the model cannot say goes into the parameters: bends are softer, too."""
    found = calibration.fit_folds(evaluation.static_test(photographs(softer=True), ""))
    ratio, theta = found.estimates
    assert 2.7 < ratio.value < 1.05 * 2.7
    assert 73.0 < theta.value < 75.0
    assert found.scores[0].relative < 0.01


# ---------------------------------------------------------------------- release
def filmed(motion, time):
    """Motion along x of nodes of the front, which begins after 32.1 ms."""
    along = CubicSpline(motion.time, motion.displacement.sel(node=list(FILMED), axis="x"))
    return along(np.clip(time - 0.0321, 0.0, motion.time.values[-1]))


@pytest.fixture(scope="module")
def released(motion, tmp_path_factory):
    """Fit to the model's own motion, filmed at 240 frames/s, released between two frames."""
    time = np.arange(0.0, 0.62, STEP)
    noise = 1e-7 * np.random.default_rng(0).standard_normal((len(time), len(FILMED)))
    along = filmed(motion, time) + 3e-4 + noise  # m; searches would go on where all is exact
    history = TimeHistory(nodes=FILMED, time=time, values=along, name="film", label="synthetic")
    folder = tmp_path_factory.mktemp("released")
    return evaluation.fit_release(history, folder, {}, COARSEST)


@pytest.mark.matrix
def test_damping_and_press_are_found_again(released) -> None:
    assert released.press == pytest.approx(calibration.PRESSED, rel=5e-3)  # it still rings
    fit = released.fits["glued"]
    for key, value in DAMPING.items():
        assert fit[key].value == pytest.approx(value, rel=0.02)
    node_8, others = fit.scores[:2]
    assert not node_8.held_out and others.held_out
    assert node_8.relative < 0.01 and others.relative < 0.02
    assert [score.name for score in fit.scores[2:]] == [
        "node 8, frequencies", "other front nodes, frequencies",
    ]  # fmt: skip


@pytest.mark.matrix
def test_the_support_decides_frequency_and_damping(released) -> None:
    """Held on the plate near the paper's 9.5 Hz, by the glue alone far below."""
    motions = evaluation.motions(released)
    front = evaluation.compared(released, motions)
    assert front.sizes["support"] == 3 and front.node.values.tolist() == list(FILMED)
    frequency = {
        str(name): vibration_of(front.model.sel(support=name, node=WATCHED).values, STEP).peak
        for name in front.support.values
    }
    assert frequency["plate"] == pytest.approx(9.5, rel=0.03)
    assert frequency["glued"] == pytest.approx(9.5, rel=0.03)
    assert frequency["glue alone"] < 7.5
    glued = front.model.sel(support="glued") - front.measured
    assert float(np.sqrt((glued**2).mean())) < 1e-5
    ideal = released.fits["plate"]
    assert ideal["damping.alpha"].value > 1.2 * DAMPING["damping.alpha"]  # pays for the glue


# ---------------------------------------------------------------------- files
@pytest.fixture
def tables(tmp_path):
    (tmp_path / "weights.csv").write_text("displacement [mm],force [N]\n20,0.125\n36,0.226\n")
    rows = [f"{t:.6f},{x:.9f}" for t, x in zip(TIME, ringing(TIME, LATE), strict=True)]
    (tmp_path / "film.csv").write_text("time [s],node 8 x [m]\n" + "\n".join(rows) + "\n")
    rows = [f"{t:.6f},{-x:.9f}" for t, x in zip(TIME, ringing(TIME, LATE), strict=True)]
    (tmp_path / "reversed.csv").write_text("time [s],node 8 x [m]\n" + "\n".join(rows) + "\n")
    (tmp_path / "shapes.csv").write_text("load_factor,node,x [m]\n0.5,8,0.02\n")
    (tmp_path / "load.png").write_bytes(b"")
    (tmp_path / "grams.csv").write_text("displacement [mm],force [g]\n20,12.75\n36,23.05\n")
    forces = {
        "one": "20,0.125", "metres": "20000,0.125\n36000,0.226", "upwards": "-20,0.1\n36,0.2",
        "pulled": "20,-0.125\n36,-0.226",
    }  # fmt: skip
    for name, lines in forces.items():
        (tmp_path / f"{name}.csv").write_text(f"displacement [mm],force [N]\n{lines}\n")
    slow = "\n".join(f"{k / 30:.5f},{x:.9f}" for k, x in enumerate(ringing(np.arange(40) / 30)))
    (tmp_path / "slow.csv").write_text(f"time [s],node 8 x [m]\n{slow}\n")
    (tmp_path / "other.csv").write_text("time [s],node 9 x [m]\n0,0.1\n1,0.2\n2,0.1\n")
    (tmp_path / "film.mp4").write_text("no film")
    return tmp_path


def test_files_are_sorted_by_what_they_hold(tables) -> None:
    found = data_of([str(tables / "film.csv"), str(tables / "weights.csv")])
    assert [file.name for file in found.files.values()] == ["weights.csv", "film.csv"]
    assert found.film is None and not found.synthetic and found.label == "measured"
    assert isinstance(measured.measurement(found.static, ""), ForceDisplacement)
    before = found.digests()
    (tables / "weights.csv").write_text("displacement [mm],force [N]\n20,0.125\n36,0.227\n")
    assert found.digests()["static"] != before["static"]
    assert found.digests()["release"] == before["release"]
    assert data_of([]).synthetic
    first, then = tasks.parts(synthetic.COARSE, found)
    assert first == [] and [one.part for one in then] == ["fit", "response"]
    first, then = tasks.parts(synthetic.COARSE, Data())
    assert [one.part for one in first] == ["photographs", "film"]


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (["nothing.csv"], "there is no such file"),
        (["."], "is a folder"),
        (["grams.csv"], "the unit [g] is not known"),
        (["other.csv"], "node 8 was not measured; its motion shows the release"),
        (["weights.csv", "weights.csv"], "is a static test, too; give one of each"),
        (["one.csv"], "1 measured force(s); at least 2"),
        (["metres.csv"], "displacements of the top are 2e+04 to 3.6e+04 mm"),
        (["upwards.csv"], "must be positive (downwards)"),
        (["pulled.csv"], "a force is -0.226 N"),
        (["reversed.csv"], "turn the sign of x, which points down"),
        (["slow.csv"], "30 frames per second are too few"),
        (["load.png"], "track photographs first, foldyn track"),
        (["shapes.csv"], "shapes without forces say nothing of the stiffness"),
        (["film.mp4"], "film.mp4"),
    ],
)
def test_data_that_cannot_be_used(tables, capsys, names, message) -> None:
    given = [str(tables / name) for name in names]
    out = tables / "out"
    assert main(["study", "herkal", "--quick", "--out", str(out), "--data", *given]) == 2
    told = capsys.readouterr().err
    assert message in told and "Traceback" not in told
    assert not out.exists()


def test_parts_need_those_before_them(tables) -> None:
    _, (fit, response) = tasks.parts(synthetic.COARSE, Data())
    with pytest.raises(ComputationError, match="it needs specimen-photographs, which failed"):
        fit.make(tables)
    with pytest.raises(ComputationError, match="it needs specimen-fit, which failed"):
        response.make(tables)
    assert not fit.there(tables) and page.sections(tables, [fit, response], Album(tables)) == []


@pytest.mark.matrix
def test_a_table_of_weights_alone(tables, monkeypatch) -> None:
    """Folds are fitted, no damping; other data are computed anew."""
    (_, (fit, response)) = tasks.parts(synthetic.COARSE, data_of([str(tables / "weights.csv")]))
    fit.make(tables)
    assert fit.there(tables) and not response.there(tables)
    found = tasks.read_found(tables / tasks.FOLDER)
    assert set(found) == {"folds", "weights", "changes"}
    assert found["weights"]["force"] == [0.125, 0.226]
    told = page.sections(tables, [fit, response], Album(tables))
    text = "".join(section.html() for section in told)
    assert "static: weights.csv" in text and "synthetic" not in text
    other = replace(fit, data=Data(static=tables / "film.csv"))
    assert not other.there(tables)
    file = tables / tasks.FOLDER / tasks.FOUND
    sound = file.read_text()
    for damaged in (sound.replace("0.125", "0.126"), "{}", "[1]", "[" * 9999, '{"changes": 1}', ""):
        file.write_text(damaged)
        with pytest.warns(FoldynWarning, match=r"found\.json: is damaged.*computed again"):
            assert not fit.there(tables)
        if "folds" not in damaged:
            with pytest.raises(InputError, match=r"found\.json: is damaged"):
                tasks.read_found(tables / tasks.FOLDER)
    file.write_text(sound)
    for damaged in (b"\xff", b"", b"{}\n[]\n"):
        stamp = fit.file(tables)
        stamp.write_bytes(damaged)
        assert not fit.there(tables)
    fit.make(tables)
    assert fit.there(tables)
    monkeypatch.setattr(tasks, "program", lambda *_: "another")
    assert not fit.there(tables)


# ---------------------------------------------------------------------- the whole chain
@pytest.mark.matrix
def test_from_photographs_and_a_film_to_a_calibrated_model(tmp_path, monkeypatch) -> None:
    """The model is wrong in mass, stiffness and memory; parameters come out near all the same."""
    pytest.importorskip("cv2")
    shipped, few = calibration.shipped, {"first": 1, "last": 25, "count": 9}

    def with_few(name, changes=None):
        frequencies = {"analysis.frequencies": few} if name == "specimen-frf" else {}
        return shipped(name, {**(changes or {}), **frequencies})

    def of_few(shot, exposure, sensor=synthetic.Shot.sensor):
        return replace(sensor(shot, exposure), samples=4)  # rays in each pixel instead of 10

    fit_damping, fits = calibration.fit_damping, []

    def fit_once(case, film, **options):
        """That with the film's support stands for the other's, too."""
        if not fits:
            fits.append(fit_damping(case, film, **options))
        return fits[0]

    fit_release = partial(evaluation.fit_release, step=COARSER)
    near = replace(synthetic.PAPERS, size=(1814, 3226), metres_per_pixel=1e-4)
    monkeypatch.setattr(tasks, "PAPERS", near)
    monkeypatch.setattr(calibration, "fit_damping", fit_once)
    monkeypatch.setattr(calibration, "shipped", with_few)
    monkeypatch.setattr(synthetic.Shot, "sensor", of_few)
    monkeypatch.setattr(evaluation, "fit_release", fit_release)
    shot = replace(synthetic.COARSE, free=0.4, size=(808, 856), metres_per_pixel=1.5e-4)
    first, then = tasks.parts(shot, Data())
    for one in (*first, *then):
        one.make(tmp_path)
        assert one.there(tmp_path)
    inside = tmp_path / tasks.FOLDER
    assert not list(inside.glob("**/*.mkv"))  # most of a gigabyte at the paper's resolution
    found = json.loads((inside / tasks.FOUND).read_text())
    values = {one["key"]: one["value"] for one in found["folds"]["parameters"]}
    assert values["sheet.length_scale_ratio"] == pytest.approx(2.7, rel=0.05)
    assert values["model.fold_law.theta1"] == pytest.approx(75.0, abs=2.0)
    assert found["press"] == pytest.approx(calibration.PRESSED, rel=0.05)  # some of it drifts
    for one in found["damping"]["glued"]["parameters"]:
        assert one["value"] == pytest.approx(DAMPING[one["key"]], rel=0.15)
    misfits = {one["name"]: one["relative"] for one in found["damping"]["glued"]["measurements"]}
    assert misfits["node 8"] < 0.1 and misfits["other front nodes"] < 0.15
    told = page.sections(tmp_path, then, Album(tmp_path))
    text = "".join(section.html() for section in told)
    assert "SYNTHETIC" in text and text.count("<figure>") == 10


# ---------------------------------------------------------------------- the page
def front_of(**models):
    """What `compared` gives, by hand: nodes 1 and 8, the film a cosine of 9.5 Hz."""
    time = np.arange(120) * STEP
    film = np.stack([ringing(time), 0.5 * ringing(time)], axis=1)
    x = np.stack([film * models.get(name, 1.0) for name in ("plate", "glued", "glue alone")])
    if "alone" in models:
        since = np.exp(-9.0 * time) * np.cos(2.0 * np.pi * models["alone"] * time)
        x[2] = 4e-3 * np.stack([since, 0.5 * since], axis=1)
    along = ("time", "node")
    seen = {"measured": (along, film), "whole": (along, film.copy())}
    return xr.Dataset(
        {**seen, "model": (("support", *along), x)},
        {"time": time, "node": [1, 8], "support": ["plate", "glued", "glue alone"]},
    )


def test_agreement_of_film_and_model_by_node() -> None:
    front = front_of(glued=1.1, plate=0.7)
    table = page._agreement(front)
    assert list(table.header)[2:] == [
        "time: glued (%)", "time: ideal (%)", "frequency: glued (%)", "frequency: ideal (%)",
    ]  # fmt: skip
    for row, node, fitted in zip(table.rows, (1, 8), (False, True), strict=True):
        assert row[0] == node and (row[1] == "fitted") == fitted
        np.testing.assert_allclose(row[2:], [10.0, 30.0, 10.0, 30.0], rtol=1e-9)
    front["whole"][:, 1] = np.nan
    assert page._agreement(front).rows[1][4:] == [None, None]


def test_what_is_said_of_the_supports_is_what_was_found() -> None:
    def told(front):
        return page._vibrations(front, Data())[-1].text

    assert "So the plate held the row" in told(front_of(alone=6.0))
    assert "So the plate held" not in told(front_of(alone=9.4))
    flat = front_of()
    flat["model"][2] = 0.0
    assert "no peak" in told(flat)


@pytest.mark.matrix
def test_true_motion_is_taken_at_the_times_of_the_film(released, motion) -> None:
    """The film began 32.1 ms before the release."""
    positions = np.zeros((240, 63, 3))
    time = np.arange(240) * STEP
    positions[:, list(FILMED), 0] = filmed(motion, time)
    truth = xr.Dataset(
        {"position": (("time", "node", "axis"), positions)},
        {"time": time, "node": np.arange(63), "axis": list("xyz")},
    )
    motions = evaluation.motions(released)
    front = evaluation.compared(released, motions, truth)
    assert float(np.abs(front.true - front.measured).max()) < 1e-6
    assert page._tracked(front)[0].text.startswith("The front nodes were measured in 100.0%")


@pytest.mark.matrix
def test_a_fit_that_is_none_says_so(released) -> None:
    summary = released.fits["glued"].summary()
    assert page._doubt(summary, "node 8") == []
    summary["measurements"][0]["relative"] = 0.9
    summary["parameters"][1] |= {"at_bound": True, "note": "at its bound: the data pull it further"}
    (told,) = page._doubt(summary, "node 8")
    assert told.text.startswith("DO NOT USE") and "misfit is 90%" in told.text
    assert "beta (s) is at its bound" in told.text


@pytest.mark.matrix
def test_other_data_in_a_folder_leave_nothing_of_the_first(tables) -> None:
    """Figures of a synthetic study must not stand on the page of measured data."""
    inside = tables / tasks.FOLDER
    for name in ("folds/data-1.png", "film.png", "damping/data-0.png", tasks.FILM):
        (inside / name).parent.mkdir(parents=True, exist_ok=True)
        (inside / name).write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(20))
    given = data_of([str(tables / "weights.csv")])
    _, (fit, response) = tasks.parts(synthetic.COARSE, given)
    fit.make(tables)
    told = page.sections(tables, [fit, response], Album(tables))
    text = "".join(section.html() for section in told)
    assert text.count("<figure>") == 1 and "Release" not in text and "corners" not in text
    assert not (inside / "damping").exists()
    assert tasks.Part("film", data=given).settings()["data"] == {}
