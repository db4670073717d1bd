"""Modes of a model beside those of the shell that have the same shape."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn.linear import mac, pair_modes

LEAST_MAC = 0.5  # below which modes are no partners,
FAR = 2.0  # nor where their frequencies are this many times apart


@dataclass(frozen=True, eq=False)
class Partners:
    """Modes of the shell and their partners in a model; nan where there is none.

    Attributes
    ----------
    reference, frequency : (k,)
        Hz.
    mac : (k,)
        How alike their shapes are at the pattern's vertices.
    """

    reference: NDArray
    frequency: NDArray
    mac: NDArray

    @property
    def deviation(self) -> NDArray:
        """Frequency over that of the shell, less one."""
        return self.frequency / self.reference - 1.0

    @property
    def mean_error(self) -> float:
        """Mean size of the deviations of the modes that have a partner."""
        known = self.deviation[np.isfinite(self.deviation)]
        return float(np.abs(known).mean()) if len(known) else float("nan")


def partners(reference: xarray.Dataset, ours: xarray.Dataset) -> Partners:
    """Modes of `ours` that belong to those of `reference`; both at the pattern's vertices."""
    vertices = reference["node"].values.tolist()
    theirs = reference["frequency"].values
    ratio = ours["frequency"].values / theirs[:, None]
    near = (ratio > 1.0 / FAR) & (ratio < FAR)  # few vertices cannot tell waves of any length
    pairs = pair_modes(np.where(near, mac(reference, ours, nodes=vertices), 0.0), LEAST_MAC)
    frequency, likeness = (np.full(len(theirs), np.nan) for _ in range(2))
    frequency[pairs.first] = ours["frequency"].values[pairs.second]
    likeness[pairs.first] = pairs.mac
    return Partners(theirs, frequency, likeness)
