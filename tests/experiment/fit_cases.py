"""Case files of a simple fold that take milliseconds."""

from __future__ import annotations

import re
from contextlib import AbstractContextManager
from pathlib import Path

import pytest

from case_texts import FOLD_TEXT
from foldyn.errors import InputError

SAME_STEPS = "ignore:.*time step is too coarse"
"""For data that the model itself has made, with the same steps: they hide what these leave out."""
FOLD = (
    FOLD_TEXT
    + """
[model]
preset = "herkal"
fold_law = {{ kind = "enhanced", theta1 = 45, theta2 = 290 }}
[damping]
alpha = 0.4
[[supports]]
nodes = [4, 5]
[[supports]]
nodes = [0, 1]
axes = "z"
{rest}
"""
)
PRESSED = FOLD.format(
    rest="""
[[supports]]
nodes = [0, 1]
axis = "x"
displacement = -0.3
[analysis]
kind = "statics"
"""
)
SWUNG = FOLD.format(
    rest="""
[[loads]]
nodes = [0, 1]
force = [-0.001, 0, 0]
history = { kind = "half_sine", duration = 0.5 }
[analysis]
kind = "dynamics"
method = "newmark"
duration = 2.0
[output]
interval = 0.02
"""
)


def write(folder: Path, text: str = PRESSED, name: str = "case.toml") -> Path:
    """Write a case file; returns its path."""
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def edit(folder: Path, old: str, new: str, name: str = "fit.toml") -> None:
    """Change one place of a file."""
    text = (folder / name).read_text()
    assert old in text
    (folder / name).write_text(text.replace(old, new, 1))


def refused(message: str) -> AbstractContextManager:
    """What raises an error whose message holds this text."""
    return pytest.raises(InputError, match=re.escape(message))
