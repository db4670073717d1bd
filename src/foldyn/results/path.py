"""Dataset of an equilibrium path."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from foldyn.cases import Case
from foldyn.results.dataset import result_dataset
from foldyn.results.quantities import PATH, energies_of, variables

_KINDS = ("regular", "limit", "bifurcation")


def path_dataset(
    case: Case,
    load_factor: ArrayLike,
    displacement: ArrayLike,
    reaction: ArrayLike,
    energies: Mapping[str, ArrayLike],
    solution: Mapping[str, ArrayLike],
    statistics: Mapping[str, Any],
    obstacles: tuple[str, ...] = (),
) -> xr.Dataset:
    """Dataset of a sequence of equilibria, which carries its own case.

    Parameters
    ----------
    case : Case
        What was loaded.
    load_factor : array_like, shape (ns,)
        Load factor of each point.
    displacement : array_like, shape (ns, n, 3)
        Displacement (m) of every node.
    reaction : array_like, shape (ns, nd)
        Forces of the supports (N) on the dofs `case.supported_dofs`, in that order.
    energies : mapping of str to array_like, shape (ns,)
        work and the strain energies of the structure's `energy_groups` (J).
    solution : mapping of str to array_like, shape (ns,)
        How each point was found: negative_eigenvalues (-1 if not counted), point ("regular",
        "limit" or "bifurcation"), iterations, residual.
    statistics : mapping
        Facts about the run, each stored as an attribute.
    obstacles : tuple of str
        Why the path cannot be run again from itself, beside what the case says.

    Returns
    -------
    xarray.Dataset
        As `trajectory_dataset`, with the dimension step and the coordinate `load_factor`.
    """
    factor = np.array(load_factor, dtype=np.float64)
    kinds = np.array(solution["point"], dtype=f"<U{max(map(len, _KINDS))}")
    values = {"displacement": displacement, "reaction": reaction, **energies, **solution}
    data = variables({**PATH, **energies_of(case)}, "step", values | {"point": kinds})
    along = {"load_factor": ("step", factor, {"long_name": "load factor"})}
    return result_dataset("path", case, data, along, statistics, None, obstacles)
