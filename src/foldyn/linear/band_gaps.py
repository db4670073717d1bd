"""Band gaps: frequencies at which no wave travels, in any direction or in one."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.values import number

if TYPE_CHECKING:
    import xarray

ALL = "all"
"""Direction of full gaps, at every phase."""


def band_gaps(bands: Any, least: float = 1e-3) -> xarray.Dataset:
    """Gaps between bands: full ones, and those along each leg of a path.

    Parameters
    ----------
    bands : xarray.Dataset
        From `foldyn.bands`; gaps are as reliable as the phases are dense and cover the zone
        (`UnitCell.grid`).
    least : float
        Least relative width (over the middle frequency) of a listed gap.

    Returns
    -------
    xarray.Dataset
        A row `gap` for each: `direction` ("all" for full gaps, "G-X" for a gap on this leg only),
        `below` and `above` (numbers of the bands in the order of frequency; 0 below the first one),
        `bottom`, `top`, `middle` and `width` (Hz), and `relative_width`. Full ones come first, each
        direction from low to high frequencies. `to_dataframe()` prints it.

    Raises
    ------
    InputError
        Not a result of `foldyn.bands`.
    """
    import xarray

    frequency = frequencies_of(bands)
    least = number("least", least, least=0.0)
    found = []
    for direction, rows in legs(bands).items():
        # a gap below the first band concerns the whole zone, or does not exist
        found += [
            (direction, *gap) for gap in _gaps(frequency[rows], least) if gap[0] or direction == ALL
        ]
    direction, below, bottom, top = ([gap[k] for gap in found] for k in range(4))
    low, high = np.array(bottom, float), np.array(top, float)
    middle, width = 0.5 * (low + high), high - low
    numbers = np.array(below, np.int64)
    return xarray.Dataset(
        {
            "direction": ("gap", np.array(direction, np.str_)),
            "below": ("gap", numbers),
            "above": ("gap", numbers + 1),
            "bottom": ("gap", low, {"units": "Hz"}),
            "top": ("gap", high, {"units": "Hz"}),
            "middle": ("gap", middle, {"units": "Hz"}),
            "width": ("gap", width, {"units": "Hz"}),
            "relative_width": ("gap", width / np.where(middle > 0.0, middle, 1.0)),
        }
    )


def frequencies_of(bands: Any) -> NDArray[np.float64]:
    """Frequencies (phase, band), Hz, sorted at each phase; 0 for unstable waves."""
    if not hasattr(bands, "data_vars") or "frequency" not in bands or "band" not in bands.dims:
        raise InputError(f": got {type(bands).__name__}; give what foldyn.bands returns", "bands")
    values = bands["frequency"].transpose("phase", "band").values
    return np.sort(np.nan_to_num(values, nan=0.0), axis=1)


def legs(bands: Any) -> dict[str, NDArray[np.int64]]:
    """Rows of phases by direction: all, and those on each leg of a path."""
    every = np.arange(bands.sizes["phase"])
    found = {ALL: every}
    if "ticks" not in bands.attrs or "distance" not in bands.coords:
        return found
    names, ticks = bands.attrs["tick_labels"].split("-"), np.atleast_1d(bands.attrs["ticks"])
    distance = bands["distance"].values
    for k, (a, b) in enumerate(pairwise(ticks.tolist())):
        slack = 1e-9 * distance[-1]
        rows = every[(distance >= a - slack) & (distance <= b + slack)]
        name = f"{names[k]}-{names[k + 1]}"
        found[name] = np.union1d(found.get(name, rows), rows)
    return found


def _gaps(frequency: NDArray, least: float) -> list[tuple[int, float, float]]:
    """Number of the band below, bottom and top (Hz) of each gap over some phases."""
    tops = frequency.min(axis=0)
    bottoms = np.concatenate([[0.0], frequency.max(axis=0)[:-1]])
    wide = tops - bottoms > np.maximum(least * 0.5 * (tops + bottoms), 0.0)
    return [(int(k), float(bottoms[k]), float(tops[k])) for k in np.flatnonzero(wide)]
