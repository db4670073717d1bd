"""Measures of repeated cases: frequencies and gaps of bands, and effective properties."""

from __future__ import annotations

from functools import partial

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.errors import InputError
from foldyn.linear.band_structure import ALL, frequencies_of, legs
from foldyn.sweeps.measure import AXIS, BAND, Measure, measure
from foldyn.values import choice

BANDS, EFFECTIVE = "bands", "effective"
OF_CELLS: dict[str, Measure] = {}
"""Measures of repeated cases by name."""
_measure = partial(measure, OF_CELLS)


@_measure(BANDS, units="Hz", doc="frequency", dims=("phase", BAND))
def _band_frequencies(result: xr.Dataset, case: Case) -> NDArray:
    return _in_order(result)


@_measure(BANDS, units="Hz", doc="frequency")
def _band(result: xr.Dataset, case: Case, band: int, point: str) -> float:
    ticks = np.atleast_1d(result.attrs["ticks"])
    at = dict(zip(result.attrs["tick_labels"].split("-"), ticks.tolist(), strict=True))
    if point not in at:
        raise InputError(f"the path has the points {', '.join(at)}")
    k = int(np.abs(result["distance"].values - at[point]).argmin())
    return float(_of_band(_in_order(result), band)[k])


@_measure(BANDS, units="Hz", doc="width of the gap above")
def _band_gap(result: xr.Dataset, case: Case, band: int, leg: str = ALL) -> float:
    bottom, top = _gap_ends(result, band, leg)
    return top - bottom


@_measure(BANDS, units="Hz", doc="middle of the gap above")
def _gap_center(result: xr.Dataset, case: Case, band: int, leg: str = ALL) -> float:
    bottom, top = _gap_ends(result, band, leg)
    return 0.5 * (bottom + top)


@_measure(BANDS, doc="relative width of the gap above")
def _relative_gap(result: xr.Dataset, case: Case, band: int, leg: str = ALL) -> float:
    bottom, top = _gap_ends(result, band, leg)
    return 2.0 * (top - bottom) / (bottom + top) if bottom + top > 0.0 else np.nan


@_measure(BANDS, units="Hz", doc="width of the widest full gap")
def _widest_gap(result: xr.Dataset, case: Case) -> float:
    count = result.sizes[BAND]
    return max((_band_gap(result, case, band) for band in range(1, count)), default=0.0)


@_measure(BANDS, units="Np", doc="attenuation from cell to cell at a frequency")
def _attenuation(result: xr.Dataset, case: Case, leg: str, frequency: float) -> float:
    _one_state(result)
    if "attenuation" not in result:
        raise InputError("needs analysis.attenuation, the number of frequencies")
    if leg not in result["leg"].values:
        raise InputError(f"is computed only along {', '.join(map(str, result['leg'].values))}")
    levels = result["level_frequency"].values
    if not 0.0 < frequency <= levels[-1]:
        raise InputError(f"is known up to {levels[-1]:g} Hz")
    return float(np.interp(frequency, levels, result["attenuation"].sel(leg=leg).values))


@_measure(BANDS, doc="unstable bands")
def _unstable_bands(result: xr.Dataset, case: Case) -> int:
    _one_state(result)
    return int((result["eigenvalue"] < 0.0).any("phase").sum())


def _property(name: str, result: xr.Dataset, case: Case, **labels: str) -> float:
    """A number of the equivalent plate, beam or solid, by its labels; the last counts for more."""
    _one_state(result)
    variable = {"coupling": "stiffness"} if "stiffness" in result else {}
    own = variable.get(name, name)
    if own not in result:
        known = ", ".join(one for one in PROPERTIES if variable.get(one, one) in result)
        raise InputError(f"this cell has none; it has {known}")
    dims, given = result[own].dims, [*labels.values()]
    if (dims and not given) or len(given) > len(dims):
        raise InputError(f"this cell has it by {' and '.join(map(str, dims)) or 'no label'}")
    at = dict(zip(dims, given + given[-1:] * (len(dims) - len(given)), strict=True))
    for dim, label in at.items():
        choice(str(dim), label, result[dim].values.tolist())
    return float(result[own].sel(at))


PROPERTIES = {
    name: Measure(
        name, (EFFECTIVE,), partial(_property, name), units, doc, takes=takes,
        needs=0 if takes in ((), ("plane",)) else 1,
    )
    for takes, rows in {
        ("pair",): (
            ("poissons_ratio", "1", "Poisson's ratio along an axis, of a solid xy, xz, yx, ..."),
        ),
        (AXIS,): (
            ("bending_poissons_ratio", "1", "Poisson's ratio of bending along an axis"),
            ("modulus", "", "modulus of stretching along an axis of the sheet or solid"),
            ("bending_modulus", "N m", "modulus of bending along an axis of the sheet"),
        ),
        ("load", "strain"): (
            ("membrane", "N/m", "membrane stiffness of the sheet"),
            ("bending", "N m", "bending stiffness of the sheet"),
            ("coupling", "", "forces per curvature of the sheet, or stiffness of others"),
        ),
        ("load",): (
            ("mean_force", "N/m", "mean force of the sheet in its state"),
            ("mean_load", "", "mean load of the chain, or stress of the solid, in its state"),
        ),
        ("bend",): (("bending_stiffness", "N m2", "least or greatest EI of the chain"),),
        ("plane",): (("shear_modulus", "", "shear modulus of the sheet, or solid in a plane"),),
        (): (
            ("twisting_modulus", "N m", "moment of twist of the sheet per unit of twist"),
            ("axial_stiffness", "N", "EA of the chain"),
            ("torsional_stiffness", "N m2", "GJ of the chain"),
            ("density", "",
             "mass per area of the sheet, length of the chain, or volume of the solid"),
        ),
    }.items()
    for name, units, doc in rows
}  # fmt: skip
"""Measures of the equivalent plate, beam or solid by name."""
OF_CELLS |= PROPERTIES


def _gap_ends(result: xr.Dataset, band: int, leg: str) -> tuple[float, float]:
    """Top of a band and bottom of the next one (Hz), along a leg of the path or overall."""
    values, known = _in_order(result), legs(result)
    if leg not in known:
        raise InputError(f"the path has the legs {', '.join(known)}")
    values = values[known[leg]]
    if leg == ALL and "zone_frequency" in result:
        zone = result["zone_frequency"].transpose("zone", BAND).values
        values = np.vstack([values, np.sort(np.nan_to_num(zone), axis=1)])
    if band == result.sizes[BAND]:
        raise InputError(f"there are {band} bands, none above this one; raise analysis.count")
    return float(_of_band(values, band).max()), float(values[:, band].min())


def _in_order(result: xr.Dataset) -> NDArray:
    """Frequencies (phase, band), Hz, in increasing order at each phase."""
    _one_state(result)
    return frequencies_of(result)


def _of_band(values: NDArray, band: int) -> NDArray:
    if band > values.shape[1]:
        raise InputError(f"there are {values.shape[1]} bands; raise analysis.count")
    return values[:, band - 1]


def _one_state(result: xr.Dataset) -> None:
    if "state" in result.dims:
        raise InputError("needs a single state; leave out analysis.vary, and sweep its key instead")
