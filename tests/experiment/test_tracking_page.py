"""The page on tracking shows every option, and its code runs."""

from __future__ import annotations

import argparse
import re
from pathlib import Path

import pytest

from foldyn.cli.main import parser

cv2 = pytest.importorskip("cv2")

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE = (DOCS / "tracking.md").read_text("utf-8")


def test_every_option_has_a_row():
    (commands,) = (a for a in parser()._actions if isinstance(a, argparse._SubParsersAction))
    options = {name for a in commands.choices["track"]._actions for name in a.option_strings}
    common = {"-h", "--help", "--out", "--no-figures", "--quiet", "--force"}
    rows = "".join(line.split(" | ")[0] for line in PAGE.splitlines() if line.startswith("| `--"))
    assert set(re.findall(r"--[a-z]+", rows)) == options - common


def test_pictures_are_there():
    for name in re.findall(r"\]\((images/[\w-]+\.png)\)", PAGE):
        assert (DOCS / name).stat().st_size > 10_000, name


def test_the_way_to_a_free_vibration(tracked, tmp_path, monkeypatch):
    from foldyn.experiment import save_tracks

    save_tracks(tracked, tmp_path / "tracks.nc")
    monkeypatch.chdir(tmp_path)
    _, block = re.findall(r"^```python\n(.*?)^```$", PAGE, re.M | re.S)
    # this film is short, and its node 6 is one of those that are seen best
    block = block.replace("start=0.14, stop=1.34", "start=0.0, stop=0.33")
    block = block.replace("node=8", "node=6")
    names: dict = {}
    exec(compile(block, "tracking.md", "exec"), names)
    assert names["found"].damped_frequency == pytest.approx(12.0, rel=0.02)
