"""Values that a result lacks by nature (nan): each variable that has any says why."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

REASONS: Mapping[str, str] = {
    "frequency": "an unstable mode grows instead of swinging",
    "damping_ratio": "a rigid or an unstable mode does not swing",
    "receptance": "a resonance without damping, a body free to move at 0 Hz, or no convergence",
    "transmissibility": "a resonance without damping, or no convergence",
    "coherence": "what does not respond (held axes, nodes at rest) is coherent with nothing",
    "swing": "the harmonic balance does not converge at the frequency",
}
"""Variables that may lack values, and why."""
UNEXPECTED = "the computation was no longer finite"


def with_reason(name: str, variable: tuple) -> tuple:
    """Variable (dimensions, values, attributes) with why it lacks values, where it does."""
    dimensions, values, attributes = variable
    if not count(values):
        return variable
    return dimensions, values, {**attributes, "missing": REASONS.get(name, UNEXPECTED)}


def count(values: Any) -> int:
    """How many values there are none of."""
    values = np.asarray(values)
    return int(np.isnan(values).sum()) if values.dtype.kind in "fc" else 0


def told(ds: xr.Dataset) -> dict[str, str]:
    """What is said of each variable of a result that lacks values, by its name."""
    return {
        str(name): f"{count(ds[name].values)} of {ds[name].size} values are missing (nan): "
        f"{ds[name].attrs.get('missing', UNEXPECTED)}"
        for name in ds.data_vars
        if count(ds[name].values)
    }
