"""Periodic motions along a response curve or a backbone, as a page shows them."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.periodic.balance import Fourier, values_of
from foldyn.viewer.arrays import Arrays

OF_MOTIONS = 1e-4
"""Error of Fourier coefficients, relative to the largest displacement of the motion."""
MOST_NUMBERS = 10_000_000
"""Largest number of values stored for all motions of a result; if there are more, only every k-th
point and named points remain."""
SAMPLES = 64
"""Number of samples of a period from which the largest displacement is found."""


def orbits(arrays: Arrays, key: str, result: xr.Dataset) -> dict[str, Any]:
    """Describe the motions of one result; its arrays get names that begin with key.

    "x" and "y" (point), the varied quantity and the amplitude; "sizes" (point), the largest
    displacement in a period, m; "displacement", a_0, a_1, b_1, a_2, ... (point, coefficient) of
    every node and axis, where the sum of a_k cos k tau + b_k sin k tau is the motion divided by
    that size; lists with one entry per point: "stable", "bifurcations", "branches" and "periods".
    """
    chosen = points(result)
    some = result.isel(point=chosen)
    amplitudes = some["coefficient"].transpose("point", "harmonic", "node", "axis").values
    size = np.array([largest(one) for one in amplitudes])
    own: Any = amplitudes / np.where(size > 0.0, size, 1.0)[:, None, None, None]
    series = Fourier(own.shape[1] - 1).real_of(own.swapaxes(0, 1)).swapaxes(0, 1)
    shapes, count = series.reshape(-1, *series.shape[2:]), len(chosen)
    return {
        "x": arrays.exact(f"{key}.x", some[along(result)].values, "f4"),
        "y": arrays.exact(f"{key}.y", some["amplitude"].values, "f4"),
        "sizes": arrays.exact(f"{key}.sizes", size, "f4"),
        "displacement": arrays.changing(f"{key}.u", shapes, OF_MOTIONS),
        "stable": _listed(some, "stable", [None] * count),
        "bifurcations": _listed(some, "bifurcation", [""] * count),
        "branches": _listed(some, "branch", [0] * count),
        "periods": _listed(some, "periods", [1] * count),
    }


def _listed(result: xr.Dataset, name: str, otherwise: list[Any]) -> list[Any]:
    """One value for each point, or an empty list for a backbone without these values."""
    return result[name].values.tolist() if name in result else otherwise


def points(result: xr.Dataset) -> NDArray[np.int64]:
    """Numbers of the points shown on a page."""
    every = -(-2 * result["coefficient"].size // MOST_NUMBERS)
    kept = np.arange(result.sizes["point"]) % every == 0
    if "branch" in result:
        ends = np.flatnonzero(np.diff(result["branch"].values))
        kept[ends] = kept[ends + 1] = True
        kept |= result["bifurcation"].values != ""
    kept[-1] = True
    return np.flatnonzero(kept)


def largest(amplitudes: NDArray) -> float:
    """Largest displacement of any node in a period; amplitudes (h + 1, n, 3) of exp(i k tau)."""
    phase = 2.0 * np.pi * np.arange(SAMPLES) / SAMPLES
    return float(np.linalg.norm(values_of(amplitudes, phase), axis=-1).max())


def along(result: xr.Dataset) -> str:
    """Name of the varied quantity."""
    return "level" if result.attrs.get("by") == "amplitudes" else "frequency"


def about_orbits(result: xr.Dataset) -> dict[str, Any]:
    """Description shared by all results of a page: the axis names of the curve."""
    driven = "by" in result.attrs
    label = {"frequency": "frequency of the drive (Hz)", "level": "factor on the drive"}
    measure = result.attrs.get("measure", "largest displacement")
    return {
        "along": label[along(result)] if driven else "frequency (Hz)",
        "hertz": along(result) == "frequency",
        "driven": driven,
        "measure": f"amplitude of the {measure}",
        "measured": result["amplitude"].attrs.get("units", ""),
    }
