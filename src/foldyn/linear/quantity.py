"""A frequency response as receptance, mobility or accelerance."""

from __future__ import annotations

from typing import TYPE_CHECKING

from foldyn.errors import InputError
from foldyn.results.quantities import RESPONSES, variable
from foldyn.signals import convert_response
from foldyn.values import choice

if TYPE_CHECKING:
    import xarray

PER_FORCE = tuple(name for name in RESPONSES if name != "transmissibility")


def quantity_of(response: xarray.Dataset) -> str:
    """Which quantity a frequency response holds.

    Raises
    ------
    InputError
        None: not a frequency response.
    """
    held = [name for name in RESPONSES if name in getattr(response, "data_vars", ())]
    if len(held) != 1:
        raise InputError(
            f"response: got {type(response).__name__} without {', '.join(RESPONSES)}; give a "
            "result of fd.frf"
        )
    return held[0]


def convert(response: xarray.Dataset, quantity: str) -> xarray.Dataset:
    """Turn a frequency response into receptance, mobility or accelerance.

    Parameters
    ----------
    response : xarray.Dataset
        A result of `frf` under forces.
    quantity : {"receptance", "mobility", "accelerance"}
        What it is to hold: displacement (m/N), velocity (m/(N s)) or acceleration (m/(N s2)) per
        force.

    Returns
    -------
    xarray.Dataset
        With that variable instead; nan at 0 Hz where a division by i w would be needed.

    Raises
    ------
    InputError
        Not a frequency response, a transmissibility, or an unknown quantity.
    """
    choice("quantity", quantity, PER_FORCE)
    held = quantity_of(response)
    if held not in PER_FORCE:
        raise InputError(
            "response: a transmissibility is a motion per motion: the same for displacements, "
            "velocities and accelerations"
        )
    values = convert_response(response["frequency"].values, response[held].values, held, quantity)
    other = RESPONSES[quantity]
    named = variable(tuple(map(str, response[held].dims)), values, other.units, other.text)
    return response.drop_vars(held).assign({quantity: named})
