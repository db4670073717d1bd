"""Results: datasets that carry their own case, in memory and in files."""

from foldyn.results.dataset import trajectory_dataset
from foldyn.results.frf import frf_dataset
from foldyn.results.modes import modes_dataset
from foldyn.results.origin import case_of, check_result
from foldyn.results.path import path_dataset
from foldyn.results.quantities import Quantity
from foldyn.results.store import load, save

__all__ = [
    "Quantity",
    "case_of",
    "check_result",
    "frf_dataset",
    "load",
    "modes_dataset",
    "path_dataset",
    "save",
    "trajectory_dataset",
]
