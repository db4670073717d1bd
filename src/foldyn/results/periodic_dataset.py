"""Datasets of periodic motions: a single one, a response curve, and a backbone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from foldyn.cases import Case, Origin
from foldyn.results.dataset import origin_variables, result_dataset
from foldyn.results.quantities import PLACE, Quantity, variable, variables

HARMONICS = ("harmonic", *PLACE)
MOTION: Mapping[str, Quantity] = {
    "displacement": Quantity("m", "displacement from the rest position", PLACE),
    "velocity": Quantity("m/s", "velocity", PLACE),
}
POINTS: Mapping[str, Quantity] = {
    "frequency": Quantity("Hz", "frequency of the drive"),
    "level": Quantity("1", "factor on the drive"),
    "amplitude": Quantity("m", "half the distance between the extremes"),
    "stable": Quantity(text="whether the motion is stable"),
    "bifurcation": Quantity(text="bifurcation at the point"),
    "branch": Quantity(text="number of the branch"),
    "periods": Quantity("1", "periods of the drive in one of the motion"),
    "floquet": Quantity("1", "Floquet multiplier", ("multiplier",)),
    "coefficient": Quantity("m", "complex amplitude of a harmonic of the motion", HARMONICS),
    "truncation": Quantity("1", "what twice as many harmonics would add, estimated"),
    "reduction": Quantity("1", "what the dofs left out would add, estimated"),
    "energy": Quantity("J", "energy above that at rest"),
    "energy_drift": Quantity("1", "largest change of the energy along the motion"),
}
"""Possible variables of points of a curve or a backbone, along the dimension point."""


def periodic_dataset(
    case: Case, time: ArrayLike, motion: Mapping[str, ArrayLike], coefficient: NDArray,
    floquet: ArrayLike, stable: bool, periods: int, statistics: Mapping[str, Any],
    origin: Origin | None = None,
) -> xr.Dataset:  # fmt: skip
    """Dataset of one periodic motion, which carries its case.

    Parameters
    ----------
    case : Case
    time : array_like, shape (nt,)
        Over one period, s.
    motion : mapping of str to array_like, shape (nt, n, 3)
        displacement (m) and velocity (m/s).
    coefficient : ndarray, complex, shape (h + 1, n, 3)
        Amplitudes of exp(2 pi i j t / period), m.
    floquet : array_like, complex, shape (2k,)
    stable : bool
    periods : int
        Drive periods per period of the motion.
    statistics : mapping
        Facts about the computation, each stored as an attribute.
    origin : Origin, optional
        The reference state of damping.
    """
    data = variables(MOTION, "time", motion)
    data |= {} if origin is None else origin_variables(origin)
    own = POINTS["coefficient"]
    data["coefficient"] = variable(own.dims, coefficient, own.units, own.text)
    single = {"stable": bool(stable), "periods": int(periods)}
    for name, value in single.items():
        data[name] = variable((), value, POINTS[name].units, POINTS[name].text)
    data["floquet"] = variable(("multiplier",), floquet, "1", POINTS["floquet"].text)
    along = {
        "time": ("time", np.asarray(time, float), {"units": "s"}),
        "harmonic": ("harmonic", np.arange(len(coefficient)), {"long_name": "harmonic"}),
    }
    return result_dataset("periodic_motion", case, data, along, statistics)


def points_dataset(
    kind: str, case: Case, values: Mapping[str, ArrayLike], statistics: Mapping[str, Any],
    units: str = "m", origin: Origin | None = None,
) -> xr.Dataset:  # fmt: skip
    """Dataset of the points of a response curve or a backbone, which carries its case.

    Parameters
    ----------
    kind : {"response_curve", "backbone"}
    case : Case
    values : mapping of str to array_like, shape (points, ...)
        Variables of `POINTS`; `frequency` is a coordinate.
    statistics : mapping
        Facts about the computation, each stored as an attribute.
    units : str
        Unit of the amplitude.
    origin : Origin, optional
        See `periodic_dataset`.
    """
    size = POINTS["amplitude"]._replace(units=units)
    if kind == "backbone":
        size = size._replace(text="largest displacement of any node from the equilibrium")
    known = {**POINTS, "amplitude": size}
    data = variables(known, "point", {k: v for k, v in values.items() if k != "frequency"})
    data |= {} if origin is None else origin_variables(origin)
    text = "frequency of the motion" if kind == "backbone" else POINTS["frequency"].text
    frequency = np.asarray(values["frequency"], float)
    along: dict[str, Any] = {
        "frequency": ("point", frequency, {"units": "Hz", "long_name": text}),
        "point": ("point", np.arange(len(frequency)), {"long_name": "point"}),
    }
    if "coefficient" in values:
        count = np.asarray(values["coefficient"]).shape[1]
        along["harmonic"] = ("harmonic", np.arange(count), {"long_name": "harmonic"})
    return result_dataset(kind, case, data, along, statistics)
