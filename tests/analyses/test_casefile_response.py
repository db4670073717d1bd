"""Case files of response curves, and the command that makes them of others."""

import numpy as np
import pytest

import foldyn as fd
from foldyn.analyses import read_case
from foldyn.cli.main import main
from foldyn.errors import InputError
from foldyn.periodic import response_curve

SHEET = """
[pattern]
kind = "simple_fold"
a = 1.0
b = 1.0
dihedral = 60
[sheet]
youngs_modulus = 1e6
poissons_ratio = 0.25
thickness = 0.01
density = 1.0
[model]
scheme = "n4b5"
bend_law = "linear"
mass = {mass}
[damping]
alpha = 0.5
[[supports]]
nodes = [4, 5]
axes = "xyz"
[[supports]]
nodes = [0, 1]
axes = "yz"
[[loads]]
nodes = [0, 1]
force = [1e-5, 0, 0]
history = {{ kind = "harmonic", frequency = 0.5 }}
"""
CURVE = """
[analysis]
kind = "response"
frequencies = [0.3, 0.4]
harmonics = 3
longest_step = 0.5
"""
MOTION = """
[analysis]
kind = "dynamics"
duration = 1.0
"""


def written(folder, analysis, mass='"panel"'):
    path = folder / "fold.toml"
    path.write_text(SHEET.format(mass=mass) + analysis, "utf-8")
    return path


@pytest.mark.matrix
def test_a_case_file_computes_what_the_function_does(tmp_path):
    file = read_case(written(tmp_path, CURVE))
    found = file.run()
    own = fd.response_curve(file.case("panel"), (0.3, 0.4), harmonics=3, longest_step=0.5)
    assert found.frequency.values == pytest.approx(own.frequency.values)
    assert found.amplitude.values == pytest.approx(own.amplitude.values)


@pytest.mark.matrix
def test_the_command_takes_any_kind_and_writes_a_page(tmp_path):
    path, folder = written(tmp_path, MOTION, '["panel", "centroid"]'), tmp_path / "out"
    flags = ["--frequencies", "0.3", "0.33", "--harmonics", "3", "--branches", "0", "--quiet"]
    assert main(["response", str(path), "--out", str(folder), "--figures", "png", *flags]) == 0
    one, other = (fd.load(folder / f"result-{rule}.nc") for rule in ("panel", "centroid"))
    assert one.frequency.values[[0, -1]] == pytest.approx([0.3, 0.33])
    assert one.attrs["harmonics"] == 3
    assert np.ptp(one.amplitude.values) != pytest.approx(np.ptp(other.amplitude.values))
    page = (folder / "report.html").read_text("utf-8")
    assert "Bifurcations, and both ends of each branch" in page
    assert (folder / "response_curve.png").exists()
    written(tmp_path, MOTION)
    again = ["response", str(path), "--out", str(folder), *flags, "--replace"]
    assert main(again) == 0
    page = (folder / "report.html").read_text("utf-8")
    assert '"kind":"periodic"' in page.replace(" ", "")


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ("frequencies = [0.3]", "must be two numbers"),
        ("frequencies = [0.3, 0.3]", "two different numbers"),
        ("frequencies = [0.3, -1.0]", "must be greater than 0"),
        ("harmonics = 3", "give both ends of the frequencies"),
        ("frequencies = [0.3, 0.4]\namplitudes = [1.0, 2.0]", "give both ends"),
        ("frequencies = [0.3, 0.4]\nharmonics = 0", "harmonics"),
    ],
)
def test_what_a_file_gets_wrong_is_named(tmp_path, changed, message):
    analysis = f'\n[analysis]\nkind = "response"\n{changed}\n'
    with pytest.raises(InputError, match=message):
        read_case(written(tmp_path, analysis))


@pytest.mark.matrix
def test_an_interrupted_curve_is_kept(tmp_path, monkeypatch, capsys):
    whole = response_curve

    def interrupted(case, *, progress, **given):
        def stop(state):
            if state.steps > 1:
                raise KeyboardInterrupt

        return whole(case, progress=stop, **given)

    monkeypatch.setattr("foldyn.analyses.response.response_curve", interrupted)
    path, folder = written(tmp_path, CURVE), tmp_path / "out"
    assert main(["run", str(path), "--out", str(folder), "--no-figures"]) == 130
    told = capsys.readouterr().err
    assert "interrupted after 2 points" in told and "result.nc" in told
    kept = fd.load(folder / "result.nc")
    assert kept.attrs["complete"] == 0 and kept.sizes["point"] == 2
    assert kept.attrs["stopped_because"] == "interrupted after 2 points"


def test_a_drive_is_asked_for_as_files_have_it(tmp_path):
    path = written(tmp_path, CURVE)
    text = path.read_text("utf-8")
    line = 'history = { kind = "harmonic", frequency = 0.5 }\n'
    path.write_text(text.replace(line, ""), "utf-8")
    with pytest.raises(InputError, match='kind = "harmonic", frequency = '):
        read_case(path).run()


def test_other_histories_are_refused(tmp_path):
    path = written(tmp_path, CURVE)
    text = path.read_text("utf-8").replace('"harmonic", frequency = 0.5', '"ramp", duration = 1.0')
    path.write_text(text, "utf-8")
    with pytest.raises(InputError, match="harmonic and constant"):
        read_case(path).run()
