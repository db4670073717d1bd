"""`foldyn fit`: from a fit file or the command line to the page."""

from __future__ import annotations

import json

import pytest

import foldyn as fd
from case_texts import HELD_FOLD_TEXT, MODES_TEXT

CASE = f"""{HELD_FOLD_TEXT}[[supports]]
nodes = [0, 1]
axis = "x"
displacement = -0.3
[analysis]
kind = "statics"
"""
FIT = """
case = "case.toml"
[[parameters]]
key = "sheet.length_scale_ratio"
guess = 2
lower = 0.5
upper = 4
[[data]]
kind = "force_displacement"
file = "forces.csv"
sigma = 1e-6
"""


@pytest.fixture
def fold(workplace):
    """Case, forces that it gives with L*/L_F = 1, and a fit file."""
    workplace.write(CASE)
    workplace.write(FIT, "fit.toml")
    path = fd.trace(fd.read_case("case.toml").case(), load_factors=[0.25, 0.5, 0.75, 1.0])
    top = path.reaction.values[:, path.support_axis.values == "x"][:, :2].sum(axis=1)
    lines = [
        f"{-300 * f},{1e3 * force + 1e-3 * (-1) ** k}"
        for k, (f, force) in enumerate(zip(path.load_factor.values, top, strict=True))
    ]
    workplace.write("\n".join(["displacement [mm],force [mN]", *lines]), "forces.csv")
    return workplace


@pytest.mark.matrix
def test_a_fit_file_from_reading_to_report(fold) -> None:
    done = fold.call("fit", "fit.toml")
    assert done.status == 0, done.err
    own = [name for name in done.new if not name.startswith("fit-fit/evaluations/")]
    assert own == [
        "fit-fit", "fit-fit/evaluations", "fit-fit/fit.json",
        "fit-fit/fit.nc", "fit-fit/fitted.toml", "fit-fit/report.html",
    ]  # fmt: skip
    told = json.loads((fold.folder / "fit-fit/fit.json").read_text())["parameters"][0]
    assert told["lower"] < 1.0 < told["upper"]
    assert "sheet.length_scale_ratio = " in done.out
    assert "95 % from" in done.out
    assert fd.read_case("fit-fit/fitted.toml").sheet.length_scale_ratio == told["value"]
    page = (fold.folder / "fit-fit/report.html").read_text()
    assert "sheet.length_scale_ratio" in page
    assert "data-foldyn=" in page and "data-plot=" in page and "<img " not in page
    for told in ("<td>foldyn fit fit.toml</td>", "The case file case.toml", "<td>supports</td>"):
        assert told in page


@pytest.mark.matrix
def test_the_same_from_the_command_line(fold) -> None:
    done = fold.call(
        "fit", "case.toml", "forces.csv", "--vary", "sheet.length_scale_ratio=2:0.5:4",
        "--tie", "sheet.density=sheet.length_scale_ratio", "--sigma", "1e-6",
        "--out", "out", "--no-figures", "--quiet",
    )  # fmt: skip
    assert (done.status, done.out, done.err) == (0, "", "")
    told = json.loads((fold.folder / "out/fit.json").read_text())
    assert told["parameters"][0]["value"] == pytest.approx(1.0, rel=1e-3)
    assert told["ties"] == {"sheet.density": "sheet.length_scale_ratio"}
    assert "out/report.html" not in done.new


@pytest.mark.matrix
def test_frequencies_from_the_command_line(workplace) -> None:
    """The misfit stands beside the intervals."""
    workplace.write(MODES_TEXT)
    workplace.write("mode,frequency [Hz]\n1,0.724\n2,0.961\n3,2.214\n", "modes.csv")
    done = workplace.call(
        "fit", "case.toml", "modes.csv", "--vary", "sheet.youngs_modulus=1.1e6",
        "--sigma", "0.002", "--no-figures",
    )  # fmt: skip
    assert done.status == 0, done.err
    told = json.loads((workplace.folder / "case-fit/fit.json").read_text())
    assert told["parameters"][0]["value"] == pytest.approx(1e6, rel=0.02)
    assert f"  Misfit: {told['misfit']:.3g} sigma (reduced chi-square " in done.out
    assert f"variation, {told['measurements'][0]['sigmas']:.3g} sigma" in done.out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("none.toml", "none.toml: there is no such file"),
        ("case.toml", "is a case file: name the data to fit it to"),
        ("case.toml forces.csv", "--vary: missing; name what to fit"),
        ("case.toml forces.csv --vary sheet.thicknes", "did you mean 'thickness'?"),
        ("case.toml forces.csv --vary sheet.thickness=1:2", "write KEY, KEY=START or"),
        ("case.toml forces.csv --vary sheet.thickness=1:2:0", "lower = 2 is not below"),
        ("case.toml no.csv --vary sheet.thickness", "no.csv: there is no such file"),
        ("case.toml case.toml --vary sheet.thickness", "case.toml: "),
        (
            "case.toml forces.csv --vary sheet.thickness --sigma 1 --sigma 2",
            "--sigma: 2 of them for 1 data files",
        ),
        ("case.toml forces.csv --vary sheet.thickness --searches 2", "give sheet.th"),
        ("fit.toml forces.csv", "DATA: fit.toml is a fit file, which says that itself"),
        ("fit.toml --processes 0", "processes = 0: must be a whole number, at least 1"),
        ("fit.toml --out fit.toml", "--out fit.toml: is a file; name a folder"),
    ],
)
def test_bad_input_gets_one_message_and_writes_nothing(fold, arguments, message) -> None:
    assert message in fold.refused("fit", *arguments.split())
