"""Result datasets: their contents, their files, and the case that they carry."""

from __future__ import annotations

import base64
import dataclasses
import math
import tomllib
from dataclasses import fields

import numpy as np
import pytest
import xarray as xr

import foldyn as fd
from foldyn.errors import FoldynWarning, InputError
from foldyn.materials import LinearHinge
from foldyn.results import case_of, load, save, trajectory_dataset
from foldyn.results.stored_case import document_of, sections_of
from named_models import named

SHEET = fd.Sheet(1e6, 0.25, 1.0 / 3.0, 0.1, 2.7)
CELLS = fd.patterns.miura((2, 1), a=1 / 3, b=0.7)
ENERGIES = ("kinetic", "strain_bars", "strain_folds", "strain_bends", "dissipated", "work")


def make_case(history=None, pattern=CELLS, **model) -> fd.Case:
    """Case with awkward numbers: thirds and tenths that no short decimal holds."""
    structure = fd.discretize(pattern, SHEET, **named(model))
    return fd.Case(
        structure,
        [fd.Fix("xmin"), fd.Fix([9, 7], "zx")],
        [fd.Force([12, 13], (0.1, 0, -1 / 3), history), fd.Force("xmax", (0, 1e-7, 0))],
        fd.Rayleigh(1 / 3, 1e-5),
    )


def moving_case(history) -> fd.Case:
    supports = [
        fd.Fix("xmin"), fd.Impose([9, 7], "z", [0.1, 1 / 3], history), fd.Impose("xmax", "z", 0.7),
        fd.BaseMotion("x", fd.Harmonic(1 / 3, 10), 1e-3 / 3), fd.BaseMotion("y", history),
    ]  # fmt: skip
    loads = [
        fd.Actuate("mountain", 200 / 3 + 180, history), fd.Actuate([5, 1], [100.1, 1 / 3]),
        fd.Force([12], (0, 0.1, 0), history),
    ]  # fmt: skip
    return fd.Case(fd.discretize(CELLS, SHEET, preset="plate"), supports, loads)


def dataset(case: fd.Case, samples: int = 5, **statistics) -> xr.Dataset:
    """Result of a motion with made-up numbers."""
    random = np.random.default_rng(0).normal
    shape = (samples, len(case.structure.nodes), 3)
    return trajectory_dataset(
        case, np.arange(samples) * 0.1, random(size=shape), random(size=shape),
        random(size=(samples, len(case.supported_dofs))),
        {name: random(size=samples) for name in ENERGIES},
        {"dt": 0.1, "steps": samples - 1, **statistics},
    )  # fmt: skip


def stored(ds: xr.Dataset, folder) -> xr.Dataset:
    """The result from its file."""
    save(ds, folder / "run.nc")
    return load(folder / "run.nc")


def same(found, wanted, names) -> None:
    for name in names:
        one, other = getattr(found, name), getattr(wanted, name)
        assert np.array_equal(one, other) or one == other, name


def assert_same_case(found: fd.Case, case: fd.Case) -> None:
    """Structure, supports, loads and damping agree to the last bit."""
    one, other = found.structure, case.structure
    geometry = ("vertices", "creases", "dihedrals", "faces", "assignments", "name")
    same(one.pattern, other.pattern, geometry)
    arrays = [f.name for f in fields(other) if isinstance(getattr(other, f.name), np.ndarray)]
    same(one, other, ["sheet", *arrays])
    same(one.options, other.options, [item.name for item in fields(other.options)])
    same(found, case, ["supports", "loads", "damping", "fixed", "imposed"])
    for name in ("load_terms", "imposed_terms", "base_terms", "actuation_terms"):
        for (values, history), (expected, law) in zip(
            getattr(found, name), getattr(case, name), strict=True
        ):
            np.testing.assert_array_equal(values, expected)
            assert history == law


def test_contents() -> None:
    case = make_case()
    ds = dataset(case, method="rk4", converged=True, note=None, energy_error=np.float64(1e-9))
    assert ds["displacement"].dims == ds["velocity"].dims == ("time", "node", "axis")
    assert ds["displacement"].shape == (5, len(case.structure.nodes), 3)
    assert (ds["displacement"].units, ds["velocity"].units) == ("m", "m/s")
    assert ds["axis"].values.tolist() == ["x", "y", "z"]
    assert ds["reaction"].dims == ("time", "support")
    # xmin: nodes 0, 1, 2 in all axes; then x and z of nodes 7 and 9
    assert ds["support_node"].values.tolist() == [0, 0, 0, 1, 1, 1, 2, 2, 2, 7, 7, 9, 9]
    assert "".join(ds["support_axis"].values) == "xyzxyzxyzxzxz"
    assert {(ds[name].dims, ds[name].units) for name in ENERGIES} == {(("time",), "J")}
    wanted = {"rerunnable": 1, "dt": 0.1, "steps": 4, "method": "rk4", "converged": 1}
    assert {name: ds.attrs[name] for name in wanted} == wanted
    assert "note" not in ds.attrs
    assert ds.attrs["foldyn_version"]
    np.testing.assert_array_equal(ds["rest_position"], case.structure.nodes)
    with pytest.raises(ValueError, match="rerunnable"):  # may not pose as something else
        dataset(case, rerunnable=True)


def test_the_text_of_the_case_refers_to_the_arrays_at_its_end() -> None:
    case = make_case(fd.Table(np.arange(500.0), np.zeros(500)), crease_rest=[100.0] * 10)
    ds = dataset(case)
    sections = sections_of(ds)
    assert 'array = "vertices"' in sections and "kind" in sections
    assert len(sections) < 2000  # no geometry, tables or per-crease values in it
    whole = tomllib.loads(str(ds["case"].values[()]))
    kind, shape, data = whole["arrays"]["tables_0_times"].split(" ")
    assert (kind, shape) == ("<f8", "500")
    np.testing.assert_array_equal(np.frombuffer(base64.b64decode(data)), np.arange(500.0))


PER_CREASE = {"crease_stiffness": np.linspace(0.1, 1 / 3, 10), "crease_rest": [100 / 3] * 10}
CHIRP = fd.Chirp(1 / 3, 20.1, 0.7, 10)
TOWER = fd.patterns.kresling(sides=8, storeys=2)
LETTERS = fd.Pattern(CELLS.vertices, CELLS.faces, ["U"] * 10, 'say "x"')
LAWS = {"fold_law": fd.EnhancedLinear(200 / 3, 320.1, "as_published"), "bend_law": LinearHinge()}
CENTER = CELLS.vertices[[0, 1, 3, 4]].mean(axis=0) + 1e-3
CASES = {
    "plain": make_case(fd.Pulse(0.1)),
    "n4b5": make_case(fd.HalfSine(1 / 3), scheme="n4b5", mass="consistent", bar_law="linear"),
    "triangles": make_case(fd.Harmonic(1 / 3, 10), TOWER, fold_law="linear"),
    "per crease": make_case(fd.Step(0.1), calibration="merlin2", **PER_CREASE),
    "for all creases": make_case(crease_stiffness=0.1, crease_rest=350 / 3),
    "laws": make_case(fd.Table([0, 0.1, 1 / 3], [0, 1 / 3, 0.2]), **LAWS),
    "letters": make_case(pattern=LETTERS),
    "given center": make_case(centers={0: CENTER}),
    "gravity and chirp": make_case(CHIRP).altered(
        loads=[fd.Gravity((0.1, 0, -9.81), CHIRP), fd.Gravity((0, 1 / 3, 0))]
    ),
    "moved and actuated": moving_case(fd.Ramp(1 / 3, smooth=True)),
}


@pytest.mark.matrix
@pytest.mark.parametrize("name", CASES)
def test_a_case_survives_a_file_exactly(name, tmp_path) -> None:
    ds = dataset(CASES[name])
    assert ds.attrs["rerunnable"] == 1, ds.attrs
    found = stored(ds, tmp_path)
    for each in (ds, found, stored(found, tmp_path)):
        assert_same_case(case_of(each), CASES[name])


def test_a_dataset_survives_a_file(tmp_path) -> None:
    ds = dataset(make_case(), method="rk4", sizes=[1.5, 2.5])
    found = stored(ds, tmp_path)
    xr.testing.assert_equal(found, ds)
    assert found["displacement"].attrs == ds["displacement"].attrs
    assert set(found.attrs) == set(ds.attrs)
    assert (found.attrs["method"], found.attrs["rerunnable"]) == ("rk4", 1)
    assert found["time"].dtype == np.float64
    np.testing.assert_array_equal(found.sel(node=3, axis="z")["velocity"], ds.velocity[:, 3, 2])
    assert [path.name for path in tmp_path.iterdir()] == ["run.nc"]  # nothing left beside


# ------------------------------------------------------------------ functions and tables
def fading(t):
    return math.exp(-3 * t)


@pytest.mark.parametrize(
    "case",
    [make_case(fading), make_case().altered(loads=[fd.Gravity((0, 0, -9.81), fading)])],
    ids=["force", "gravity"],
)
@pytest.mark.parametrize("start", [0.0, 2.0])
def test_functions_are_stored_sampled_at_stage_times(case, start, tmp_path) -> None:
    found = case_of(stored(dataset(case, start=start), tmp_path))
    table = found.loads[0].history
    assert isinstance(table, fd.Table) and table.times.size == 9
    assert table.times[[0, -1]].tolist() == [start, start + 0.4]
    for n in range(4):
        for time in (n * 0.1, n * 0.1 + 0.5 * 0.1, (n + 1) * 0.1):
            assert table(start + time) == pytest.approx(fading(start + time), rel=1e-14)
    assert_same_case(case_of(dataset(found)), found)


def test_loads_that_share_a_function_share_a_table() -> None:
    loads = [fd.Force(i, (1, 0, 0), fading) for i in range(3)]
    ds = dataset(fd.Case(MADE, loads=loads))
    tables = sorted(name for name in document_of(ds)[1] if name.startswith("tables_0"))
    assert tables == ["tables_0_times", "tables_0_values"]
    assert len(case_of(ds).load_terms) == 1


@pytest.mark.matrix
def test_functions_that_move_supports_are_stored_as_smooth_tables(tmp_path) -> None:
    found = case_of(stored(dataset(moving_case(lambda t: 1.0 - math.cos(3 * t))), tmp_path))
    moves, pushes = found.supports[1].history, found.loads[2].history
    assert found.supports[4].history == found.loads[0].history == moves
    assert moves.smooth and not pushes.smooth
    for time in np.arange(9) * 0.05:  # stage times of steps of 0.1 s
        assert moves(time) == pytest.approx(1.0 - math.cos(3 * time), abs=1e-15)
        assert pushes(time) == moves(time)
    times = np.array([0.1, 0.125, 0.3])
    np.testing.assert_allclose(moves.derivatives(times)[1], 3 * np.sin(3 * times), rtol=2e-3)
    assert_same_case(case_of(dataset(found)), found)


def drawn(case):
    """A motion, a path, modes and a frequency response."""
    yield fd.simulate(case, 0.01, method="dormand_prince")
    yield fd.trace(case, load_factors=[1.0])
    yield fd.modes(case, count=2)
    yield fd.frf(case, frequencies=[1.0, 2.0], drive=fd.Force("xmax", (0, 0, 1.0)))


@pytest.mark.matrix
def test_a_printed_result_shows_physics_and_a_copy_of_it_is_rerunnable(tmp_path) -> None:
    """Of the case it names one variable, whatever is stored; other programs keep that one."""
    made = fd.discretize(
        CELLS, SHEET, crease_stiffness=PER_CREASE["crease_stiffness"], preset="plate"
    )
    case = fd.Case(made, [fd.Fix("xmin")], [fd.Force("xmax", (0, 0, 1e-3), CHIRP)])
    hidden = set(document_of(dataset(case))[1]) - {"rest_position"}
    assert {"vertices", "faces", "tables_family0_creases", "tables_crease_stiffness"} <= hidden
    for result in drawn(case):
        assert len(str(result).splitlines()) <= 40
        assert not hidden & {*result.variables, *result.dims}
        assert not {"vertex", "face", "face_corner", "face_bound", "crease"} & {*result.dims}
        result.to_netcdf(tmp_path / "own.nc", engine="h5netcdf")
        with xr.open_dataset(tmp_path / "own.nc", engine="h5netcdf") as found:
            assert_same_case(case_of(found), case_of(result))


def test_tables_from_csv_are_stored_as_numbers(tmp_path) -> None:
    path = tmp_path / "pulse.csv"
    path.write_text("t [ms],f\n0,0\n5,0.1\n")
    ds = dataset(make_case(fd.Table.from_csv(path)))
    path.unlink()
    found = stored(ds, tmp_path)
    assert "pulse" not in str(found["case"].values[()])
    assert case_of(found).loads[0].history == fd.Table([0.0, 0.005], [0.0, 0.1])


# ------------------------------------------------------------------ what cannot be run again
CUBIC = fd.CustomHingeLaw(
    energy_of=lambda t, r: 0.25 * (t - r) ** 4,
    moment_of=lambda t, r: (t - r) ** 3,
    slope_of=lambda t, r: 3.0 * (t - r) ** 2,
    name="cubic",
)
MADE = fd.discretize(CELLS, SHEET, preset="plate")
CHANGED = dataclasses.replace(MADE, fold_stiffness=2.0 * MADE.fold_stiffness)
BARE = dataclasses.replace(MADE, pattern=None)
MOVED = [fd.Impose([9], "x", 0.1, lambda t: t), fd.BaseMotion("x", lambda t: t)]


@pytest.mark.parametrize(
    ("case", "text"),
    [
        (make_case(lambda t: t), "cannot be run again from itself: a load has a function"),
        *((fd.Case(MADE, [fd.Fix("xmin"), one]), "a motion has a function") for one in MOVED),
        (make_case(fold_law=CUBIC), 'fold_law is "cubic", a user\'s own law'),
        (fd.Case(CHANGED, loads=[fd.Force(0, (1, 0, 0))]), "differs from what discretize makes"),
        (fd.Case(BARE, loads=[fd.Force(0, (1, 0, 0))]), "has no pattern"),
    ],
)
def test_what_cannot_be_run_again_says_why(case, text, tmp_path) -> None:
    """Functions of time without time steps among it."""
    found = stored(dataset(case, steps=None), tmp_path)
    assert found.attrs["rerunnable"] == 0
    with pytest.raises(InputError, match=text):
        case_of(found)
    assert 'name = "cubic"' in str(found["case"].values[()]) or "cubic" not in text


def test_rebuilding_repeats_no_warning(recwarn) -> None:
    with pytest.warns(FoldynWarning):
        case = fd.Case(MADE, [fd.Fix(0)], [fd.Force([0, 1], (1, 0, 0))])
    recwarn.clear()
    case_of(dataset(case))
    assert not recwarn.list


# ------------------------------------------------------------------ files
@pytest.mark.matrix
def test_files_that_are_no_results(tmp_path) -> None:
    (tmp_path / "text.nc").write_text("not NetCDF")
    xr.Dataset({"a": ("x", [1.0])}).to_netcdf(tmp_path / "other.nc", engine="h5netcdf")
    save(dataset(make_case()).assign_attrs(foldyn_format=99), tmp_path / "newer.nc")
    save(dataset(make_case()).assign_attrs(foldyn_format=1), tmp_path / "older.nc")
    for name, text in (
        ("none", "there is no such file"),
        ("text", "is not a Foldyn result"),
        ("other", "is not a Foldyn result"),
        ("newer", "was written by Foldyn .* update"),
        ("older", "was written by Foldyn .* in format 1, .* compute it again"),
    ):
        with pytest.raises(InputError, match=rf"{name}\.nc: {text}"):
            load(tmp_path / f"{name}.nc")
    with pytest.raises(InputError, match="is not a Foldyn result"):
        case_of(xr.Dataset())


def test_places_that_cannot_be_written(tmp_path, monkeypatch) -> None:
    ds, file = dataset(make_case()), tmp_path / "run.nc"
    for what, place, text in (
        (ds, tmp_path / "none" / "run.nc", "does not exist; make it first"),
        (ds, tmp_path, "is a folder"),
        (ds, tmp_path / "run.csv", r"run\.csv: only NetCDF is written; name the file run\.nc"),
        (xr.Dataset(), file, "is not a Foldyn result"),
    ):
        with pytest.raises(InputError, match=text):
            save(what, place)
    save(ds, tmp_path / "damping-0.05")
    (tmp_path / "damping-0.05").unlink()
    save(ds, file)
    before = file.read_bytes()

    def fail(self, path, **_):
        path.write(b"half")
        raise OSError("disk full")

    monkeypatch.setattr(xr.Dataset, "to_netcdf", fail)
    with pytest.raises(OSError, match="disk full"):
        save(ds, file)
    assert file.read_bytes() == before
    assert [path.name for path in tmp_path.iterdir()] == ["run.nc"]
