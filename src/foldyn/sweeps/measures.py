"""The measures that a sweep can take, by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.cases.directions import AXES
from foldyn.errors import InputError
from foldyn.linear.frf import quantity_of
from foldyn.linear.peaks_of import kind_of, resonances
from foldyn.signals import (
    Peaks,
    find_peaks,
    half_power,
    log_decrement,
    sampling_interval,
    spectrum,
)
from foldyn.statics import Landscape, landscape
from foldyn.sweeps.measure import AXIS, MODE, MODEL, NODE, Measure
from foldyn.viewer.fields import bar_strain

MOTION, PATH, MODES, FRF, FIDELITY = "dynamics", "statics", "modes", "frf", "fidelity"
PROMINENT = 0.05
"""Least prominence of a peak of a spectrum, as a part of its maximum."""


# ------------------------------------------------------------------------- modes
def _frequencies(result: xr.Dataset, case: Case) -> NDArray:
    return result["frequency"].values


def _frequency(result: xr.Dataset, case: Case, mode: int) -> float:
    return float(_of_mode(result, "frequency", mode))


def _damping_ratios(result: xr.Dataset, case: Case) -> NDArray:
    return result["damping_ratio"].values


def _damping_ratio(result: xr.Dataset, case: Case, mode: int) -> float:
    return float(_of_mode(result, "damping_ratio", mode))


def _effective_mass(result: xr.Dataset, case: Case, mode: int, axis: str) -> float:
    return float(_of_mode(result, "effective_mass", mode).sel(axis=axis))


def _of_mode(result: xr.Dataset, name: str, mode: int) -> xr.DataArray:
    if mode not in result["mode"].values:
        raise InputError(f"there are {result.sizes['mode']} modes; raise analysis.count")
    return result[name].sel(mode=mode)


def _unstable_modes(result: xr.Dataset, case: Case) -> int:
    return int(((result["eigenvalue"] < 0.0) & ~result["rigid"].astype(bool)).sum())


def _rigid_modes(result: xr.Dataset, case: Case) -> int:
    return int(result["rigid"].sum())


# ------------------------------------------------------- responses, and spectra of motions
def _curve(result: xr.Dataset, node: int, axis: str | None) -> tuple[NDArray, NDArray, Peaks, str]:
    """Frequencies, magnitudes at a node (of the vector where no axis is named), and their peaks."""
    along = list(AXES) if axis is None else [axis]
    if "time" in result:
        motion = result["displacement"].transpose("time", ...).sel(node=node, axis=along).values
        interval = sampling_interval(result["time"].values)
        f, amplitude = spectrum(motion, interval, detrend="constant")
        size = np.linalg.norm(amplitude, axis=1)
        return f, size, find_peaks(f, size, PROMINENT), "receptance"
    shown = quantity_of(result)
    response = result[shown].transpose("frequency", ...).sel(node=node, axis=along).values
    size = np.linalg.norm(np.abs(response), axis=1)
    f, usable = result["frequency"].values, np.isfinite(size)
    f, size = f[usable], size[usable]
    if f.size < 3:
        raise InputError("a peak needs a response at three frequencies at least")
    peaks = resonances(f, size, shown, None, None, "coherence" in result)
    return f, size, peaks, kind_of(shown)


def _highest(peaks: Peaks) -> int | None:
    return int(np.argmax(peaks.height)) if peaks.height.size else None


def _peak_frequency(result: xr.Dataset, case: Case, node: int, axis: str | None = None) -> float:
    peaks = _curve(result, node, axis)[2]
    k = _highest(peaks)
    return np.nan if k is None else float(peaks.frequency[k])


def _peak_height(result: xr.Dataset, case: Case, node: int, axis: str | None = None) -> float:
    peaks = _curve(result, node, axis)[2]
    k = _highest(peaks)
    return np.nan if k is None else float(peaks.height[k])


def _peak_frequencies(
    result: xr.Dataset, case: Case, node: int, axis: str | None = None
) -> NDArray:  # fmt: skip
    return _curve(result, node, axis)[2].frequency


def _peak_damping(result: xr.Dataset, case: Case, node: int, axis: str | None = None) -> float:
    f, size, peaks, kind = _curve(result, node, axis)
    k = _highest(peaks)
    if k is None:
        return np.nan
    return half_power(f, size, float(peaks.frequency[k]), kind).damping_ratio


def _decay(result: xr.Dataset, case: Case, node: int, axis: str) -> float:
    motion = result["displacement"].sel(node=node, axis=axis).values
    return log_decrement(motion, sampling_interval(result["time"].values)).damping_ratio


# ------------------------------------------------------------------- motions and paths
def _displacement(result: xr.Dataset, case: Case, node: int, axis: str) -> float:
    return float(_sampled(result, "displacement")[-1].sel(node=node, axis=axis))


def _largest_displacement(result: xr.Dataset, case: Case, node: int | None = None) -> float:
    moved = _sampled(result, "displacement")
    moved = moved if node is None else moved.sel(node=[node])
    return float(np.linalg.norm(moved.values, axis=-1).max())


def _sampled(result: xr.Dataset, name: str) -> xr.DataArray:
    """A variable of a motion or a path, samples first."""
    along = "time" if "time" in result.dims else "step"
    return result[name].transpose(along, ...)


def _strain_energy(result: xr.Dataset, case: Case) -> float:
    return float(sum(result[name].values for name in case.energy_groups).max())  # type: ignore


def _dissipated(result: xr.Dataset, case: Case) -> float:
    if "dissipated" not in result:
        return 0.0  # a path without creases that yield
    return float(_sampled(result, "dissipated")[-1])


def _energy_error(result: xr.Dataset, case: Case) -> float:
    return float(result.attrs["energy_error"])


def _strain(result: xr.Dataset, case: Case) -> float:
    if case.structure.bar_law is None:
        raise InputError("is of bars, and a shell has none")
    moved = _sampled(result, "displacement").transpose(..., "node", "axis").values
    return float(np.abs(bar_strain(case.structure, moved)).max())


# --------------------------------------------------------------------------- paths
def _reaction(result: xr.Dataset, case: Case, axis: str) -> float:
    chosen = (result["support_axis"] == axis).values
    return float(_sampled(result, "reaction").values[-1, chosen].sum())


def _largest_load(result: xr.Dataset, case: Case) -> float:
    return float(result["load_factor"].values.max())


def _loads_at(result: xr.Dataset, kind: str) -> NDArray:
    return result["load_factor"].values[result["point"].values == kind]


def _limit_loads(result: xr.Dataset, case: Case) -> NDArray:
    return _loads_at(result, "limit")


def _limit_load(result: xr.Dataset, case: Case) -> float:
    found = _loads_at(result, "limit")
    return float(found[0]) if found.size else np.nan


def _bifurcation_load(result: xr.Dataset, case: Case) -> float:
    found = _loads_at(result, "bifurcation")
    return float(found[0]) if found.size else np.nan


def _stiffness(found: Landscape, case: Case) -> float:
    return _secant(found, slice(0, 2))


def _final_stiffness(found: Landscape, case: Case) -> float:
    return _secant(found, slice(-2, None))


def _secant(found: Landscape, part: slice) -> float:
    return float(np.diff(found.force[part])[0] / np.diff(found.stroke[part])[0])


def _stable_states(found: Landscape, case: Case) -> int:
    return len(found.stable)


def _state_strokes(found: Landscape, case: Case) -> NDArray:
    return np.array([state.stroke for state in found.stable])


def _state_energies(found: Landscape, case: Case) -> NDArray:
    return np.array([state.energy for state in found.stable])


def _barrier(found: Landscape, case: Case) -> float:
    return found.barrier(0, 1) if len(found.stable) > 1 else np.nan


def _barrier_back(found: Landscape, case: Case) -> float:
    return found.barrier(1, 0) if len(found.stable) > 1 else np.nan


# ------------------------------------------------------------- comparison with the shell
def _frequency_errors(result: xr.Dataset, case: Case, model: str) -> NDArray:
    if model not in result["model"].values:
        raise InputError(f"there is no model {model}, but {', '.join(result['model'].values)}")
    return result["error"].sel(model=model).values


def _of_landscape(
    name: str, function: Callable[..., Any], units: str, doc: str, *dims: str
) -> Measure:
    return Measure(name, (PATH,), function, units, doc, dims, through=landscape)


_CURVES = (FRF, MOTION)
_MOVED = (MOTION, PATH)
_AT = (NODE, AXIS)

MEASURES: Mapping[str, Measure] = {
    one.name: one
    for one in (
        Measure("frequencies", (MODES,), _frequencies, "Hz", "frequency", (MODE,)),
        Measure("frequency", (MODES,), _frequency, "Hz", "frequency", (), (MODE,), 1),
        Measure("damping_ratios", (MODES,), _damping_ratios, "1", "damping ratio", (MODE,)),
        Measure("damping_ratio", (MODES,), _damping_ratio, "1", "damping ratio", (), (MODE,), 1),
        Measure("effective_mass", (MODES,), _effective_mass, "kg", "effective mass", (),
                (MODE, AXIS), 2),
        Measure("rigid_modes", (MODES,), _rigid_modes, "1", "rigid modes"),
        Measure("unstable_modes", (MODES,), _unstable_modes, "1", "unstable modes"),
        Measure("peak_frequency", _CURVES, _peak_frequency, "Hz", "frequency of the highest peak",
                (), _AT, 1),
        Measure("peak_frequencies", _CURVES, _peak_frequencies, "Hz", "frequency of a peak",
                ("peak",), _AT, 1),
        Measure("peak_height", _CURVES, _peak_height, "",
                "height of the highest peak (unit of the response)", (), _AT, 1),
        Measure("peak_damping", (FRF,), _peak_damping, "1",
                "damping ratio of the highest peak, by half power", (), _AT, 1),
        Measure("decay", (MOTION,), _decay, "1", "damping ratio by logarithmic decrement", (),
                _AT, 2),
        Measure("displacement", _MOVED, _displacement, "m", "displacement at the end", (), _AT, 2),
        Measure("largest_displacement", _MOVED, _largest_displacement, "m",
                "largest displacement", (), (NODE,)),
        Measure("strain_energy", _MOVED, _strain_energy, "J", "largest strain energy"),
        Measure("dissipated", _MOVED, _dissipated, "J", "energy dissipated"),
        Measure("strain", _MOVED, _strain, "1", "largest strain of a bar"),
        Measure("energy_error", (MOTION,), _energy_error, "1", "error of the energy balance"),
        Measure("reaction", (PATH,), _reaction, "N", "sum of the reactions at the end", (),
                (AXIS,), 1),
        Measure("largest_load", (PATH,), _largest_load, "1", "largest load factor"),
        Measure("limit_loads", (PATH,), _limit_loads, "1", "load factor of a limit point",
                ("limit",)),
        Measure("limit_load", (PATH,), _limit_load, "1", "load factor of the first limit point"),
        Measure("bifurcation_load", (PATH,), _bifurcation_load, "1",
                "load factor of the first bifurcation"),
        _of_landscape("stiffness", _stiffness, "N/m", "stiffness over the first step"),
        _of_landscape("final_stiffness", _final_stiffness, "N/m", "stiffness over the last step"),
        _of_landscape("stable_states", _stable_states, "1", "stable states without force"),
        _of_landscape("state_strokes", _state_strokes, "m", "stroke of a stable state", "state"),
        _of_landscape("state_energies", _state_energies, "J", "energy of a stable state", "state"),
        _of_landscape("barrier", _barrier, "J", "energy from the first stable state to the next"),
        _of_landscape("barrier_back", _barrier_back, "J",
                      "energy from the second stable state to the first"),
        Measure("frequency_errors", (FIDELITY,), _frequency_errors, "1",
                "error of a frequency against the shell", (MODE,), (MODEL,), 1),
    )
}  # fmt: skip
"""By name."""
