"""Fixtures of case files that are read and of results that are stored."""

from __future__ import annotations

import pytest

import foldyn as fd


@pytest.fixture
def read(tmp_path):
    """Read a case file of a text."""

    def read(text: str, model: str | None = None, divisions: int | None = None):
        path = tmp_path / "case.toml"
        path.write_text(text, "utf-8")
        return fd.read_case(path, model=model, divisions=divisions)

    return read


@pytest.fixture
def kept(tmp_path):
    """The case of a result that has been saved and loaded."""

    def kept(result) -> fd.Case:
        fd.save(result, tmp_path / "result.nc")
        return fd.case_of(fd.load(tmp_path / "result.nc"))

    return kept
