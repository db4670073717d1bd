"""Registry of the measures that are available in sweeps."""

from __future__ import annotations

from functools import partial

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.cases.directions import AXES
from foldyn.errors import InputError, warn
from foldyn.linear.frf import quantity_of
from foldyn.linear.margins import margins
from foldyn.linear.peaks_of import kind_of, resonances
from foldyn.linear.stresses import stresses_of
from foldyn.mechanics.contact.clearance import Clearance, clearance
from foldyn.signals import Peaks, find_peaks, half_power, log_decrement, sampling_interval, spectrum
from foldyn.statics import Landscape, landscape
from foldyn.statics.energy_landscape import load_at
from foldyn.sweeps.cell_measures import OF_CELLS
from foldyn.sweeps.measure import MODE, Measure, measure
from foldyn.viewer.states import bar_strain

MOTION, PATH, MODES, FRF, FIDELITY = "dynamics", "statics", "modes", "frf", "fidelity"
BUCKLING, RANDOM = "buckling", "random"
PROMINENT = 0.05
"""Least prominence of a peak of a spectrum, relative to its maximum."""
NEAR = 1e-5
"""Intervals of load factors with a smaller relative width are not reported."""
SPANS = {
    "time": "the motion lasts from {:g} to {:g} s",
    "frequency": "the response has frequencies from {:g} to {:g} Hz",
}
CURVES, MOVED = (FRF, MOTION), (MOTION, PATH)
MEASURES: dict[str, Measure] = {**OF_CELLS}
"""Measures by name."""


_measure = partial(measure, MEASURES)


@_measure(units="kg", doc="mass of the sheet and of point masses")
def _mass(result: xr.Dataset, case: Case) -> float:
    return float(case.mass.sum())


# ------------------------------------------------------------------------- modes
@_measure(MODES, units="Hz", doc="frequency", dims=(MODE,))
def _frequencies(result: xr.Dataset, case: Case) -> NDArray:
    return result["frequency"].values


@_measure(MODES, units="Hz", doc="frequency")
def _frequency(result: xr.Dataset, case: Case, mode: int) -> float:
    return float(_of_mode(result, "frequency", mode))


@_measure(MODES, doc="damping ratio", dims=(MODE,))
def _damping_ratios(result: xr.Dataset, case: Case) -> NDArray:
    return result["damping_ratio"].values


@_measure(MODES, doc="damping ratio")
def _damping_ratio(result: xr.Dataset, case: Case, mode: int) -> float:
    return float(_of_mode(result, "damping_ratio", mode))


@_measure(MODES, units="kg", doc="effective mass")
def _effective_mass(result: xr.Dataset, case: Case, mode: int, axis: str) -> float:
    return float(_of_mode(result, "effective_mass", mode).sel(axis=axis))


@_measure(MODES, doc="share of the air in the modal mass")
def _air_share(result: xr.Dataset, case: Case, mode: int) -> float:
    return float(_of_mode(result, "air_share", mode)) if "air_share" in result else 0.0


def _of_mode(result: xr.Dataset, name: str, mode: int) -> xr.DataArray:
    if mode not in result["mode"].values:
        raise InputError(f"there are {result.sizes['mode']} modes; raise analysis.count")
    return result[name].sel(mode=mode)


@_measure(MODES, doc="unstable modes")
def _unstable_modes(result: xr.Dataset, case: Case) -> int:
    return int(((result["eigenvalue"] < 0.0) & ~result["rigid"].astype(bool)).sum())


@_measure(MODES, doc="rigid modes")
def _rigid_modes(result: xr.Dataset, case: Case) -> int:
    return int(result["rigid"].sum())


# ------------------------------------------------------------------------- buckling
@_measure(BUCKLING, doc="lowest positive load factor of linear buckling (nan: none)")
def _buckling_load(result: xr.Dataset, case: Case) -> float:
    factors = result["load_factor"].values
    return float(factors[0]) if len(factors) and factors[0] > 0.0 else np.nan


@_measure(RANDOM, units="m", doc="root mean square displacement")
def _rms(result: xr.Dataset, case: Case, node: int, axis: str) -> float:
    return float(result["displacement_rms"].sel(node=node, axis=axis))


@_measure(RANDOM, units="N", doc="root mean square of the sum of the reactions")
def _reaction_rms(result: xr.Dataset, case: Case, axis: str) -> float:
    if "total_reaction_rms" not in result:
        raise InputError("needs analysis.reactions = true")
    return float(result["total_reaction_rms"].sel(axis=axis))


@_measure(RANDOM, units="m/s2", doc="root mean square of the absolute acceleration")
def _acceleration_rms(result: xr.Dataset, case: Case, node: int, axis: str) -> float:
    return float(result["acceleration_rms"].sel(node=node, axis=axis))


# ------------------------------------------------------- responses, and spectra of motions
def curve_of(
    result: xr.Dataset, node: int, axis: str | None
) -> tuple[NDArray, NDArray, Peaks, str]:
    """Frequencies, magnitudes at a node (along an axis, or of the vector), and their peaks."""
    along = list(AXES) if axis is None else [axis]
    if "time" in result:
        motion = result["displacement"].transpose("time", ...).sel(node=node, axis=along).values
        interval = sampling_interval(result["time"].values)
        f, amplitude = spectrum(motion, interval, detrend="constant")
        size = np.linalg.norm(amplitude, axis=1)
        return f, size, find_peaks(f, size, prominence=PROMINENT), "receptance"
    shown = quantity_of(result)
    response = result[shown].transpose("frequency", ...).sel(node=node, axis=along).values
    size = np.linalg.norm(np.abs(response), axis=1)
    f, usable = result["frequency"].values, np.isfinite(size)
    f, size = f[usable], size[usable]
    if f.size < 3:
        raise InputError("a peak needs a response at three frequencies at least")
    peaks = resonances(f, size, shown, None, None, "coherence" in result)
    return f, size, peaks, kind_of(shown)


def _highest(peaks: Peaks, name: str) -> float:
    """A number of the highest peak; nan if there is none."""
    return float(getattr(peaks, name)[peaks.height.argmax()]) if peaks.height.size else np.nan


def nearest_of(result: xr.Dataset, along: str, value: float) -> int:
    """Index of the sample in time (s) or frequency (Hz) that is nearest.

    It is at most half the spacing away.
    """
    known = result[along].values
    k = int(np.abs(known - value).argmin())
    if abs(known[k] - value) > 0.5 * np.diff(known).max(initial=0.0):
        raise InputError(SPANS[along].format(known[0], known[-1]))
    return k


@_measure(FRF, units="", doc="magnitude of the response at a frequency (unit of the response)")
def _response(result: xr.Dataset, case: Case, node: int, axis: str, frequency: float) -> float:
    response = result[quantity_of(result)].transpose("frequency", ...).sel(node=node, axis=axis)
    return float(np.abs(response.values[nearest_of(result, "frequency", frequency)]))


@_measure(*CURVES, units="Hz", doc="frequency of the highest peak")
def _peak_frequency(result: xr.Dataset, case: Case, node: int, axis: str | None = None) -> float:
    return _highest(curve_of(result, node, axis)[2], "frequency")


@_measure(*CURVES, units="", doc="height of the highest peak (unit of the response)")
def _peak_height(result: xr.Dataset, case: Case, node: int, axis: str | None = None) -> float:
    return _highest(curve_of(result, node, axis)[2], "height")


@_measure(*CURVES, units="Hz", doc="frequency of a peak", dims=("peak",))
def _peak_frequencies(
    result: xr.Dataset, case: Case, node: int, axis: str | None = None
) -> NDArray:  # fmt: skip
    return curve_of(result, node, axis)[2].frequency


@_measure(FRF, doc="damping ratio of the highest peak, by half power")
def _peak_damping(result: xr.Dataset, case: Case, node: int, axis: str | None = None) -> float:
    f, size, peaks, kind = curve_of(result, node, axis)
    near = _highest(peaks, "frequency")
    return near if np.isnan(near) else half_power(f, size, near=near, quantity=kind).damping_ratio


@_measure(MOTION, doc="damping ratio by logarithmic decrement")
def _decay(result: xr.Dataset, case: Case, node: int, axis: str) -> float:
    motion = result["displacement"].sel(node=node, axis=axis).values
    return log_decrement(motion, sampling_interval(result["time"].values)).damping_ratio


# ------------------------------------------------------------------- motions and paths
@_measure(*MOVED, units="m", doc="displacement at the end", whole=True)
def _displacement(result: xr.Dataset, case: Case, node: int, axis: str) -> float:
    return float(sampled(result, "displacement")[-1].sel(node=node, axis=axis))


@_measure(MOTION, units="m", doc="displacement at a time (s)")
def _displacement_at(result: xr.Dataset, case: Case, node: int, axis: str, time: float) -> float:
    moved = sampled(result, "displacement")[nearest_of(result, "time", time)]
    return float(moved.sel(node=node, axis=axis))


@_measure(MOTION, units="m/s", doc="velocity at the end")
def _velocity(result: xr.Dataset, case: Case, node: int, axis: str) -> float:
    return float(sampled(result, "velocity")[-1].sel(node=node, axis=axis))


@_measure(MOTION, units="m", doc="highest displacement")
def _maximum(result: xr.Dataset, case: Case, node: int, axis: str) -> float:
    return float(result["displacement"].sel(node=node, axis=axis).max())


@_measure(MOTION, units="m", doc="lowest displacement")
def _minimum(result: xr.Dataset, case: Case, node: int, axis: str) -> float:
    return float(result["displacement"].sel(node=node, axis=axis).min())


@_measure(MOTION, units="m s", doc="integral of a displacement over time")
def _integral(result: xr.Dataset, case: Case, node: int, axis: str) -> float:
    return float(result["displacement"].sel(node=node, axis=axis).integrate("time"))


@_measure(MOTION, units="m2", doc="mean square of a displacement over time")
def _mean_square(result: xr.Dataset, case: Case, node: int, axis: str) -> float:
    square, times = result["displacement"].sel(node=node, axis=axis) ** 2, result["time"].values
    return float(square.integrate("time")) / float(times[-1] - times[0])


@_measure(*MOVED, units="m", doc="largest displacement", whole=True)
def _largest_displacement(result: xr.Dataset, case: Case, node: int | None = None) -> float:
    moved = sampled(result, "displacement")
    moved = moved if node is None else moved.sel(node=[node])
    return float(np.linalg.norm(moved.values, axis=-1).max())


def sampled(result: xr.Dataset, name: str) -> xr.DataArray:
    """A variable of a motion or a path, with the samples along its first dimension."""
    along = "time" if "time" in result.dims else "step"
    return result[name].transpose(along, ...)


@_measure(*MOVED, units="J", doc="largest strain energy", whole=True)
def _strain_energy(result: xr.Dataset, case: Case) -> float:
    return float(sum(result[name].values for name in case.energy_groups).max())  # type: ignore


@_measure(*MOVED, units="J", doc="energy dissipated", whole=True)
def _dissipated(result: xr.Dataset, case: Case) -> float:
    if "dissipated" not in result:
        return 0.0  # a path without yielding creases
    return float(sampled(result, "dissipated")[-1])


@_measure(MOTION, doc="error of the energy balance")
def _energy_error(result: xr.Dataset, case: Case) -> float:
    return float(result.attrs["energy_error"])


@_measure(*MOVED, doc="largest strain of a bar", whole=True)
def _strain(result: xr.Dataset, case: Case) -> float:
    if case.structure.bar_law is None:
        raise InputError("needs bars, and a shell has none")
    moved = sampled(result, "displacement").transpose(..., "node", "axis").values
    return float(np.abs(bar_strain(case.structure, moved)).max())


@_measure(*MOVED, doc="largest share of its buckling load with which a bar is pressed", whole=True)
def _bar_load(result: xr.Dataset, case: Case) -> float:
    if case.lines is None or np.isinf(case.lines.limits).all():
        raise InputError("needs a Bar with bending, of which the buckling load follows")
    return float(max(0.0, case.bar_loads(sampled(result, "tension").values).max()))


def _stressed(result: xr.Dataset, case: Case) -> xr.Dataset:
    return stresses_of(case, result)


_ONCE = {"whole": True, "through": _stressed}


@_measure(*MOVED, units="Pa", doc="largest von Mises stress of a panel", **_ONCE)
def _von_mises(found: xr.Dataset, case: Case, panel: int | None = None) -> float:
    if "von_mises" not in found:
        raise InputError("needs panels with stresses, which this model has none of")
    there = slice(None) if panel is None else found["point_panel"].values == panel
    return float(found["von_mises"].isel(point=there).max())


@_measure(*MOVED, units="N", doc="largest moment of a crease per length", **_ONCE)
def _crease_moment(found: xr.Dataset, case: Case, crease: int | None = None) -> float:
    there = slice(None) if crease is None else [crease]
    return float(np.abs(found["crease_moment"].isel(crease=there).values).max(initial=0.0))


@_measure(*MOVED, doc="least margin of safety of a panel", **_ONCE)
def _margin(found: xr.Dataset, case: Case) -> float:
    return float(margins(found).attrs["least_margin"])


@_measure(MODES, *MOVED, units="m", doc="least distance of panels that share no vertex", whole=True)
def _clearance(result: xr.Dataset, case: Case) -> float:
    return min(one.distance for one in closest_panels(result, case))


def closest_panels(result: xr.Dataset, case: Case) -> list[Clearance]:
    """Smallest distance of panels and its place in each sample; for modes, once, at rest."""
    made, shapes = case.structure, np.zeros((1, 1, 3))
    if "time" in result.dims or "step" in result.dims:
        shapes = sampled(result, "displacement").transpose(..., "node", "axis").values
    return [clearance(made.nodes + u, made.triangles, made.triangle_panel) for u in shapes]


# --------------------------------------------------------------------------- paths
@_measure(PATH, units="N", doc="sum of the reactions at the end", whole=True)
def _reaction(result: xr.Dataset, case: Case, axis: str) -> float:
    chosen = (result["support_axis"] == axis).values
    return float(sampled(result, "reaction").values[-1, chosen].sum())


@_measure(PATH, doc="largest load factor")
def _largest_load(result: xr.Dataset, case: Case) -> float:
    return float(result["load_factor"].values.max())


def intervals(result: xr.Dataset, kind: str) -> NDArray:
    """Load factors (k, 2) between which critical points lie; equal if a point was located."""
    counts, factor = result["negative_eigenvalues"].values, result["load_factor"].values
    changes = np.flatnonzero((np.diff(counts) != 0) & (np.minimum(counts[1:], counts[:-1]) >= 0))
    if len(changes) and (result.attrs["method"] == "newton" or not result.attrs["locate"]):
        low, high = factor[changes[0] : changes[0] + 2]
        raise InputError(
            f"the stability changes between the load factors {low:.6g} and {high:.6g}, but the "
            'path has not located the point: trace it by "displacement" or "arc_length", and '
            "with locate = True"
        )
    ends = np.column_stack([factor, factor])
    if "interval" in result:
        ends = result["interval"].transpose("step", "end").values
    return ends[result["point"].values == kind]


def _first(result: xr.Dataset, kind: str) -> NDArray:
    return np.concatenate([intervals(result, kind), np.full((1, 2), np.nan)])[0]


def _load_of(result: xr.Dataset, kind: str) -> float:
    low, high = _first(result, kind)
    if high - low > NEAR * abs(high):
        warn(
            f"the first {kind} point lies between the load factors {low:.6g} and {high:.6g}, and "
            "no equilibrium was found nearer to it: the middle stands for it; smaller steps may "
            "find one",
            "sweeps.md#measures",
        )
    return float(0.5 * (low + high))


@_measure(PATH, doc="load factor of a limit point", dims=("limit",))
def _limit_loads(result: xr.Dataset, case: Case) -> NDArray:
    return intervals(result, "limit").mean(axis=1)


@_measure(PATH, doc="load factor of the first limit point")
def _limit_load(result: xr.Dataset, case: Case) -> float:
    return _load_of(result, "limit")


@_measure(PATH, doc="load factors between which the first limit point lies", dims=("end",))
def _limit_interval(result: xr.Dataset, case: Case) -> NDArray:
    return _first(result, "limit")


@_measure(PATH, doc="load factor where a node has moved so far (m)")
def _load_at(result: xr.Dataset, case: Case, node: int, axis: str, displacement: float) -> float:
    return load_at(result, 3 * node + AXES.index(axis), displacement, case).factor


@_measure(PATH, doc="load factor of the first bifurcation")
def _bifurcation_load(result: xr.Dataset, case: Case) -> float:
    return _load_of(result, "bifurcation")


@_measure(PATH, doc="load factor of the first loss of stability (nan: none)")
def _first_loss_of_stability(result: xr.Dataset, case: Case) -> float:
    """Load factor of the first limit point or bifurcation along the path."""
    critical = [kind for kind in result["point"].values if kind in ("limit", "bifurcation")]
    return _load_of(result, critical[0] if critical else "limit")


@_measure(PATH, doc="load factors between which the first bifurcation lies", dims=("end",))
def _bifurcation_interval(result: xr.Dataset, case: Case) -> NDArray:
    return _first(result, "bifurcation")


@_measure(PATH, units="N/m", doc="stiffness over the first step", through=landscape)
def _stiffness(found: Landscape, case: Case) -> float:
    return _secant(found, slice(0, 2))


@_measure(PATH, units="N/m", doc="stiffness over the last step", through=landscape, whole=True)
def _final_stiffness(found: Landscape, case: Case) -> float:
    return _secant(found, slice(-2, None))


@_measure(PATH, units="N", doc="first maximum of the driving force", through=landscape)
def _first_maximum(found: Landscape, case: Case) -> float:
    return found.first_maximum


def _secant(found: Landscape, part: slice) -> float:
    return float(np.diff(found.force[part])[0] / np.diff(found.stroke[part])[0])


@_measure(PATH, doc="stable states without force", through=landscape)
def _stable_states(found: Landscape, case: Case) -> int:
    return len(found.stable)


@_measure(PATH, units="m", doc="stroke of a stable state", dims=("state",), through=landscape)
def _state_strokes(found: Landscape, case: Case) -> NDArray:
    return np.array([state.stroke for state in found.stable])


@_measure(PATH, units="J", doc="energy of a stable state", dims=("state",), through=landscape)
def _state_energies(found: Landscape, case: Case) -> NDArray:
    return np.array([state.energy for state in found.stable])


@_measure(PATH, units="J", doc="energy from the first stable state to the next", through=landscape)
def _barrier(found: Landscape, case: Case) -> float:
    return found.barrier(0, 1) if len(found.stable) > 1 else np.nan


@_measure(
    PATH, units="J", doc="energy from the second stable state to the first", through=landscape
)
def _barrier_back(found: Landscape, case: Case) -> float:
    return found.barrier(1, 0) if len(found.stable) > 1 else np.nan


# ------------------------------------------------------------- comparison with the shell
@_measure(FIDELITY, doc="error of a frequency against the shell", dims=(MODE,))
def _frequency_errors(result: xr.Dataset, case: Case, model: str) -> NDArray:
    if model not in result["model"].values:
        raise InputError(f"there is no model {model}; choose {', '.join(result['model'].values)}")
    return result["error"].sel(model=model).values
