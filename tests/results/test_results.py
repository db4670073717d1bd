"""Result datasets: their contents, their files, and the case that they carry."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
import xarray as xr

from foldyn.cases import (
    Actuate,
    BaseMotion,
    Case,
    Chirp,
    Fix,
    Force,
    Gravity,
    HalfSine,
    Harmonic,
    Impose,
    Pulse,
    Ramp,
    Rayleigh,
    Step,
    Table,
)
from foldyn.errors import FoldynWarning, InputError
from foldyn.materials import CustomHingeLaw, EnhancedLinear, LinearHinge
from foldyn.patterns import Pattern, kresling, miura
from foldyn.results import case_of, load, save, trajectory_dataset
from foldyn.structures import Sheet, discretize

SHEET = Sheet(1e6, 0.25, 1.0 / 3.0, 0.1, 2.7)


def make_case(history=None, pattern=None, **model) -> Case:
    """Case with awkward numbers: thirds and tenths that no short decimal holds."""
    structure = discretize(pattern or miura((2, 1), a=1 / 3, b=0.7), SHEET, **model)
    return Case(
        structure,
        [Fix("xmin"), Fix([9, 7], "zx")],
        [Force([12, 13], (0.1, 0, -1 / 3), history), Force("xmax", (0, 1e-7, 0))],
        Rayleigh(1 / 3, 1e-5),
    )


def dataset(case: Case, samples: int = 5, **statistics) -> xr.Dataset:
    """Result of a motion with made-up numbers."""
    rng = np.random.default_rng(0)
    n = len(case.structure.nodes)
    names = ("kinetic", "strain_bars", "strain_folds", "strain_bends", "dissipated", "work")
    return trajectory_dataset(
        case,
        np.arange(samples) * 0.1,
        rng.normal(size=(samples, n, 3)),
        rng.normal(size=(samples, n, 3)),
        rng.normal(size=(samples, len(case.supported_dofs))),
        {name: rng.normal(size=samples) for name in names},
        {"dt": 0.1, "steps": samples - 1, **statistics},
    )


def assert_same_case(found: Case, case: Case) -> None:
    """Structure, supports, loads and damping agree to the last bit."""
    assert found.structure.sheet == case.structure.sheet
    for name in ("vertices", "creases", "dihedrals"):
        np.testing.assert_array_equal(
            getattr(found.structure.pattern, name), getattr(case.structure.pattern, name)
        )
    for name in ("faces", "assignments", "name"):
        assert getattr(found.structure.pattern, name) == getattr(case.structure.pattern, name)
    for item in dataclasses.fields(case.structure):
        value = getattr(case.structure, item.name)
        if isinstance(value, np.ndarray):
            np.testing.assert_array_equal(getattr(found.structure, item.name), value)
    for item in dataclasses.fields(case.structure.options):
        value = getattr(case.structure.options, item.name)
        same = np.array_equal(getattr(found.structure.options, item.name), value)
        assert same or getattr(found.structure.options, item.name) == value
    assert found.supports == case.supports
    assert found.loads == case.loads
    assert found.damping == case.damping
    np.testing.assert_array_equal(found.fixed, case.fixed)
    assert len(found.load_terms) == len(case.load_terms)
    for (forces, history), (expected, law) in zip(found.load_terms, case.load_terms, strict=True):
        np.testing.assert_array_equal(forces, expected)
        assert history == law


def test_contents() -> None:
    case = make_case()
    ds = dataset(case, method="rk4", converged=True, note=None, energy_error=np.float64(1e-9))
    nodes, held = len(case.structure.nodes), len(case.supported_dofs)
    assert ds["displacement"].dims == ds["velocity"].dims == ("time", "node", "axis")
    assert ds["displacement"].shape == (5, nodes, 3)
    assert ds["displacement"].attrs["units"] == "m"
    assert ds["velocity"].attrs["units"] == "m/s"
    assert ds["axis"].values.tolist() == ["x", "y", "z"]
    assert ds["reaction"].dims == ("time", "support")
    assert ds["reaction"].shape == (5, held)
    # xmin: nodes 0, 1, 2 in all axes; then x and z of nodes 7 and 9
    assert ds["support_node"].values.tolist() == [0, 0, 0, 1, 1, 1, 2, 2, 2, 7, 7, 9, 9]
    assert "".join(ds["support_axis"].values) == "xyzxyzxyzxzxz"
    for name in ("kinetic", "strain_bars", "strain_folds", "strain_bends", "dissipated", "work"):
        assert ds[name].dims == ("time",)
        assert ds[name].attrs["units"] == "J"
    assert ds.attrs["rerunnable"] == 1
    assert (ds.attrs["dt"], ds.attrs["steps"]) == (0.1, 4)
    assert (ds.attrs["method"], ds.attrs["converged"]) == ("rk4", 1)
    assert "note" not in ds.attrs
    assert ds.attrs["foldyn_version"]
    np.testing.assert_array_equal(ds["vertices"], case.structure.pattern.vertices)
    start, end = ds["face_offsets"].values[2:4]
    assert tuple(ds["faces"].values[start:end]) == case.structure.pattern.faces[2]


def test_the_text_of_the_case_refers_to_the_geometry() -> None:
    case = make_case(Table(np.arange(500.0), np.zeros(500)), crease_rest=[100.0] * 10)
    text = str(dataset(case)["case"].values[()])
    assert 'variable = "vertices"' in text
    assert "kind" in text
    assert len(text) < 2000  # no geometry, tables or per-crease values in it


def test_a_statistic_may_not_pose_as_something_else() -> None:
    with pytest.raises(ValueError, match="rerunnable"):
        dataset(make_case(), rerunnable=True)


CASES = {
    "plain": lambda: make_case(Pulse(0.1)),
    "n4b5": lambda: make_case(HalfSine(1 / 3), scheme="n4b5", mass="consistent", bar_law="linear"),
    "triangles": lambda: make_case(
        Harmonic(1 / 3, 10), pattern=kresling(sides=8, storeys=2), fold_law="linear"
    ),
    "per crease": lambda: make_case(
        Step(0.1),
        crease_stiffness=np.linspace(0.1, 1 / 3, 10),
        crease_rest=[100 / 3] * 10,
        calibration="merlin2",
    ),
    "for all creases": lambda: make_case(crease_stiffness=0.1, crease_rest=350 / 3),
    "laws": lambda: make_case(
        Table([0, 0.1, 1 / 3], [0, 1 / 3, 0.2]),
        fold_law=EnhancedLinear(200 / 3, 320.1, "as_published"),
        bend_law=LinearHinge(),
    ),
    "letters": lambda: make_case(
        pattern=Pattern(miura((2, 1)).vertices, miura((2, 1)).faces, ["U"] * 10, 'say "x"')
    ),
    "given center": lambda: make_case(
        centers={0: miura((2, 1), a=1 / 3, b=0.7).vertices[[0, 1, 3, 4]].mean(axis=0) + 1e-3}
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_a_case_survives_a_file_exactly(name, tmp_path) -> None:
    case = CASES[name]()
    ds = dataset(case)
    assert ds.attrs["rerunnable"] == 1, ds.attrs
    assert_same_case(case_of(ds), case)
    save(ds, tmp_path / "run.nc")
    found = load(tmp_path / "run.nc")
    assert_same_case(case_of(found), case)
    save(found, tmp_path / "again.nc")
    assert_same_case(case_of(load(tmp_path / "again.nc")), case)


def test_a_dataset_survives_a_file(tmp_path) -> None:
    ds = dataset(make_case(), method="rk4", sizes=[1.5, 2.5])
    save(ds, tmp_path / "run.nc")
    found = load(tmp_path / "run.nc")
    xr.testing.assert_equal(found, ds)
    assert found["displacement"].attrs == ds["displacement"].attrs
    assert set(found.attrs) == set(ds.attrs)
    assert found.attrs["method"] == "rk4"
    assert found.attrs["rerunnable"] == 1
    assert found["time"].dtype == np.float64
    np.testing.assert_array_equal(found.sel(node=3, axis="z")["velocity"], ds.velocity[:, 3, 2])
    assert [path.name for path in tmp_path.iterdir()] == ["run.nc"]  # nothing left beside


def test_functions_are_stored_sampled_at_stage_times(tmp_path) -> None:
    case = make_case(lambda t: math.exp(-3 * t))
    save(dataset(case), tmp_path / "run.nc")
    found = case_of(load(tmp_path / "run.nc"))
    table = found.loads[0].history
    assert isinstance(table, Table)
    dt = 0.1
    for n in range(4):
        for time in (n * dt, n * dt + 0.5 * dt, (n + 1) * dt):
            assert table(time) == pytest.approx(math.exp(-3 * time), rel=1e-15)
    assert table.times.size == 9
    again = dataset(found)
    assert_same_case(case_of(again), found)


def test_a_run_that_starts_later_samples_functions_later() -> None:
    case = make_case(lambda t: math.exp(-3 * t))
    table = case_of(dataset(case, start=2.0)).loads[0].history
    assert table.times[[0, -1]].tolist() == [2.0, 2.4]
    for time in (2.0, 2.05, 2.35, 2.4):
        assert table(time) == pytest.approx(math.exp(-3 * time), rel=1e-14)


def test_loads_that_share_a_function_share_a_table() -> None:
    def push(t):
        return t * t

    structure = make_case().structure
    case = Case(structure, loads=[Force(i, (1, 0, 0), push) for i in range(3)])
    ds = dataset(case)
    assert sorted(name for name in ds if name.startswith("tables_0")) == [
        "tables_0_times",
        "tables_0_values",
    ]
    assert len(case_of(ds).load_terms) == 1


def test_gravity_and_chirp_survive_a_file(tmp_path) -> None:
    case = make_case(Chirp(1 / 3, 20.1, 0.7, 10))
    more = [Gravity((0.1, 0, -9.81), Chirp(1 / 3, 20.1, 0.7, 10)), Gravity((0, 1 / 3, 0))]
    case = dataclasses.replace(case, loads=[*case.loads, *more])
    save(dataset(case), tmp_path / "run.nc")
    assert_same_case(case_of(load(tmp_path / "run.nc")), case)


def moving_case(history) -> Case:
    structure = make_case().structure
    return Case(
        structure,
        [
            Fix("xmin"),
            Impose([9, 7], "x", [1 / 3, -0.1], history),
            Impose("xmax", "z", 0.7),
            BaseMotion("x", Harmonic(1 / 3, 10), 1e-3 / 3),
            BaseMotion("y", history),
        ],
        [
            Actuate("mountain", 200 / 3 + 180, history),
            Actuate([5, 1], [100.1, 1 / 3]),
            Force([12], (0, 0.1, 0), history),
        ],
    )


def test_moving_supports_and_actuated_creases_survive_a_file(tmp_path) -> None:
    case = moving_case(Ramp(1 / 3, smooth=True))
    save(dataset(case), tmp_path / "run.nc")
    found = case_of(load(tmp_path / "run.nc"))
    assert_same_case(found, case)
    np.testing.assert_array_equal(found.imposed, case.imposed)
    for name in ("imposed_terms", "base_terms", "actuation_terms"):
        pairs = zip(getattr(found, name), getattr(case, name), strict=True)
        for (values, history), (expected, law) in pairs:
            np.testing.assert_array_equal(values, expected)
            assert history == law


def test_functions_that_move_supports_are_stored_as_smooth_tables(tmp_path) -> None:
    case = moving_case(lambda t: 1.0 - math.cos(3 * t))
    save(dataset(case), tmp_path / "run.nc")
    found = case_of(load(tmp_path / "run.nc"))
    moves, pushes = found.supports[1].history, found.loads[2].history
    assert found.supports[4].history == found.loads[0].history == moves
    assert moves.smooth and not pushes.smooth
    for time in np.arange(9) * 0.05:  # stage times of steps of 0.1 s
        assert moves(time) == pytest.approx(1.0 - math.cos(3 * time), abs=1e-15)
        assert pushes(time) == moves(time)
    rates = moves.derivatives([0.1, 0.125, 0.3])[1]
    np.testing.assert_allclose(rates, 3 * np.sin(3 * np.array([0.1, 0.125, 0.3])), rtol=2e-3)
    assert_same_case(case_of(dataset(found)), found)


def test_a_function_that_moves_a_support_needs_time_steps() -> None:
    structure = make_case().structure
    for support in (Impose([9], "x", 0.1, lambda t: t), BaseMotion("x", lambda t: t)):
        case = Case(structure, [Fix("xmin"), support])
        assert dataset(case).attrs["rerunnable"] == 1
        with pytest.raises(InputError, match="a motion has a function of time as history"):
            case_of(dataset(case, steps=None))


def test_tables_from_csv_are_stored_as_numbers(tmp_path) -> None:
    path = tmp_path / "pulse.csv"
    path.write_text("t [ms],f\n0,0\n5,0.1\n")
    case = make_case(Table.from_csv(path))
    save(dataset(case), tmp_path / "run.nc")
    path.unlink()
    found = load(tmp_path / "run.nc")
    assert "pulse" not in str(found["case"].values[()])
    assert case_of(found).loads[0].history == Table([0.0, 0.005], [0.0, 0.1])


def test_gravity_may_follow_a_function(tmp_path) -> None:
    gravity = Gravity((0, 0, -9.81), lambda t: math.exp(-t))
    case = dataclasses.replace(make_case(), loads=[gravity])
    save(dataset(case), tmp_path / "run.nc")
    table = case_of(load(tmp_path / "run.nc")).loads[0].history
    assert table(0.05) == pytest.approx(math.exp(-0.05), rel=1e-15)


def test_a_function_without_time_steps_cannot_be_rerun() -> None:
    ds = dataset(make_case(lambda t: t), steps=None)
    assert ds.attrs["rerunnable"] == 0
    with pytest.raises(InputError, match="cannot be run again from itself: a load has a function"):
        case_of(ds)


def test_a_law_of_the_user_is_named_but_cannot_be_rerun(tmp_path) -> None:
    cubic = CustomHingeLaw(
        energy_of=lambda t, r: 0.25 * (t - r) ** 4,
        moment_of=lambda t, r: (t - r) ** 3,
        slope_of=lambda t, r: 3.0 * (t - r) ** 2,
        name="cubic",
    )
    save(dataset(make_case(fold_law=cubic)), tmp_path / "run.nc")
    found = load(tmp_path / "run.nc")
    assert found.attrs["rerunnable"] == 0
    assert 'name = "cubic"' in str(found["case"].values[()])
    with pytest.raises(InputError, match='fold_law is "cubic", a user\'s own law'):
        case_of(found)


def test_a_structure_changed_by_hand_cannot_be_rerun() -> None:
    structure = make_case().structure
    changed = dataclasses.replace(structure, fold_stiffness=2.0 * structure.fold_stiffness)
    bare = dataclasses.replace(structure, pattern=None)
    for other, text in ((changed, "differs from what discretize makes"), (bare, "has no pattern")):
        ds = dataset(Case(other, loads=[Force(0, (1, 0, 0))]))
        assert ds.attrs["rerunnable"] == 0
        with pytest.raises(InputError, match=text):
            case_of(ds)


def test_rebuilding_repeats_no_warning(recwarn) -> None:
    structure = make_case().structure
    with pytest.warns(FoldynWarning):
        case = Case(structure, [Fix(0)], [Force([0, 1], (1, 0, 0))])
    recwarn.clear()
    case_of(dataset(case))
    assert not recwarn.list


def test_files_that_are_no_results(tmp_path) -> None:
    with pytest.raises(InputError, match=r"none\.nc: there is no such file"):
        load(tmp_path / "none.nc")
    (tmp_path / "text.nc").write_text("not NetCDF")
    with pytest.raises(InputError, match=r"text\.nc: is not a Foldyn result"):
        load(tmp_path / "text.nc")
    xr.Dataset({"a": ("x", [1.0])}).to_netcdf(tmp_path / "other.nc", engine="h5netcdf")
    with pytest.raises(InputError, match=r"other\.nc: is not a Foldyn result"):
        load(tmp_path / "other.nc")
    with pytest.raises(InputError, match="is not a Foldyn result"):
        case_of(xr.Dataset())
    newer = dataset(make_case()).assign_attrs(foldyn_format=99)
    save(newer, tmp_path / "newer.nc")
    with pytest.raises(InputError, match=r"newer\.nc: was written by Foldyn .* update"):
        load(tmp_path / "newer.nc")


def test_places_that_cannot_be_written(tmp_path, monkeypatch) -> None:
    ds = dataset(make_case())
    with pytest.raises(InputError, match="does not exist; make it first"):
        save(ds, tmp_path / "none" / "run.nc")
    with pytest.raises(InputError, match="is a folder"):
        save(ds, tmp_path)
    with pytest.raises(
        InputError, match=r"run\.csv: only NetCDF is written; name the file run\.nc"
    ):
        save(ds, tmp_path / "run.csv")
    save(ds, tmp_path / "damping-0.05")
    (tmp_path / "damping-0.05").unlink()
    with pytest.raises(InputError, match="is not a Foldyn result"):
        save(xr.Dataset(), tmp_path / "run.nc")
    save(ds, tmp_path / "run.nc")
    before = (tmp_path / "run.nc").read_bytes()

    def fail(self, path, **_):
        path.write(b"half")
        raise OSError("disk full")

    monkeypatch.setattr(xr.Dataset, "to_netcdf", fail)
    with pytest.raises(OSError, match="disk full"):
        save(ds, tmp_path / "run.nc")
    assert (tmp_path / "run.nc").read_bytes() == before
    assert [path.name for path in tmp_path.iterdir()] == ["run.nc"]


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda ds: ds.drop_vars("face_offsets"), "lacks its variable face_offsets"),
        (lambda ds: ds.isel(node=[1, 2]), "use the whole result"),
        (lambda ds: ds.assign(case=((), "[pattern")), "damaged"),
        (lambda ds: ds.assign(case=((), "title = 1")), "damaged"),
        (lambda ds: ds.assign(faces=ds["faces"] + 1000), "vert"),
    ],
)
def test_damaged_results(change, text) -> None:
    with pytest.raises(InputError, match=text):
        case_of(change(dataset(make_case())))
