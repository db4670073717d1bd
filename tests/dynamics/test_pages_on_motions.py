"""What the pages on contact and on integrators show works."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

DOCS = Path(__file__).resolve().parents[2] / "docs"


def names_of(page: str) -> dict:
    names: dict = {}
    text = (DOCS / page).read_text("utf-8")
    for block in re.findall(r"^```python\n(.*?)^```$", text, re.M | re.S):
        exec(compile(block, page, "exec"), names)
    return names


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore::foldyn.errors.StretchWarning")
def test_the_tower_of_the_contact_page():
    names = names_of("contact.md")
    motion = names["motion"]
    assert motion.attrs["method"] == "dormand_prince"
    assert motion.attrs["energy_error"] < 1e-3
    height = motion.rest_position.values[6:, 2] + motion.displacement.values[:, 6:, 2]
    assert 0.0 < height.min() < 6e-3  # it touches itself
    assert len(names["contact"].planes) == 2


def test_the_motions_of_the_integrators_page():
    names = names_of("integrators.md")
    assert names["motion"].attrs["method"] == "generalized_alpha"
    assert names["many"].outcome.values.tolist() == ["done"] * 3
    assert np.isfinite(names["many"].displacement).all()
