"""The README's example runs, and the files that it names exist."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import foldyn as fd

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


def test_python_example_moves_and_saves(python_trajectory):
    trajectory, folder = python_trajectory
    assert float(abs(trajectory.displacement).max()) > 1e-3
    (saved,) = folder.glob("*.nc")
    np.testing.assert_array_equal(fd.load(saved).displacement, trajectory.displacement)


def test_python_example_has_about_ten_lines():
    (block,) = blocks("python")
    assert len([line for line in block.splitlines() if line.strip()]) <= 12


def test_the_files_that_the_readme_names_exist():
    targets = re.findall(r"\]\(([^)#]+)\)", README.read_text("utf-8"))
    missing = [
        target
        for target in targets
        if "://" not in target and not (README.parent / target).exists()
    ]
    assert not missing
