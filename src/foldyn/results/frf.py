"""Dataset of a frequency response."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from foldyn.cases import Case
from foldyn.results.dataset import result_dataset
from foldyn.results.quantities import ESTIMATES, PLACE, RESPONSES, variable, variables


def frf_dataset(
    case: Case,
    frequency: ArrayLike,
    quantity: str,
    response: ArrayLike,
    displacement: ArrayLike,
    drive: ArrayLike,
    statistics: Mapping[str, Any],
    more: Mapping[str, ArrayLike] | None = None,
) -> xr.Dataset:
    """Dataset of a frequency response, which carries its own case.

    Parameters
    ----------
    case : Case
        What responds; without the drive.
    frequency : array_like, shape (m,)
        Frequencies (Hz).
    quantity : {"receptance", "transmissibility"}
        What the response is.
    response : array_like, shape (m, n, 3), complex
        Response of every node, for the time dependence exp(+i w t).
    displacement : array_like, shape (n, 3)
        The state (m) about which it moves.
    drive : array_like, shape (n, 3)
        Amplitudes of the forces on the nodes (N), or of the displacements of the base (m).
    statistics : mapping
        Facts about the run, each stored as an attribute.
    more : mapping of str to array_like, optional
        Further variables, of `quantities.ESTIMATES`.

    Returns
    -------
    xarray.Dataset
        The response under its own name, complex (frequency, node, axis), `displacement`, `drive`
        (node, axis), and what every result has.
    """
    values = {quantity: np.asarray(response, np.complex128), **(more or {})}
    data = variables({**RESPONSES, **ESTIMATES}, "frequency", values)
    driven = "N" if quantity == "receptance" else "m"
    data["displacement"] = variable(PLACE, displacement, "m", "displacement of the state")
    data["drive"] = variable(PLACE, drive, driven, "amplitude of the drive")
    along = {"frequency": ("frequency", np.array(frequency, float), {"units": "Hz"})}
    return result_dataset("frf", case, data, along, statistics)
