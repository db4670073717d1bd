"""Dataset of modes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from foldyn.cases import Case
from foldyn.results.dataset import result_dataset
from foldyn.results.quantities import MODES, PLACE, variable, variables


def modes_dataset(
    case: Case, values: Mapping[str, ArrayLike], statistics: Mapping[str, Any]
) -> xr.Dataset:
    """Dataset of modes about a state, which carries its own case.

    Parameters
    ----------
    case : Case
        What vibrates.
    values : mapping of str to array_like
        The variables of `quantities.MODES`, and the `displacement` (n, 3) of the state, m.
    statistics : mapping
        Facts about the computation, each stored as an attribute.

    Returns
    -------
    xarray.Dataset
        The variables, with the coordinate `mode` = 1, 2, ..., and the case as in
        `trajectory_dataset`.
    """
    data = variables(MODES, "mode", {name: values[name] for name in MODES})
    text = "displacement of the state from the rest position"
    data["displacement"] = variable(PLACE, values["displacement"], "m", text)
    numbers = 1 + np.arange(len(np.asarray(values["frequency"])))
    along = {"mode": ("mode", numbers, {"long_name": "mode"})}
    return result_dataset("modes", case, data, along, statistics)
