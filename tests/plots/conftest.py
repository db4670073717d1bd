"""A Miura cell with supports and a load, and a motion of it with a known answer."""

from __future__ import annotations

import numpy as np
import pytest

from foldyn import cases, patterns, structures
from foldyn.results import trajectory_dataset


@pytest.fixture(scope="session")
def pattern():
    return patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=60)


@pytest.fixture(scope="session")
def structure(pattern):
    sheet = structures.Sheet(1e6, 0.25, 0.01, density=1.0)
    return structures.discretize(pattern, sheet, preset="herkal")


@pytest.fixture(scope="session")
def case(structure):
    """Case 2 of the paper's studies."""
    supports = [cases.Fix([0, 1, 2], "x"), cases.Fix([0, 2, 6, 8], "z"), cases.Fix([1], "y")]
    pulse = cases.Force([7], (0.01, 0.0, 0.0), cases.HalfSine(0.5))
    return cases.Case(structure, supports, [pulse])


def motion(case, amplitude=0.02, frequency=2.0, dt=0.01, samples=1000):
    """Nodes 6, 7, 8 swing along x with 1, 0.7 and 0.4 of the amplitude, node 4 along z."""
    t = np.arange(samples) * dt
    wave = amplitude * np.sin(2 * np.pi * frequency * t)
    u = np.zeros((samples, len(case.structure.nodes), 3))
    u[:, 6:9, 0] = wave[:, None] * [1.0, 0.7, 0.4]
    u[:, 4, 2] = 0.5 * wave
    u[:, 4, 1] = 0.1 * wave
    kinetic = np.cos(2 * np.pi * frequency * t) ** 2
    energies = {
        "kinetic": kinetic,
        "strain_bars": 0.1 * (1 - kinetic),
        "strain_folds": 0.6 * (1 - kinetic),
        "strain_bends": 0.3 * (1 - kinetic),
        "dissipated": 0.05 * t + 1e-6 * t,  # a balance that drifts by 1e-6 J per second
        "work": 0.05 * t,
    }
    reaction = np.zeros((samples, len(case.supported_dofs)))
    statistics = {"dt": dt, "steps": samples - 1}
    return trajectory_dataset(case, t, u, np.zeros_like(u), reaction, energies, statistics)


@pytest.fixture
def trajectory(case):
    return motion(case)


@pytest.fixture
def two_rules(case):
    return {"panel": motion(case), "consistent": motion(case, amplitude=0.03, frequency=1.5)}
