"""No panel passes through another in sheets that are crumpled at random."""

from __future__ import annotations

import warnings

import pytest
from crumplings import DURATION, SEEDS, crumpling

import foldyn as fd
from contact_sheets import crossing
from foldyn.errors import FoldynWarning

QUICK = (7, 27)  # of either kind, with a plane, and in touch most of the time


def crumpled(seed: int):
    """The case of a seed, and its motion."""
    case = crumpling(seed)
    options = {"method": "dormand_prince"}
    if seed >= len(SEEDS) // 2:
        options = {"method": "generalized_alpha", "tolerance": 1e-4}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)  # what impacts take from implicit methods
        warnings.simplefilter("error", fd.errors.CrossingWarning)
        return case, fd.simulate(case, DURATION, every=1e-3, **options)


def check(seed: int) -> bool:
    """That nothing crosses; tells whether anything has touched."""
    case, run = crumpled(seed)
    assert run.sizes["time"] == 61
    assert crossing(case.structure, run.displacement.values) == 0
    return float(run.contact.max()) > 0.0


@pytest.mark.parametrize("seed", QUICK)
def test_nothing_crosses(seed):
    pytest.importorskip("ipctk")
    assert check(seed)


@pytest.mark.matrix
def test_nothing_crosses_in_more_crumplings():
    pytest.importorskip("ipctk")
    touched = [check(seed) for seed in SEEDS[::9]]
    assert sum(touched) >= len(touched) // 2
