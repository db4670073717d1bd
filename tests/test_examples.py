"""Every example runs and keeps its own physical assertions."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).resolve().parents[1] / "examples").glob("*.py"))


def load(path: Path):
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # where dataclasses look for it
    spec.loader.exec_module(module)
    return module


@pytest.mark.matrix
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.stem)
def test_example(path):
    example = load(path)
    _, results = example.compute()
    example.check(results)


def test_the_check_of_case_study_2_can_fail():
    example = load(next(p for p in EXAMPLES if p.stem == "case_study_2"))
    _, results = example.compute()
    first = next(iter(results.values()))
    first.attrs["energy_error"] = 1e-3
    with pytest.raises(AssertionError):
        example.check(results)
