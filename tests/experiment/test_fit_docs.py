"""What the calibration page shows works."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from foldyn.cli.fit import plan_of
from foldyn.cli.main import main, parser
from foldyn.experiment.calibration.fit_file import read_fit
from foldyn.experiment.calibration.fit_problem import problem

PAGE = Path(__file__).resolve().parents[2] / "docs/calibration.md"


def blocks(language: str) -> list[str]:
    fenced = re.findall(r"^```(\w*)\n(.*?)^```$", PAGE.read_text("utf-8"), re.M | re.S)
    return [text for name, text in fenced if name == language]


def digest(*arguments: str) -> str:
    """What `foldyn fit` with these arguments is about to compute."""
    plan = plan_of(parser().parse_args(["fit", *arguments]))
    return problem(plan.case, plan.data, plan.parameters, plan.ties).digest()


@pytest.mark.matrix
def test_the_fit_file_the_command_line_and_python_say_the_same(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    weights, _, command, *_ = blocks("")
    Path("weights.csv").write_text(weights, "utf-8")
    Path("weights.toml").write_text(blocks("toml")[0], "utf-8")
    assert main(["fit", "weights.toml", "--quiet", "--no-figures"]) == 0
    told = json.loads(Path("weights-fit/fit.json").read_text("utf-8"))["parameters"]
    assert told[0]["value"] == pytest.approx(2.7, rel=0.03)
    assert told[1]["value"] == pytest.approx(75.0, abs=2.0)

    words = re.findall(r'"[^"]*"|\S+', command.replace("\\\n", " "))
    assert digest(*(word.strip('"') for word in words[2:])) == digest("weights.toml")

    names: dict = {}
    (block,) = (b for b in blocks("python") if "weights" in b)
    exec(compile(block, "calibration.md", "exec"), names)
    assert names["ratio"].value == pytest.approx(told[0]["value"], rel=1e-6)
    assert Path("fitted.toml").exists()


def test_the_fit_file_of_a_modal_test_can_be_read(tmp_path) -> None:
    """Its files hold the columns that the comments beside them name."""
    text = blocks("toml")[1]
    Path(tmp_path / "fit.toml").write_text(text, "utf-8")
    columns = dict(re.findall(r'^file = "(\S+\.csv)" +# (.*\].*|mode,node,z)$', text, re.M))
    rows = {
        "modes.csv": ["1,3.1,0.01,2.2", "2,7.4,0.03,1.4"],
        "shapes.csv": ["1,8,1.0", "1,5,0.4", "2,8,1.0", "2,5,-0.7"],
        "frf.csv": ["2.5,0.1,-0.02", "3.5,0.2,-0.4"],
    }
    assert {*columns} == {*rows}
    for name, lines in rows.items():
        Path(tmp_path / name).write_text("\n".join([columns[name], *lines]), "utf-8")
    plan = read_fit(tmp_path / "fit.toml")
    kinds = [one.kind for one in plan.data]
    assert kinds == ["frequencies", "mode_shapes", "damping_ratios", "frf"]
    assert plan.data[0].sigma.tolist() == [0.01, 0.03]
    (python,) = (b for b in blocks("python") if "ModeShapes" in b)
    names: dict = {}
    exec(compile(python.rsplit("\n", 2)[0], "calibration.md", "exec"), names)
    assert names["tones"].shapes.values.shape == (2, 3, 1)
