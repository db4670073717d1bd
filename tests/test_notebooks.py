"""Notebooks are there, are listed, check their results, and show figures; `make docs` runs them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
SCRIPTS = sorted((ROOT / "examples" / "notebooks").glob("*.py"))
JOBS = (
    "pattern_to_modes", "case_study", "snap_through", "bands", "effective_properties", "design",
    "film_to_model", "stresses_and_margins", "deployable", "sweeps",
)  # fmt: skip


def test_each_job_has_a_notebook_which_is_kept_as_a_script_alone():
    assert [path.stem for path in SCRIPTS] == [f"{n:02d}_{job}" for n, job in enumerate(JOBS, 1)]
    assert {path.suffix for path in SCRIPTS[0].parent.iterdir()} <= {".py", ".toml", ""}


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_a_notebook_is_short_listed_and_checks_its_result(path):
    jupytext = pytest.importorskip("jupytext")
    page = (ROOT / "docs" / "notebooks.md").read_text("utf-8")
    assert f"\nnotebooks/{path.stem}\n" in page  # in the list of pages
    assert f"](notebooks/{path.stem}.ipynb) |" in page
    assert f"](../examples/notebooks/{path.name})" in page
    assert f"<notebooks/{path.stem}.ipynb>" in page
    assert len(path.read_text("utf-8").splitlines()) < 115
    first, *rest = jupytext.read(path).cells
    assert first.cell_type == "markdown"
    assert re.match("# .+\n\n", first.source)
    code = [cell.source for cell in rest if cell.cell_type == "code"]
    assert code[0].startswith("%matplotlib inline\n")  # without it, figures are not shown
    assert any("assert" in cell for cell in code)


def test_the_documentation_runs_notebooks_and_fails_with_them():
    conf = (ROOT / "docs" / "conf.py").read_text("utf-8")
    for setting in ('mode = "force"', "raise_on_error = True"):
        assert f"nb_execution_{setting}\n" in conf
    assert 'nb_output_stderr = "warn"\n' in conf
    (docs,) = re.findall(r"^docs: .*\n\t(.*)$", (ROOT / "Makefile").read_text("utf-8"), re.M)
    assert "sphinx -W" in docs
