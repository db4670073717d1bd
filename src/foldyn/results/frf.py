"""Dataset of a frequency response."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from foldyn.cases import Case
from foldyn.results.dataset import result_dataset, variable

RESPONSES: Mapping[str, tuple[str, str]] = {
    "receptance": ("m/N", "displacement per force"),
    "mobility": ("m/(N s)", "velocity per force"),
    "accelerance": ("m/(N s2)", "acceleration per force"),
    "transmissibility": ("1", "displacement per displacement of the base"),
}
"""What a frequency response may hold, with unit and text."""


def frf_dataset(
    case: Case,
    frequency: ArrayLike,
    quantity: str,
    response: ArrayLike,
    displacement: ArrayLike,
    drive: ArrayLike,
    statistics: Mapping[str, Any],
    more: Mapping[str, tuple[tuple[str, ...], ArrayLike, str, str]] | None = None,
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
    more : mapping of str to (dimensions, values, units, text), optional
        Further variables, such as the coherence.

    Returns
    -------
    xarray.Dataset
        The response under its own name, complex (frequency, node, axis), `displacement`, `drive`
        (node, axis), and what every result has.
    """
    units, text = RESPONSES[quantity]
    driven = "N" if quantity == "receptance" else "m"
    plane, place = ("frequency", "node", "axis"), ("node", "axis")
    data = {
        quantity: variable(plane, np.asarray(response, np.complex128), units, text),
        "displacement": variable(place, displacement, "m", "displacement of the state"),
        "drive": variable(place, drive, driven, "amplitude of the drive"),
    }
    for name, (dimensions, values, unit, words) in (more or {}).items():
        data[name] = variable(dimensions, values, unit, words)
    along = {"frequency": ("frequency", np.array(frequency, float), {"units": "Hz"})}
    return result_dataset("frf", case, data, along, statistics)
