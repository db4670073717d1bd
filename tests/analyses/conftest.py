"""Texts of case files that the tests share, and a reader of such texts."""

from __future__ import annotations

import textwrap
from pathlib import Path

import pytest

from case_texts import HELD_MIURA_TEXT
from foldyn.analyses import read_case

# the example of the design, section 4, with loads that its supports leave free
EXAMPLE = """
title = "an example"
[pattern]
kind = "miura"
cells = [1, 1]
a = 1.0
b = 1.0
panel_angle = 60
dihedral = 60
[sheet]
youngs_modulus = 1e6
poissons_ratio = 0.25
thickness = 0.01
density = 1000.0
length_scale_ratio = 1.0
[model]
scheme = "n5b8"
mass = "circumcenter"
fold_law = { kind = "enhanced", theta1 = 45, theta2 = 315, rest = "stress_free" }
bend_law = "superlinear"
calibration = "standard"
[damping]
alpha = 0.02
beta = 0.0
[[supports]]
nodes = [0, 1, 2]
axes = "xyz"
[[loads]]
nodes = [6, 7, 8]
force = [0.01, 0, 0]
history = { kind = "pulse", duration = 1.0 }
[analysis]
kind = "dynamics"
method = "rk4"
duration = 20.0
# dt = 1e-3
[output]
nodes = [6, 7]
interval = 0.01
"""

SHORT = (
    HELD_MIURA_TEXT
    + """\
[[loads]]
nodes = [7, 6]
force = [1, 0, 0]
[analysis]
kind = "dynamics"
duration = 10
"""
)


@pytest.fixture
def read(tmp_path: Path):
    """Write a text as case2.toml and read it."""

    def read_text(text: str):
        path = tmp_path / "case2.toml"
        path.write_text(textwrap.dedent(text))
        return read_case(path)

    return read_text


@pytest.fixture
def example() -> str:
    """A case file that sets nearly everything."""
    return EXAMPLE


@pytest.fixture
def short() -> str:
    """A case file that leaves to the defaults what it can."""
    return SHORT
