"""From measurements of the specimen to its parameters, and back to predictions of the model."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
import xarray as xr
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize_scalar

from foldyn.analyses import read_case
from foldyn.analyses.keys import replaced
from foldyn.analyses.reading import case_of_document, read_document
from foldyn.errors import InputError
from foldyn.experiment import Fit, ForceDisplacement, Measurement, Shapes, TimeHistory
from foldyn.linear import Peak, peaks_of
from foldyn.signals import log_decrement, spectrum
from foldyn.studies.herkal import calibration
from foldyn.studies.herkal.calibration import BAND, FRONT, FULL, SUPPORTS, WATCHED
from foldyn.studies.herkal.metric import deviation, strongest_peak
from foldyn.studies.herkal.specimen.prepared import FreeVibration, prepare
from foldyn.writing import write_text

FILM_SUPPORT = "glued"
PROMINENCE = 0.05  # smallest prominence of a peak, relative to the highest amplitude
NEAR = (4.0, 14.0)  # Hz: band of the axial vibration
FINER = 8  # points of the frequency grid per interval of resolution
UNLIKE = 0.2  # largest misfit of nodes to a state of the model, relative to their displacement
CORNER = 0  # top node at a corner, of which the response is shown
HIGHEST = 22.0  # Hz: upper limit of reported peaks
SAME = 1e-4  # m: largest difference of rest positions
FACTORS = np.linspace(0.0, 1.1, 34)  # load factors that are searched for measured shapes


def load_factor(path: xr.Dataset, nodes: Sequence[int], moved: NDArray[np.float64]) -> float:
    """Load factor on a path at which nodes have moved along x as measured.

    Parameters
    ----------
    path : xarray.Dataset
        Result of `foldyn.studies.herkal.calibration.pressed`.
    nodes : sequence of int
    moved : ndarray, shape (m,)
        Displacement along x (m); NaN for nodes that were not seen.

    Raises
    ------
    InputError
        No node was seen, or their displacements match no state of the path.
    """
    known = np.isfinite(moved)
    if not known.any():
        raise InputError("no front node was measured; the displacement of the top is unknown")
    shape = _along(path, [node for node, seen in zip(nodes, known, strict=True) if seen])

    def misfit(factor: float) -> float:
        return float(np.sqrt(np.mean((shape(factor)[:, 0] - moved[known]) ** 2)))

    factors = path["load_factor"].values
    near = int(np.argmin([misfit(f) for f in factors]))
    span = factors[max(0, near - 1)], factors[min(len(factors) - 1, near + 1)]
    found = minimize_scalar(misfit, bounds=span, method="bounded", options={"xatol": 1e-9})
    size = float(np.sqrt(np.mean(moved[known] ** 2)))
    beyond = found.x > 0.999 * factors[-1]
    if beyond or found.fun > UNLIKE * size:
        mean = float(np.mean(moved[known]))
        why = (
            "they move upwards: turn the sign of x, which points down"
            if mean < 0.0
            else f"more than the {1e3 * FULL * factors[-1]:.3g} mm of the top that are tried; is "
            "the unit or the scale right?"
            if beyond
            else "they move unlike the model pressed from above"
        )
        raise InputError(
            f"front nodes have moved by {1e3 * mean:.3g} mm along x on average, which is "
            f"{found.fun / size:.0%} off the nearest state of the model: {why}"
        )
    return float(found.x)


def _along(path: xr.Dataset, nodes: Sequence[int]) -> CubicSpline:
    """Displacements of nodes, shape (m, 3), interpolated at a load factor."""
    moved = path["displacement"].sel(node=list(nodes)).transpose("step", "node", "axis").values
    return CubicSpline(path["load_factor"].values, moved)


def static_test(
    photos: xr.Dataset, label: str, changes: Mapping[str, Any] | None = None
) -> list[Measurement]:
    """Forces at displacements of the top, and shapes of the front, from tracked photographs.

    The straight edge of the top shows no corners once it is loaded, so its displacement is taken
    from the model's state that best fits the corners below. The specimen is not glued, so sliding
    along y is ignored.

    Parameters
    ----------
    photos : xarray.Dataset
        Result of `foldyn.experiment.track_photos`, with the coordinate `load` (N).
    label : str
        Label of the data.
    changes : mapping, optional
        Changed values of the model whose states are compared, by key.

    Raises
    ------
    InputError
        There are no loads, or displacements match no state of the model.
    """
    check_tracks(photos)
    loads = photos["load"].values if "load" in photos.coords else np.zeros(photos.sizes["photo"])
    if not (loads > 0.0).any():
        raise InputError("no photograph has a load above 0 N: track them with --loads")
    numbers = np.flatnonzero(loads > 0.0)
    loaded = photos.isel(photo=numbers)
    moved = loaded["displacement"].sel(node=list(FRONT), axis=["x", "y"]).values.copy()
    path = calibration.pressed(FACTORS, changes)
    shape, factors = _along(path, FRONT), []
    for number, one in zip(numbers, moved, strict=True):
        try:
            factors.append(load_factor(path, FRONT, one[:, 0]))
        except InputError as error:
            raise InputError(f"photograph {number}: {error}") from None
        one[:, 1] -= np.nanmean(one[:, 1] - shape(factors[-1])[:, 1])
    rms = np.asarray(photos.attrs["match_rms_px"]) * float(photos.attrs["metres_per_pixel"])
    seen = np.isfinite(moved).any(axis=(0, 2))
    return [
        ForceDisplacement(
            nodes=calibration.TOP, displacement=FULL * np.array(factors),
            force=loaded["load"].values, sigma=calibration.FORCE_ERROR, name="weights", label=label,
        ),
        Shapes(
            nodes=np.array(FRONT)[seen].tolist(), load_factor=factors, axes="xy",
            values=moved[:, seen],
            sigma=float(np.sqrt(np.mean(rms**2) / 2.0)), name="front corners", label=label,
        ),
    ]  # fmt: skip


def check_tracks(tracks: xr.Dataset) -> None:
    """Refuse tracks that do not show the specimen from the front.

    Raises
    ------
    InputError
        The tracks have no model, show another sheet, or lack displacements along x.
    """
    rest = calibration.shipped("specimen").pattern.vertices[list(FRONT)]
    if "displacement" not in tracks:
        raise InputError("tracked without a model: foldyn track needs --model herkal/specimen")
    known = set(FRONT) <= set(tracks["node"].values.tolist())
    theirs = tracks["rest_position"].sel(node=list(FRONT)).values if known else rest + np.inf
    if np.abs(theirs - rest).max() > SAME:
        raise InputError("tracked with another model: foldyn track needs --model herkal/specimen")
    if (
        "x" not in tracks["axis"].values
        or not np.isfinite(tracks["displacement"].sel(node=list(FRONT), axis="x").values).any()
    ):
        raise InputError("no front node was measured along x: film its front (--up=-x --facing z)")


@dataclass(frozen=True, eq=False)
class Released:
    """A filmed release, and the damping fitted to it.

    Attributes
    ----------
    free : FreeVibration
    press : float
        Displacement of the top before the release (m).
    cases : mapping of str to Path
        Case files of the model with each support.
    fits : mapping of str to Fit
        Damping fitted with some of the supports.
    """

    free: FreeVibration
    press: float
    cases: Mapping[str, Path]
    fits: Mapping[str, Fit]


def fit_release(
    measured: TimeHistory,
    models: Path,
    changes: Mapping[str, Any],
    step: float = calibration.STEP,
    **options: Any,
) -> Released:
    """Fit the damping to node 8 only: with node 59 glued to the plate, and without glue.

    Parameters
    ----------
    measured : TimeHistory
        Histories of the tracked nodes along x, beginning before the release.
    models : Path
        Folder that receives the case files of the models, a subfolder for each support.
    changes : mapping
        Values of the case that the static test has changed, by key.
    step : float
        Time step of the simulations (s).
    **options
        Arguments of `foldyn.fit`.
    """
    free = prepare(measured)
    press = press_of(free, changes)
    duration = float(free.history.time[-1]) + 2.0 * free.history.align
    cases = {}
    for support in SUPPORTS:
        place = models / support.replace(" ", "-")
        cases[support] = calibration.released_case(place, changes, step, press, support, duration)
    others = [node for node in free.nodes if node in FRONT and node != WATCHED]
    film = [free.of([WATCHED], "node 8")]
    if others:
        film.append(replace(free.of(others, "other front nodes"), held_out=True))
    whole = [found for one in film if (found := free.whole_of(one)) is not None]
    data = [*film, *calibration.spectra_of(whole)]
    fits = {s: calibration.fit_damping(cases[s], data, **options) for s in (FILM_SUPPORT, "plate")}
    return Released(free, press, cases, fits)


def press_of(free: FreeVibration, changes: Mapping[str, Any] | None = None) -> float:
    """Displacement of the top (m) before a release, from the front nodes.

    Raises
    ------
    InputError
        Displacements of the front nodes match no state of the model.
    """
    front = np.where(np.isin(free.nodes, FRONT), free.before, np.nan)
    return FULL * load_factor(calibration.pressed(FACTORS, changes), free.nodes, front)


def motions(released: Released) -> dict[str, xr.Dataset]:
    """Motions of the model with every support; without a fit, the film's support gives damping.

    Returns
    -------
    dict of str to xarray.Dataset
        Motions of `foldyn.simulate`.
    """
    found = {}
    for support, case in released.cases.items():
        damping = released.fits.get(support, released.fits[FILM_SUPPORT]).values
        document = replaced(read_document(case), damping)
        write_text(tomli_w.dumps(document), case.with_name("fitted.toml"))
        found[support] = case_of_document(case, document).run()
    return found


def compared(
    released: Released, motions: Mapping[str, xr.Dataset], truth: xr.Dataset | None = None
) -> xr.Dataset:
    """Front nodes of the film and of the models at the same times, detrended.

    Parameters
    ----------
    released : Released
    motions : mapping of str to xarray.Dataset
        Motions by the names of supports.
    truth : xarray.Dataset, optional
        True positions of a synthetic film at the times of its frames.

    Returns
    -------
    xarray.Dataset
        Displacements in m: `measured` (time, node), NaN while a node was lost; `whole` (time,
        node), with short gaps filled, and NaN throughout for nodes with longer gaps; `model`
        (support, time, node); and `true` (time, node) if the truth is known.
    """
    front = [node for node in released.free.nodes if node in FRONT]
    one = released.free.of(front, "front nodes")
    curves = []
    for support, motion in motions.items():
        curve = one.modelled(motion, read_case(released.cases[support]).case())
        curves.append(curve - one.trend(curve))
    places = [released.free.nodes.index(node) for node in front]
    whole, line = released.free.whole[:, places], one.trend(one.values)
    found = xr.Dataset(
        {
            "whole": (("time", "node"), whole - line, {"units": "m"}),
            "measured": (("time", "node"), one.values - line, {"units": "m"}),
            "model": (("support", "time", "node"), np.array(curves), {"units": "m"}),
        },
        {"time": ("time", one.time, {"units": "s"}), "node": front, "support": list(motions)},
    )
    if truth is None:
        return found
    moved = truth["position"].sel(node=front, axis="x")
    true = CubicSpline(moved["time"], moved)(one.time + released.free.released)
    return found.assign(true=(("time", "node"), true - one.trend(true), {"units": "m"}))


def content(x: NDArray[np.float64], step: float) -> tuple[NDArray, NDArray] | None:
    """Frequencies (Hz) up to the band's end and amplitudes; None if samples are missing."""
    if not np.isfinite(x).all():
        return None
    frequency, amplitude = spectrum(x, step, detrend="constant", pad=FINER)
    inside = frequency <= BAND[1]
    return frequency[inside], amplitude[inside]


@dataclass(frozen=True)
class Vibration:
    """Axial vibration of a record; nan if the record does not vibrate.

    Attributes
    ----------
    peak : float
        Frequency (Hz) of the highest peak of the amplitude spectrum.
    frequency, damping_ratio : float
        Frequency (Hz) and damping ratio from the maxima over time, by the logarithmic decrement.
    """

    peak: float = math.nan
    frequency: float = math.nan
    damping_ratio: float = math.nan


def vibration_of(x: NDArray[np.float64], step: float) -> Vibration:
    """Axial vibration of a record without gaps."""
    found = content(x, step)
    if found is None:
        return Vibration()
    peak = strongest_peak(*found, NEAR, PROMINENCE)
    if math.isnan(peak):
        return Vibration()
    try:
        maxima = log_decrement(x, step, rest=0.0, frequency=peak)
    except InputError:  # fewer than two maxima
        return Vibration(peak)
    return Vibration(peak, maxima.damped_frequency, maxima.damping_ratio)


def misfit(film: NDArray[np.float64], model: NDArray[np.float64]) -> float:
    """Root mean square of the difference, divided by that of the measured samples."""
    known = np.isfinite(film)
    return float(np.linalg.norm((model - film)[known]) / np.linalg.norm(film[known]))


def content_misfit(film: NDArray[np.float64], model: NDArray[np.float64], step: float) -> float:
    """The paper's metric; nan if the node was lost for long."""
    measured, said = content(film, step), content(model, step)
    if measured is None or said is None:
        return math.nan
    return float(deviation(said[1][:, None], measured[1][:, None])[0])


def corner_peaks(response: xr.Dataset) -> list[Peak]:
    """Peaks of a result of `foldyn.frf` at a corner of the top, along the axis."""
    every = peaks_of(response, CORNER, axis="x", prominence=0.02)
    return [one for one in every if one.frequency < HIGHEST]
