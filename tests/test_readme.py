"""The README's examples run, and its Python example and its case file are one and the same."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import foldyn as fd
from foldyn.cli.main import main

README = Path(__file__).resolve().parents[1] / "README.md"


def blocks(language: str) -> list[str]:
    found = re.findall(rf"^```{language}\n(.*?)^```$", README.read_text("utf-8"), re.M | re.S)
    assert found, f"README.md has no {language} block"
    return found


@pytest.fixture(scope="module")
def python_trajectory(tmp_path_factory):
    folder = tmp_path_factory.mktemp("python")
    names: dict = {"__name__": "readme"}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for block in blocks("python"):
            exec(compile(block, str(README), "exec"), names)
    return names["trajectory"], folder


@pytest.fixture(scope="module")
def case_file_trajectory(tmp_path_factory):
    folder = tmp_path_factory.mktemp("toml")
    (block,) = blocks("toml")
    (folder / "miura.toml").write_text(block, "utf-8")
    assert main(["run", str(folder / "miura.toml"), "--out", str(folder / "out")]) == 0
    (result,) = (folder / "out").glob("**/*.nc")
    return fd.load(result)


def test_python_example_moves_and_saves(python_trajectory):
    trajectory, folder = python_trajectory
    assert float(abs(trajectory.displacement).max()) > 1e-3
    (saved,) = folder.glob("*.nc")
    np.testing.assert_array_equal(fd.load(saved).displacement, trajectory.displacement)


def test_python_example_has_about_ten_lines():
    (block,) = blocks("python")
    assert len([line for line in block.splitlines() if line.strip()]) <= 12


def test_case_file_is_the_python_example(python_trajectory, case_file_trajectory):
    trajectory, _ = python_trajectory
    np.testing.assert_array_equal(case_file_trajectory.time, trajectory.time)
    scale = float(abs(trajectory.displacement).max())
    np.testing.assert_allclose(
        case_file_trajectory.displacement, trajectory.displacement, rtol=0, atol=1e-12 * scale
    )


def test_the_files_that_the_readme_names_exist():
    targets = re.findall(r"\]\(([^)#]+)\)", README.read_text("utf-8"))
    missing = [
        target
        for target in targets
        if "://" not in target and not (README.parent / target).exists()
    ]
    assert not missing
