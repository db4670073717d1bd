"""Measurements and fit files as people write them."""

from __future__ import annotations

import fit_cases
import numpy as np
import pytest
import xarray as xr
from fit_cases import edit, refused

from foldyn.errors import InputError
from foldyn.experiment import ForceDisplacement, Shapes, Spectrum, TimeHistory
from foldyn.experiment.calibration.fit_file import is_fit_file, read_fit
from foldyn.experiment.calibration.fit_problem import Problem, problem
from foldyn.experiment.calibration.measured_files import recognize, shapes

FORCES = "displacement [mm],force [mN]\n-100,-8\n-200,-17\n-300,-27\n"
SHAPES = "load_factor,node,x [mm],z [mm]\n0.5,0,10,1\n1,0,20,2\n1,2,11,3\n"
SWAY = "time [ms];node 0 x [mm];node 2 x [mm]\n0;0;0\n100;1;2\n200;0;1\n300;-1;-1\n400;0;0\n"
FIT = """
title = "a fold"
case = "case.toml"
[[parameters]]
key = "sheet.length_scale_ratio"
lower = 0.5
upper = 4
[[parameters]]
key = "model.fold_law.theta1"
[ties]
"model.fold_law.theta2" = "335 - model.fold_law.theta1"
[[data]]
kind = "force_displacement"
file = "forces.csv"
sigma = 1e-5
[[data]]
kind = "shapes"
file = "shapes.csv"
sigma = 1e-4
held_out = true
set = { "sheet.thickness" = 0.02 }
[[data]]
kind = "history"
file = "sway.csv"
nodes = [0, 2]
sigma = 1e-4
case = "swung.toml"
[[data]]
kind = "spectrum"
file = "sway.csv"
nodes = [2]
band = [1, 6]
sigma = 1e-4
held_out = true
case = "swung.toml"
[solver]
searches = 3
"""


@pytest.fixture
def folder(tmp_path):
    for name, text in {
        "case.toml": fit_cases.PRESSED,
        "swung.toml": fit_cases.SWUNG,
        "forces.csv": FORCES,
        "shapes.csv": SHAPES,
        "sway.csv": SWAY,
        "fit.toml": FIT,
    }.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


def checked(path) -> Problem:
    """The model of a fit file, with all checks before the first evaluation."""
    plan = read_fit(path)
    return problem(plan.case, plan.data, plan.parameters, plan.ties)


def test_a_fit_file_says_all_that_fit_is_told(folder) -> None:
    plan = read_fit(folder / "fit.toml")
    assert plan.case == folder / "case.toml"
    assert plan.solver == {"searches": 3, "seed": 0, "processes": 1, "confidence": 0.95}
    assert plan.ties == {"model.fold_law.theta2": "335 - model.fold_law.theta1"}
    assert [(p.key, p.lower, p.upper) for p in plan.parameters] == [
        ("sheet.length_scale_ratio", 0.5, 4.0),
        ("model.fold_law.theta1", -np.inf, np.inf),
    ]
    forces, seen, sway, lines = plan.data
    assert isinstance(forces, ForceDisplacement)
    np.testing.assert_allclose(forces.displacement, [-0.1, -0.2, -0.3])
    np.testing.assert_allclose(forces.force, [-0.008, -0.017, -0.027])
    assert isinstance(seen, Shapes)
    assert seen.held_out
    assert seen.changes == {"sheet.thickness": 0.02}
    expected = [[[0.01, 0.001], [np.nan, np.nan]], [[0.02, 0.002], [0.011, 0.003]]]
    np.testing.assert_allclose(seen.values, expected)
    assert (seen.axes, seen.nodes) == ("xz", (0, 2))
    assert isinstance(sway, TimeHistory)
    np.testing.assert_allclose(sway.time, [0, 0.1, 0.2, 0.3, 0.4])
    np.testing.assert_allclose(sway.values[:, 1], [0, 0.002, 0.001, -0.001, 0])
    assert sway.case == folder / "swung.toml"
    assert isinstance(lines, Spectrum)
    assert lines.frequency.tolist() == [2.0, 4.0]


def test_fit_files_are_told_from_case_files(folder) -> None:
    assert is_fit_file(folder / "fit.toml")
    assert not is_fit_file(folder / "case.toml")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[solver]", "[solver]\nsearch = 1", "solver.search: unknown key; did you mean 'searches'"),
        ("lower = 0.5", "lower = 5", "parameters[0]: sheet.length_scale_ratio: lower = 5 is not"),
        ("lower = 0.5", "low = 5", "parameters[0].low: unknown key; did you mean 'lower'?"),
        ('kind = "shapes"', 'kind = "shape"', "data[1].kind = \"shape\": did you mean 'shapes'?"),
        ('file = "forces.csv"', 'file = "f.csv"', "f.csv: there is no such file"),
        ("nodes = [0, 2]\n", "", "data[2].nodes: missing"),
        ("nodes = [0, 2]", "nodes = [0, 1]", '"node 1 x": no such column; did you mean'),
        ("nodes = [0, 2]", 'nodes = "xmin"', "give the numbers of the nodes in sway.csv"),
        ("band = [1, 6]", "band = [6, 1]", "data[3]: band = [6, 1]: give two frequencies"),
        ("band = [1, 6]\n", "", "data[3]: band = None: give two frequencies"),
        ("band = [1, 6]", 'band = [1, "b"]', 'data[3]: band = [1, "b"]: must be numbers'),
        ("nodes = [0, 2]", "nodes = [0.5]", "data[2]: nodes = [0.5]: 0.5 is not a node number"),
        ("nodes = [0, 2]", "nodes = [0]\nwindow = 5", "data[2]: window = 5: give two times (s)"),
        ("nodes = [0, 2]", "nodes = [0]\ncolumns = 3", "columns = 3: give 1 headings"),
        ("nodes = [0, 2]", 'nodes = [0]\naxis = "w"', 'axis = "w": choose one of x, y, z'),
        ("sigma = 1e-5", 'columns = { "f" = "x" }', "give the headings of displacement and force"),
        ("band = [1, 6]", "band = [1, 6]\nwindw = [0, 1]", "data[3].windw: unknown key; did you"),
        ("335 - ", "335 -* ", 'tie model.fold_law.theta2 = "335 -* '),
    ],
)
def test_fit_files_with_mistakes(folder, old, new, message) -> None:
    edit(folder, old, new)
    with refused(message):
        checked(folder / "fit.toml")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("-200,-17", "-200,nan", 'line 3, column "force [mN]": "nan" is not a finite number'),
        ("-200,-17", "-200,", 'line 3, column "force [mN]": is empty'),
        ("-200,-17", "-200,x", 'line 3, column "force [mN]": "x" is not a number'),
        ("force [mN]", "force", 'column "force": has no unit'),
        ("force [mN]", "force [mm]", 'column "force [mm]": is a length, and a force in N'),
        ("force [mN]", "load [mN]", 'force = "force": no such column'),
    ],
)
def test_tables_with_mistakes(folder, old, new, message) -> None:
    edit(folder, old, new, "forces.csv")
    with refused(f"{folder / 'forces.csv'}: {message}"):
        read_fit(folder / "fit.toml")


@pytest.mark.parametrize("lost", ["", " ", '""'])
def test_an_empty_cell_is_a_lost_node(folder, lost) -> None:
    edit(folder, "200;0;1", f"200;{lost};1", "sway.csv")
    edit(folder, "1,0,20,2", f"1,0,{lost},2", "shapes.csv")
    edit(folder, 'kind = "spectrum"', 'kind = "history"')
    edit(folder, "band = [1, 6]\n", "")
    data = read_fit(folder / "fit.toml").data[1:]
    seen, sway, other = (getattr(one, "values", np.zeros(0)) for one in data)
    np.testing.assert_array_equal(np.isnan(sway), [[k == 2, False] for k in range(5)])
    assert np.isfinite(other).all()
    np.testing.assert_allclose(seen[1], [[np.nan, 0.002], [0.011, 0.003]])


@pytest.mark.parametrize(
    ("name", "old", "new", "message"),
    [
        ("sway.csv", "200;0;1", "200;nan;1", '4, column "node 0 x [mm]": "nan" is not a finite'),
        ("sway.csv", "200;0;1", "200;0;-inf", '4, column "node 2 x [mm]": "-inf" is not a finite'),
        ("sway.csv", "200;0;1", "200;lost;1", '4, column "node 0 x [mm]": "lost" is not a number'),
        ("sway.csv", "200;0;1", ";0;1", '4, column "time [ms]": is empty; every line needs a'),
        ("shapes.csv", "1,0,20,2", "1,0,20,nan", '3, column "z [mm]": "nan" is not a finite'),
        ("shapes.csv", "1,0,20,2", "1,,20,2", '3, column "node": is empty'),
        ("shapes.csv", "1,0,20,2", ",0,20,2", '3, column "load_factor": is empty'),
    ],
)
def test_a_cell_is_a_number_or_empty(folder, name, old, new, message) -> None:
    edit(folder, old, new, name)
    with pytest.raises(InputError) as caught:
        read_fit(folder / "fit.toml")
    assert f"{folder / name}: line {message}" in str(caught.value)
    remedy = "; leave the cell empty where a node was lost"
    assert str(caught.value).endswith(remedy) == ("is empty" not in message)


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ("0,,0\n1,,1\n2,,0\n", "node 0 has 0 values that are numbers; give at least two"),
        ("0,1,0\n1,,1\n2,,0\n", "node 0 has 1 values that are numbers; give at least two"),
        ("0,1,0\n1,,1\n2,1,0\n", "node 0 is constant"),
    ],
)
def test_histories_that_say_nothing(folder, lines, message) -> None:
    (folder / "sway.csv").write_text(f"time [s],node 0 x [m],node 2 x [m]\n{lines}")
    with pytest.raises(InputError) as caught:
        read_fit(folder / "fit.toml")
    assert "data[2]: " in str(caught.value)
    assert message in str(caught.value)
    if "1 values" in message:  # nobody has asked for this node
        assert recognize(folder / "sway.csv").nodes == (2,)
    else:
        with pytest.raises(InputError, match=message):
            recognize(folder / "sway.csv")


def test_shapes_are_told_once(folder) -> None:
    edit(folder, "1,2,11,3", "1,0,11,3", "shapes.csv")
    with pytest.raises(InputError, match="has two lines for node 0 at the load factor 1"):
        shapes(folder / "shapes.csv")
    edit(folder, "1,0,11,3", "1,2.5,11,3", "shapes.csv")
    with pytest.raises(InputError, match=r"node = 2\.5: must be a whole number"):
        shapes(folder / "shapes.csv")
    with pytest.raises(InputError, match="leave it out, the file has a column of that name"):
        shapes(folder / "shapes.csv", load_factor=[0.5, 1.0])


def test_of_many_columns_a_message_names_some(folder) -> None:
    names = ",".join(f"node {k} x [m]" for k in range(40))
    (folder / "sway.csv").write_text(f"time [s],{names}\n" + "0" + ",0" * 40 + "\n")
    edit(folder, "nodes = [0, 2]", "nodes = [70]")
    with pytest.raises(InputError, match=r"(?m)did you mean 'node 7 x'\? .* \(41 in all\)$"):
        read_fit(folder / "fit.toml")
    with pytest.raises(InputError, match=r"\(41 in all\); needed are"):
        recognize(folder / "sway.csv", axis="y")


def test_columns_tell_what_a_file_holds(folder) -> None:
    assert isinstance(recognize(folder / "forces.csv"), ForceDisplacement)
    assert recognize(folder / "shapes.csv").nodes == (0, 2)
    sway = recognize(folder / "sway.csv")
    assert isinstance(sway, TimeHistory)
    assert sway.nodes == (0, 2)
    with pytest.raises(InputError, match="the columns are time, node 0 x, node 2 x; needed are"):
        recognize(folder / "sway.csv", axis="z")


def tracks(along: str, lost: bool = True) -> xr.Dataset:
    """Tracks of two nodes, the second never seen along z."""
    values = np.arange(18.0).reshape(3, 2, 3) ** 2
    values[:, 1, 2] = np.nan
    values[1, 0] = np.nan if lost else values[1, 0]
    axes = {along: [0.0, 0.5, 1.0], "node": [8, 9], "axis": ["x", "y", "z"]}
    held = {"displacement": ((along, "node", "axis"), values)}
    return xr.Dataset(held, axes, {"foldyn_tracks": 1})


@pytest.mark.matrix
def test_tracks_of_a_film_are_histories(folder) -> None:
    tracks("time").to_netcdf(folder / "film.nc", engine="h5netcdf")
    one = recognize(folder / "film.nc", axis="y")
    assert isinstance(one, TimeHistory)
    assert one.nodes == (8, 9)
    np.testing.assert_allclose(one.values, [[1, 16], [np.nan, 100], [169, 256]])
    assert recognize(folder / "film.nc", axis="z").nodes == (8,)
    with pytest.raises(InputError, match="holds no displacements of nodes over photo"):
        shapes(folder / "film.nc", load_factor=[1, 2, 3])


@pytest.mark.matrix
def test_tracks_of_photographs_are_shapes(folder) -> None:
    tracks("photo").isel(axis=[0, 1, 2]).to_netcdf(folder / "photos.nc", engine="h5netcdf")
    one = shapes(folder / "photos.nc", nodes=[9], load_factor=[0.2, 0.5, 1.0])
    assert one.axes == "xy"
    np.testing.assert_allclose(one.values[:, 0], [[9, 16], [81, 100], [225, 256]])
    with pytest.raises(InputError, match="give one for each of its 3 photographs"):
        shapes(folder / "photos.nc")
    with pytest.raises(InputError, match="node 7 was not measured"):
        shapes(folder / "photos.nc", nodes=[7], load_factor=[1, 2, 3])
