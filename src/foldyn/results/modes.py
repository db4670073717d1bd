"""Dataset of modes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from foldyn.cases import Case
from foldyn.results.dataset import result_dataset, variable

MODE_VARIABLES: Mapping[str, tuple[tuple[str, ...], str, str]] = {
    "frequency": (("mode",), "Hz", "frequency"),
    "eigenvalue": (("mode",), "rad2/s2", "square of the angular frequency (negative: unstable)"),
    "shape": (("mode", "node", "axis"), "m", "mode shape, of the modal mass 1 kg m2"),
    "rigid": (("mode",), "1", "whether the mode is a rigid motion that nothing resists"),
    "rigid_share": (("mode",), "1", "share of the shape in the space of rigid motions"),
    "damping_ratio": (("mode",), "1", "modal damping ratio"),
    "participation": (("mode", "axis"), "kg m", "participation factor"),
    "effective_mass": (("mode", "axis"), "kg", "effective mass"),
    "displacement": (("node", "axis"), "m", "displacement of the state from the rest position"),
}


def modes_dataset(
    case: Case, values: Mapping[str, ArrayLike], statistics: Mapping[str, Any]
) -> xr.Dataset:
    """Dataset of modes about a state, which carries its own case.

    Parameters
    ----------
    case : Case
        What vibrates.
    values : mapping of str to array_like
        The variables of `MODE_VARIABLES`, of the dimensions given there.
    statistics : mapping
        Facts about the computation, each stored as an attribute.

    Returns
    -------
    xarray.Dataset
        The variables, with the coordinate `mode` = 1, 2, ..., and the case as in
        `trajectory_dataset`.
    """
    data: dict[str, Any] = {
        name: variable(dimensions, values[name], units, text)
        for name, (dimensions, units, text) in MODE_VARIABLES.items()
    }
    numbers = 1 + np.arange(len(np.asarray(values["frequency"])))
    along = {"mode": ("mode", numbers, {"long_name": "mode"})}
    return result_dataset("modes", case, data, along, statistics)
