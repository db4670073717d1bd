"""The table of what goes with what is what the package does."""

from __future__ import annotations

import pytest

import features


@pytest.mark.matrix
def test_the_page_has_the_table():
    text = features.PAGE.read_text("utf-8")
    assert features.table() in text, "python tests/features.py writes it anew"
