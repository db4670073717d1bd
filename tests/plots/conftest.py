"""A Miura cell with supports and a load, and a motion of it with a known answer."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from foldyn import cases, patterns, structures

FREQUENCY, AMPLITUDE = 2.0, 0.02


@pytest.fixture(scope="session")
def pattern():
    return patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=60)


@pytest.fixture(scope="session")
def structure(pattern):
    sheet = structures.Sheet(1e6, 0.25, 0.01, density=1.0)
    return structures.discretize(pattern, sheet)


@pytest.fixture(scope="session")
def case(structure):
    """Case 2 of the paper's studies."""
    return cases.Case(
        structure,
        supports=[
            cases.Fix([0, 1, 2], "x"),
            cases.Fix([0, 2, 6, 8], "z"),
            cases.Fix([1], "y"),
        ],
        loads=[cases.Force([7], (0.01, 0.0, 0.0), cases.HalfSine(0.5))],
    )


def motion(amplitude=AMPLITUDE, frequency=FREQUENCY, dt=0.01, samples=1000, nodes=13):
    """Nodes 6, 7, 8 swing along x with 1, 0.7 and 0.4 of the amplitude, node 4 along z."""
    t = np.arange(samples) * dt
    wave = amplitude * np.sin(2 * np.pi * frequency * t)
    u = np.zeros((samples, nodes, 3))
    u[:, 6:9, 0] = wave[:, None] * [1.0, 0.7, 0.4]
    u[:, 4, 2] = 0.5 * wave
    u[:, 4, 1] = 0.1 * wave
    kinetic = np.cos(2 * np.pi * frequency * t) ** 2
    variables = {
        "displacement": (("time", "node", "axis"), u),
        "kinetic": ("time", kinetic),
        "strain_bars": ("time", 0.1 * (1 - kinetic)),
        "strain_folds": ("time", 0.6 * (1 - kinetic)),
        "strain_bends": ("time", 0.3 * (1 - kinetic)),
        "dissipated": ("time", 0.05 * t + 1e-6 * t),
        "work": ("time", 0.05 * t),
    }
    return xr.Dataset(variables, coords={"time": t, "axis": ["x", "y", "z"]})


@pytest.fixture
def trajectory():
    return motion()


@pytest.fixture
def two_rules():
    return {"panel": motion(), "consistent": motion(amplitude=0.03, frequency=1.5)}
