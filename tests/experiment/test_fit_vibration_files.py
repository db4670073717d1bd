"""Files of a modal test: frequencies, damping, shapes and responses, as people write them."""

from __future__ import annotations

import fit_cases
import numpy as np
import pytest
from fit_cases import edit, refused
from test_fit_vibrations import FREE, FRF, LINES, MODES

import foldyn as fd
from foldyn.errors import InputError
from foldyn.experiment import DampingRatios, FrequencyResponse, ModeShapes, NaturalFrequencies
from foldyn.experiment.calibration.fit_file import read_fit
from foldyn.experiment.calibration.fit_page import write_fit
from foldyn.experiment.calibration.measured_files import recognize

MODES_CSV = """mode,frequency [Hz],frequency_sigma [Hz],damping_ratio [%]
1,0.724,0.002,4.4
2,0.961,0.002,3.3
3,2.214,0.004,1.5
"""
FRF_CSV = """frequency [Hz];node 8 z real [mm/N];node 8 z imag [mm/N];node 8 z sigma [mm/N]
0.5;1200;-300;10
1.0;;;
1.5;-800;-200;20
"""
FIT = """
case = "modes.toml"
[[parameters]]
key = "sheet.youngs_modulus"
guess = 1.02e6
[[parameters]]
key = "damping.alpha"
guess = 0.45
[[data]]
kind = "frequencies"
file = "modes.csv"
shapes = "shapes.csv"
[[data]]
kind = "damping_ratios"
file = "modes.csv"
modes = [1, 3]
sigma = [1e-3, 2e-3]
[[data]]
kind = "mode_shapes"
file = "shapes.csv"
sigma = 0.02
axes = "xz"
[[data]]
kind = "frf"
case = "frf.toml"
file = "frf.csv"
nodes = [8]
axis = "z"
[[data]]
kind = "frf"
case = "frf.toml"
file = "frf.nc"
name = "held"
nodes = [6]
axis = "x"
quantity = "mobility"
band = [1, 2]
sigma = 0.3
held_out = true
"""


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Results of the model itself, from which measurements are made."""
    folder = tmp_path_factory.mktemp("results")
    modes = fd.read_case(fit_cases.write(folder, MODES)).run()
    response = fd.read_case(fit_cases.write(folder, FRF)).run(frequencies=LINES)
    return modes, response


@pytest.fixture
def folder(tmp_path, results):
    modes, response = results
    lines = ["mode,node,x [mm],y [mm],z [mm]"]
    for k in range(3):
        shape = -5.0 * modes["shape"].values[k]
        lines += [f"{k + 1},{n},{','.join(map(repr, shape[n].tolist()))}" for n in FREE]
    lines[2] = lines[2].rsplit(",", 1)[0] + ","  # z of node 4 was not measured
    for name, text in {
        "modes.toml": MODES, "frf.toml": FRF, "modes.csv": MODES_CSV, "frf.csv": FRF_CSV,
        "shapes.csv": "\n".join(lines), "fit.toml": FIT,
    }.items():  # fmt: skip
        (tmp_path / name).write_text(text, encoding="utf-8")
    fd.save(modes, tmp_path / "modes.nc")
    fd.save(response, tmp_path / "frf.nc")
    return tmp_path


@pytest.mark.matrix
def test_a_fit_file_says_what_was_measured(folder, results) -> None:
    hertz, damping, shapes, response, held = read_fit(folder / "fit.toml").data
    assert isinstance(hertz, NaturalFrequencies)
    assert hertz.frequency.tolist() == [0.724, 0.961, 2.214]
    assert hertz.sigma.tolist() == [0.002, 0.002, 0.004]
    assert hertz.shapes.nodes == tuple(FREE)
    assert np.isnan(hertz.shapes.values).sum() == 1
    assert isinstance(damping, DampingRatios)
    assert damping.mode.tolist() == [1, 3]
    np.testing.assert_allclose(damping.damping_ratio, [0.044, 0.015])
    assert isinstance(shapes, ModeShapes)
    assert (shapes.axes, shapes.values.shape) == ("xz", (3, 6, 2))
    assert np.nanmax(np.abs(shapes.values)) == 1.0
    assert isinstance(response, FrequencyResponse)
    assert (response.quantity, response.magnitude) == ("receptance", False)
    np.testing.assert_allclose(response.values[[0, 2], 0], [1.2 - 0.3j, -0.8 - 0.2j])
    np.testing.assert_allclose(response.errors(), [0.01, 0.02, 0.01, 0.02])
    assert held.quantity == "mobility"
    exact = fd.linear.convert(results[1], "mobility").mobility.sel(frequency=slice(1, 2))
    np.testing.assert_allclose(held.values[:, 0], exact.sel(node=6, axis="x").values)


@pytest.mark.matrix
def test_from_the_fit_file_to_the_page(folder) -> None:
    edit(folder, 'file = "frf.csv"\nnodes = [8]', 'file = "frf.nc"\nnodes = [8]\nsigma = 0.05')
    plan = read_fit(folder / "fit.toml")
    found = fd.fit(plan.case, plan.data, parameters=plan.parameters)
    assert found["sheet.youngs_modulus"].value == pytest.approx(1e6, rel=0.05)
    page = write_fit(found, folder, figures="png").read_text("utf-8")
    for text in ("modes: paired by their shapes (MAC)", "modes: paired in their order",
                 "model&#x27;s mode", "frf: measured and model.", "held: measured and model. Held",
                 "Misfit: ", "in sigma"):  # fmt: skip
        assert text in page
    drawn = {path.name for path in folder.glob("*.png")}
    assert {"data-2.png", "data-3.png", "data-4.png"} <= drawn
    page = write_fit(found, folder).read_text("utf-8")
    for title in ("mode 1", "phase (degrees)", "z (dB re 1 m/N)", "component, model"):
        assert title in page


@pytest.mark.matrix
def test_results_are_measurements_too(folder, results) -> None:
    one = recognize(folder / "modes.nc")
    assert isinstance(one, NaturalFrequencies)
    np.testing.assert_array_equal(one.frequency, results[0]["frequency"].values)
    with pytest.raises(InputError, match="say in a fit file which were measured"):
        recognize(folder / "frf.nc", axis="z")
    edit(folder, 'file = "shapes.csv"\nsigma', 'file = "modes.nc"\nnodes = [7, 8]\nsigma')
    assert read_fit(folder / "fit.toml").data[2].values.shape == (4, 2, 2)
    edit(folder, 'file = "frf.nc"', 'file = "modes.nc"')
    with pytest.raises(InputError, match='a result of kind "modes"; one of kind "frf" is needed'):
        read_fit(folder / "fit.toml")


def test_columns_tell_what_a_file_holds(folder) -> None:
    assert isinstance(recognize(folder / "modes.csv"), NaturalFrequencies)
    assert isinstance(recognize(folder / "shapes.csv"), ModeShapes)
    assert recognize(folder / "frf.csv", axis="z").nodes == (8,)
    with pytest.raises(InputError, match="the columns are frequency, node 8 z real"):
        recognize(folder / "frf.csv", axis="x")


@pytest.mark.matrix
def test_magnitudes_and_other_quantities(folder) -> None:
    (folder / "frf.csv").write_text("frequency [kHz],node 8 z magnitude [m/s²/N]\n0.1,3\n0.2,4\n")
    one = read_fit(folder / "fit.toml").data[3]
    assert (one.magnitude, one.quantity, one.unit) == (True, "accelerance", "m/(N s2)")
    assert one.frequency.tolist() == [100.0, 200.0]
    (folder / "frf.csv").write_text("frequency [Hz],node 8 z real,node 8 z imag\n1,3,0\n2,4,1\n")
    edit(folder, "nodes = [8]", "nodes = [8]\nmagnitude = true")
    one = read_fit(folder / "fit.toml").data[3]
    assert (one.magnitude, one.quantity) == (True, "transmissibility")
    np.testing.assert_allclose(one.values[:, 0], [3.0, np.hypot(4.0, 1.0)])


@pytest.mark.parametrize(
    ("name", "old", "new", "message"),
    [
        ("modes.csv", "[Hz],frequency_sigma", "[mm],frequency_sigma", "is a length, and a freq"),
        ("modes.csv", "2,0.961", "2,0.5", "0.5 Hz comes after 0.724 Hz; sort the modes"),
        ("modes.csv", "2,0.961", "1,0.961", "has mode 1 twice"),
        ("modes.csv", "2,0.961", "1.5,0.961", "modes.csv: mode = 1.5: must be a whole number"),
        ("modes.csv", "2,0.961", "2,", 'column "frequency [Hz]": is empty'),
        ("modes.csv", "0.002,3.3", "0,3.3", "sigma: must be greater than 0"),
        ("shapes.csv", "\n3,3,", "\n2,3,", "has two lines for node 3 at the mode 2"),
        ("shapes.csv", "mode,", "modes,", '"mode": no such column; did you mean'),
        ("frf.csv", "real [mm/N]", "real [kg]", "[kg] is not a unit of a response; use one"),
        ("frf.csv", "imag [mm/N]", "imag [m/(N s)]", "is a mobility, and a rec"),
        ("frf.csv", "z imag", "z phase", 'no such column; did you mean'),
        ("frf.csv", "0.5;1200", "2.5;1200", "must increase from 0 Hz or more; sort it"),
        ("fit.toml", "modes = [1, 3]", "modes = [1, 4]", "there is no mode 4; it has 1, 2, 3"),
        ("fit.toml", "sigma = [1e-3, 2e-3]", "sigma = [1e-3]", "must be a list of 2 numbers"),
        ("fit.toml", 'shapes = "shapes.csv"', "shapes = 3", "data[0].shapes = 3: must be the name"),
        ("fit.toml", 'shapes = "shapes.csv"', 'shapes = "no.csv"', "no.csv: there is no such"),
        ("fit.toml", 'shapes = "shapes.csv"', 'nodes = [1]', "data[0].nodes: unknown key"),
        ("fit.toml", 'shapes = "shapes.csv"', 'sigma = 1.0', "the file has a column of it"),
        ("fit.toml", 'axes = "xz"', 'axes = "xw"', 'axes = "xw": must be letters of "xyz"'),
        ("fit.toml", 'axes = "xz"', 'nodes = [1]', "has no line for node 1"),
        ("fit.toml", "nodes = [8]\n", "", "data[3].nodes: missing"),
        ("fit.toml", "nodes = [8]", "nodes = [7]", 'needed are "frequency", and for each node "no'),
        ("fit.toml", "nodes = [8]", "nodes = [8]\nsigma = 1.0", "the file has a column of it"),
        ("fit.toml", "nodes = [8]", 'nodes = [8]\nquantity = "mobility"', "columns have a rec"),
        ("fit.toml", "nodes = [6]", "nodes = [99]", "node 99 is out of range; it has nodes 0 to"),
        ("fit.toml", "band = [1, 2]", "band = [8, 9]", "band = [8, 9]: holds none of the freq"),
        ("fit.toml", 'quantity = "mobility"', 'quantity = "speed"', 'quantity = "speed"'),
    ],
)  # fmt: skip
def test_files_with_mistakes(folder, name, old, new, message) -> None:
    edit(folder, old, new, name)
    with refused(message):
        read_fit(folder / "fit.toml")
