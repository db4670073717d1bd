"""What the calibration page shows works."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from foldyn.cli.fit import plan_of
from foldyn.cli.main import main, parser
from foldyn.experiment.calibration.fit_problem import problem

PAGE = Path(__file__).resolve().parents[2] / "docs/calibration.md"


def blocks(language: str) -> list[str]:
    fenced = re.findall(r"^```(\w*)\n(.*?)^```$", PAGE.read_text("utf-8"), re.M | re.S)
    return [text for name, text in fenced if name == language]


def digest(*arguments: str) -> str:
    """What `foldyn fit` with these arguments is about to compute."""
    plan = plan_of(parser().parse_args(["fit", *arguments]))
    return problem(plan.case, plan.data, plan.parameters, plan.ties).digest()


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
    exec(compile(blocks("python")[0], "calibration.md", "exec"), names)
    assert names["ratio"].value == pytest.approx(told[0]["value"], rel=1e-6)
    assert Path("fitted.toml").exists()
