# Public names and where they live; loaded when they are first used (facade.py)

from foldyn.results.contents import (
    case_of as case_of,
    check_result as check_result,
    latched as latched,
)
from foldyn.results.dataset import (
    fidelity_dataset as fidelity_dataset,
    folding_dataset as folding_dataset,
    frf_dataset as frf_dataset,
    modes_dataset as modes_dataset,
    path_dataset as path_dataset,
    random_dataset as random_dataset,
    trajectory_dataset as trajectory_dataset,
)
from foldyn.results.frames import (
    Shapes as Shapes,
    States as States,
    frames_of as frames_of,
    shapes_of as shapes_of,
    state_of as state_of,
)
from foldyn.results.free_flight import attitude as attitude
from foldyn.results.netcdf import load as load, save as save
from foldyn.results.quantities import Quantity as Quantity
from foldyn.results.sweep_dataset import (
    MainEffect as MainEffect,
    SobolIndices as SobolIndices,
    main_effects as main_effects,
    sobol_indices as sobol_indices,
)
