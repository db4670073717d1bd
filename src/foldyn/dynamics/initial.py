"""Initial states from results."""

from __future__ import annotations

from typing import Any

import numpy as np

from foldyn.cases import State
from foldyn.errors import InputError
from foldyn.results.contents import check_variable


def initial_state(result: Any, at: int = -1) -> State:
    """State at sample `at` of a result (dims time or step, node, axis), to start a motion from.

    Parameters
    ----------
    result : xarray.Dataset
        A trajectory or a path.
    at : int, default -1
        Number of the sample; negative ones count from the end.
    """
    if not hasattr(result, "sizes") or "displacement" not in result:
        raise InputError(f"initial_state: got {type(result).__name__}, give a result (a dataset)")
    for dimension in ("time", "step"):
        if dimension in result.sizes:
            count = result.sizes[dimension]
            break
    else:
        raise InputError("initial_state: the result has neither a time nor a step dimension")
    if isinstance(at, bool) or not isinstance(at, (int, np.integer)) or not -count <= at < count:
        raise InputError(f" = {at!r}: the result has samples 0 to {count - 1}", "at")
    sample = result.isel({dimension: at})
    found = {
        name: check_variable(sample, name, ("node", "axis"), place="initial_state: ").to_numpy()
        for name in ("displacement", "velocity")
        if name == "displacement" or name in sample
    }
    return State(**found)
