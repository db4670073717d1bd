"""FOLD files with some fields changed."""

from __future__ import annotations

import json

import pytest
from fold_texts import GOOD


@pytest.fixture
def file(tmp_path):
    """Write a FOLD file: GOOD with some fields changed, or any text."""

    def make(content=None, drop=(), **changes):
        path = tmp_path / "test.fold"
        if content is None:
            fields = {k: v for k, v in {**GOOD, **changes}.items() if k not in drop}
            content = json.dumps(fields)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return make
