"""Results: datasets that contain their own case, in memory and in files."""

from foldyn.results.contents import case_of, check_result
from foldyn.results.dataset import (
    fidelity_dataset,
    folding_dataset,
    frf_dataset,
    modes_dataset,
    path_dataset,
    random_dataset,
    trajectory_dataset,
)
from foldyn.results.frames import Shapes, States, frames_of, shapes_of, state_of
from foldyn.results.netcdf import load, save
from foldyn.results.quantities import Quantity
from foldyn.results.sweep_dataset import MainEffect, SobolIndices, main_effects, sobol_indices

__all__ = [
    "MainEffect",
    "Quantity",
    "Shapes",
    "SobolIndices",
    "States",
    "case_of",
    "check_result",
    "fidelity_dataset",
    "folding_dataset",
    "frames_of",
    "frf_dataset",
    "load",
    "main_effects",
    "modes_dataset",
    "path_dataset",
    "random_dataset",
    "save",
    "shapes_of",
    "sobol_indices",
    "state_of",
    "trajectory_dataset",
]
