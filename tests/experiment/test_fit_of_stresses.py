"""Fits to measured moments of creases, stresses and energies."""

from __future__ import annotations

import numpy as np
import pytest
from fit_cases import write

import foldyn as fd
from case_texts import FOLD_TEXT
from foldyn.cli.main import main
from foldyn.errors import FoldynError, InputError
from foldyn.experiment import Measured, Parameter
from foldyn.experiment.calibration.measured_files import measured

PRESSED = (
    FOLD_TEXT
    + """
[model]
preset = "plate"
fold_law = "linear"
crease_stiffness = 2e-3
[[supports]]
nodes = [4, 5]
[[supports]]
nodes = [0, 1]
axes = "z"
[[supports]]
nodes = [0, 1]
axis = "x"
displacement = -0.02
[analysis]
kind = "statics"
"""
)
FACTORS = [0.25, 0.5, 1.0]


def closing(case) -> np.ndarray:
    """Turns (rad) of the crease at `FACTORS` if the panels are rigid."""
    x = case.structure.pattern.vertices
    width = np.abs(x[4] - x[0])[0]
    side = np.linalg.norm(x[2] - x[0])
    half = np.arcsin(0.5 * (width - 0.02 * np.array([0.0, *FACTORS])) / side)
    return 2.0 * (half[0] - half[1:])


@pytest.mark.matrix
def test_the_stiffness_of_a_crease_from_its_moments(tmp_path):
    """Moments of a crease of 5e-4 N m/rad per m between rigid panels: M = k turn."""
    path = write(tmp_path, PRESSED)
    moment = 5e-4 * closing(fd.read_case(path).case())
    data = Measured(measure="crease_moment[0]", load_factor=FACTORS, values=moment, sigma=1e-7)
    assert data.unit == "N"
    fit = fd.fit(path, [data], parameters=[Parameter("model.crease_stiffness")])
    assert fit["model.crease_stiffness"].value == pytest.approx(5e-4, rel=2e-3)
    assert fit.scores[0].relative < 5e-3


@pytest.mark.matrix
def test_two_parameters_from_stresses_and_forces(tmp_path):
    """What the case itself says is found again, beside forces that are measured."""
    path = write(tmp_path, PRESSED.replace("thickness = 0.01", "thickness = 0.012"))
    truth = fd.read_case(path).case()
    traced = fd.trace(truth, "newton", load_factors=FACTORS)
    found = fd.stresses(traced)
    pressed = write(tmp_path, PRESSED, "guess.toml")
    stress = Measured(
        measure="von_mises[1]", load_factor=FACTORS, sigma=1e-3,
        values=found.von_mises.isel(point=found.point_panel == 1).max(("point", "face")),
    )  # fmt: skip
    energy = Measured(
        measure="strain_energy", load_factor=FACTORS[::-1], sigma=1e-10,
        values=sum(traced[name].values for name in truth.energy_groups)[::-1],
    )  # fmt: skip
    keys = "sheet.thickness", "model.crease_stiffness"
    both = [Parameter(keys[0], 0.01, 0.005, 0.02), Parameter(keys[1], 3e-3, 1e-4, 0.1)]
    fit = fd.fit(pressed, [stress, energy], parameters=both)
    assert [fit[key].value for key in keys] == pytest.approx([0.012, 2e-3], rel=1e-4)
    assert {*fit.quotients} == {"measure"}


def test_a_fit_file_names_measures(tmp_path):
    path = write(tmp_path, PRESSED)
    moment = 5e-4 * closing(fd.read_case(path).case())
    rows = "".join(f"{at},{value}\n" for at, value in zip(FACTORS, moment, strict=True))
    (tmp_path / "moments.csv").write_text("load_factor,value\n" + rows)
    (tmp_path / "fit.toml").write_text(
        f"""case = "{path.name}"
        [[parameters]]
        key = "model.crease_stiffness"
        [[data]]
        kind = "measure"
        measure = "crease_moment"
        file = "moments.csv"
        """
    )
    assert main(["fit", str(tmp_path / "fit.toml"), "--out", str(tmp_path / "out")]) == 0
    with pytest.raises(InputError, match="load_factor: leave it out"):
        measured(tmp_path / "moments.csv", measure="crease_moment", load_factor=[1.0])
    page = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert "crease_moment (N)" in page


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"measure": "crease_moments"}, "measure: measure = .*did you mean 'crease_moment'"),
        ({"measure": "limit_load"}, "a fit compares states, by von_mises, crease_moment"),
        ({"measure": "crease_moment[1]"}, "there is no crease 1; creases are 0 to 0"),
        ({"measure": "von_mises[2]"}, "there is no panel 2; panels are 0 to 1"),
        ({"measure": "margin"}, "the sheet has none; give Sheet"),
        ({"measure": "margin", "values": [1.0]}, "values: shape .1,.: must be a list of 3 numbers"),
    ],
)
def test_measures_that_do_not_fit_are_named(tmp_path, given, message):
    data = {"load_factor": FACTORS, "values": [1.0, 2.0, 3.0], **given}
    path = write(tmp_path, PRESSED)
    with pytest.raises(FoldynError, match=message):
        fd.fit(path, [Measured(**data)], parameters=[Parameter("model.crease_stiffness")])
