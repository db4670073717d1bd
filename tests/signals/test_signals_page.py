"""The page of the signals shows what there is, and what it shows runs."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from known_poles import Mode, receptance

from foldyn import signals

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE, API = ((DOCS / name).read_text("utf-8") for name in ("signals.md", "api.md"))


def test_the_example_runs():
    names: dict = {}
    for block in re.findall(r"^```python\n(.*?)^```$", PAGE, re.M | re.S):
        exec(compile(block, "signals.md", "exec"), names)
    assert names["fit"].damping_ratio == pytest.approx(0.135, abs=4 * names["fit"].damping_error)
    assert names["rough"].damping_ratio == pytest.approx(0.135, rel=0.05)


def test_the_reference_lists_every_function():
    (members,) = re.findall(r"automodule:: foldyn\.signals\n +:members: (.*?)\n\n", API, re.S)
    assert set(signals.__all__) - set(re.findall(r"\w+", members)) == set()


def test_the_table_of_the_textbook_bias():
    f = np.linspace(0.0, 60.0, 1201)
    table = re.findall(r"^\| (0\.\d+) \| \+([\d.]+) % \| 0 \| \+([\d.]+) % \|$", PAGE, re.M)
    assert len(table) == 5
    for z, *shown in table:
        H = receptance(f, Mode(9.3, float(z)))
        kinds = (H, "receptance"), (f**2 * H, "accelerance")
        for percent, (size, quantity) in zip(shown, kinds, strict=True):
            result = signals.half_power(f, np.abs(size), quantity=quantity)
            bias = 100 * (result.textbook_damping_ratio / float(z) - 1)
            assert float(percent) == pytest.approx(bias, rel=0.03)
