"""What figures read from frequency responses: which nodes and directions, in which unit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.linear import convert
from foldyn.linear.frf import PER_FORCE, quantity_of
from foldyn.plots.chosen import AXES, check_nodes_of, directions
from foldyn.results.quantities import RESPONSES


@dataclass(frozen=True)
class Curve:
    """The response of one node of one model.

    Attributes
    ----------
    label : str
        Of the model.
    node : int
    axis : str
    frequency : ndarray, shape (m,)
        Frequencies (Hz).
    values : ndarray, shape (m,), complex
    coherence : ndarray, shape (m,), or None
    """

    label: str
    node: int
    axis: str
    frequency: NDArray[np.float64]
    values: NDArray[np.complex128]
    coherence: NDArray[np.float64] | None


def curves_of(
    responses: Mapping[str, xr.Dataset],
    nodes: Sequence[int],
    axes: str | Sequence[str] | None,
    quantity: str | None,
) -> tuple[list[Curve], str]:
    """Responses of nodes, models first, and the quantity that they show.

    Raises
    ------
    InputError
        No response or node, a node, direction or quantity that a response does not have.
    """
    if not isinstance(responses, Mapping) or not responses:
        raise InputError("responses: give a mapping {label: response}, with at least one of them")
    held = {quantity_of(response) for response in responses.values()}
    if len(held) > 1:
        raise InputError("responses: forces drive some of them, a base others; draw them apart")
    shown = held.pop()
    if quantity is not None:
        if quantity not in PER_FORCE or shown not in PER_FORCE:
            known = ", ".join(PER_FORCE) if shown in PER_FORCE else shown
            raise InputError(f"quantity: {quantity!r}; the response has {known}")
        shown = quantity
        responses = {label: convert(response, shown) for label, response in responses.items()}
    numbers = check_nodes_of(responses, nodes)
    seen = (r[shown].sel(node=numbers, axis=list(AXES)).values for r in responses.values())
    chosen = directions(axes, len(numbers), map(np.nan_to_num, seen))
    curves = []
    for label, response in responses.items():
        frequency = response["frequency"].values.astype(np.float64)
        for node, axis in zip(numbers, chosen, strict=True):
            here = response.sel(node=node, axis=axis)
            values = here[shown].values.astype(np.complex128)
            coherence = here["coherence"].values if "coherence" in response else None
            curves.append(Curve(label, node, axis, frequency, values, coherence))
    return curves, shown


def unit_of(quantity: str) -> str:
    """What stands behind a quantity at an axis: its unit in parentheses, or nothing."""
    unit = RESPONSES[quantity].units.replace("s2", "s²")
    return "" if unit == "1" else f" ({unit})"
