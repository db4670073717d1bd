"""Case files of kind "random": the function, the page, measures, and wrong tables."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.cli.main import main
from foldyn.errors import InputError

CASE = """
[pattern]
kind = "simple_fold"
a = 0.1
b = 0.1
dihedral = 120
[sheet]
youngs_modulus = 3e9
poissons_ratio = 0.3
thickness = 1e-3
density = 1000.0
strength = 3e7
[model]
kind = "superelements"
level = 1
divisions = 8
clamped = "xmin"
[[supports]]
nodes = "xmin"
[damping]
alpha = 20.0
[analysis]
kind = "random"
frequencies = { first = 10, last = 60, count = 11 }
stresses = true
[analysis.base.z]
frequency = [5, 20, 600]
value = [0.001, 0.004, 0.004]
unit = "g2/Hz"
"""
pytestmark = pytest.mark.filterwarnings("ignore:modes above 600 Hz")


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(CASE, "utf-8")
    return path


def test_a_case_file_is_the_function(file):
    read = fd.read_case(file)
    density = fd.SpectralDensity([5, 20, 600], [0.001, 0.004, 0.004], "g2/Hz")
    expected = fd.random_response(
        read.case(), base={"z": density}, frequencies=np.linspace(10, 60, 11), stresses=True
    )
    found = read.run()
    for name in ("displacement_rms", "acceleration_psd", "von_mises_rms"):
        np.testing.assert_array_equal(found[name], expected[name])


FORCES = """
[[analysis.forces]]
nodes = [4]
force = [0, 0, 1]
frequency = [5, 600]
value = [0.1, 0.1]
unit = "N2/Hz"
[[analysis.forces]]
nodes = [5]
force = [0, 0, 2]
frequency = [5, 600]
value = [0.1, 0.2]
unit = "N2/Hz"
"""


def test_forces_of_a_case_file(file):
    text = CASE[: CASE.index("[analysis.base.z]")].replace("true", "false") + "coherence = 0.5\n"
    file.write_text(text + FORCES, "utf-8")
    read = fd.read_case(file)
    expected = fd.random_response(
        read.case(),
        forces=[
            (fd.Force([4], (0, 0, 1)), fd.SpectralDensity([5, 600], [0.1, 0.1], "N2/Hz")),
            (fd.Force([5], (0, 0, 2)), fd.SpectralDensity([5, 600], [0.1, 0.2], "N2/Hz")),
        ],
        coherence=0.5,
    )
    found = read.run().displacement_rms
    np.testing.assert_allclose(found, expected.displacement_rms, rtol=1e-9)
    for old, new, told in (
        ("force = [0, 0, 2]", "", r"analysis\.forces\[1\]"),
        ('unit = "N2/Hz"\n[[', "[[", r"analysis\.forces\[0\]\.unit: missing"),
        ("force = [0, 0, 2]", "force = [0, 0, 2]\nbase = 2", r"analysis\.forces\[1\].*base"),
    ):
        file.write_text(text + FORCES.replace(old, new), "utf-8")
        with pytest.raises(InputError, match=told):
            fd.read_case(file).run()


@pytest.mark.matrix
def test_the_page_and_the_measures(file, tmp_path, capsys):
    text = CASE + '[sweep]\nmeasures = ["rms[5,z]", "acceleration_rms[5,z]"]\n'
    file.write_text(text + '[sweep.vary]\n"damping.alpha" = [10.0, 40.0]\n', "utf-8")
    assert main(["run", str(file), "--out", str(tmp_path / "out"), "--figures", "png"]) == 0
    assert "m/s2 rms" in capsys.readouterr().out
    page = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert "swings per second" in page
    assert "least margin of a panel" in page
    assert (tmp_path / "out" / "stresses.png").exists()
    swept = ["--out", str(tmp_path / "swept"), "--quiet", "--processes", "1"]
    assert main(["sweep", str(file), *swept]) == 0
    swept = fd.load(tmp_path / "swept" / "sweep.nc")
    assert swept["rms_5_z"].values[0] > swept["rms_5_z"].values[1] > 0.0
    assert swept["acceleration_rms_5_z"].values[0] > swept["acceleration_rms_5_z"].values[1]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('unit = "g2/Hz"', "", r"analysis\.base\.z\.unit: missing"),
        ('unit = "g2/Hz"', 'unit = "g"', r"analysis\.base\.z\.unit = .*choose one of g2/Hz"),
        ("base.z", "base.w", r"analysis\.base = 'w'|analysis\.base = \"w\": choose one of x, y"),
        ("[5, 20, 600]", "[20, 5, 600]", r"analysis\.base\.z\.frequency\[1\] = 5.0: must increase"),
        ("0.001, ", "", "2 densities for 3 frequencies"),
        ("[analysis.base.z]", "[analysis.bases.z]", "analysis.bases"),
    ],
)
def test_wrong_tables(file, old, new, message):
    file.write_text(CASE.replace(old, new), "utf-8")
    with pytest.raises(InputError, match=message):
        fd.read_case(file)
