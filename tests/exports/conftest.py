"""Results of a small sheet to export; motion and path are made up, so that nothing is compiled."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.results import path_dataset, trajectory_dataset

SHEET = fd.Sheet(1e6, 0.25, 0.01, 1.0)
COUNT = 7


def made_up(case: fd.Case) -> np.ndarray:
    """Displacements (COUNT, n, 3), m, zero at first."""
    there = np.random.default_rng(1).normal(size=case.structure.nodes.shape)
    return 0.05 * np.sin(np.arange(COUNT) / 3.0)[:, None, None] * there


def energies(case: fd.Case) -> dict[str, np.ndarray]:
    return {name: np.arange(float(COUNT)) for name in (*case.energy_groups, "work")}


def motion_of(case: fd.Case) -> object:
    u = made_up(case)
    reaction = np.zeros((COUNT, len(case.reaction_dofs)))
    more = {"kinetic": np.ones(COUNT), "dissipated": np.zeros(COUNT)}
    time = 0.5 + 0.25 * np.arange(COUNT)
    return trajectory_dataset(case, time, u, 2.0 * u, reaction, energies(case) | more, {})


@pytest.fixture(scope="session")
def case() -> fd.Case:
    """Two by one Miura cells."""
    structure = fd.discretize(fd.patterns.miura(cells=(2, 1)), SHEET, preset="plate")
    return fd.Case(structure, [fd.Fix([0, 1, 2])], [fd.Force([7], (0.01, 0, 0))])


@pytest.fixture(scope="session")
def motion(case):
    return motion_of(case)


@pytest.fixture(scope="session")
def path(case):
    reaction = np.zeros((COUNT, len(case.reaction_dofs)))
    factor = np.array([0.0, 0.5, 1.0, 0.8, 0.6, 0.9, 1.2])  # through a snap
    solution = {
        "negative_eigenvalues": np.array([0, 0, 0, 1, 1, 0, 0]),
        "point": ["regular"] * COUNT,
        "iterations": np.ones(COUNT, int),
        "residual": np.zeros(COUNT),
    }
    return path_dataset(case, factor, made_up(case), reaction, energies(case), solution, {})


@pytest.fixture(scope="session")
def modes(case):
    return fd.modes(fd.Case(case.structure, case.supports), count=3)


@pytest.fixture(scope="session")
def shell_motion():
    structure = fd.shell(fd.patterns.simple_fold(), SHEET, divisions=2)
    return motion_of(fd.Case(structure, [fd.Fix([0, 1])]))


@pytest.fixture(scope="session")
def folding():
    """A fold of two panels on its way."""
    return fd.fold(fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=170), 0.5, steps=4).path
