"""How alike a film and a model are: over time, in frequency, and in their axial vibration."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.signals import find_peaks, log_decrement, spectrum
from foldyn.studies.herkal.calibration import BAND
from foldyn.studies.herkal.metric import deviation

NEAR = (4.0, 14.0)  # Hz, where the axial vibration is sought
FINER = 8  # times by which the grid of frequencies is finer than the resolution


def content(x: NDArray[np.float64], step: float) -> tuple[NDArray, NDArray] | None:
    """Frequencies (Hz) up to the band's end and amplitudes; None where samples are missing."""
    if not np.isfinite(x).all():
        return None
    frequency, amplitude = spectrum(x, step, detrend="constant", pad=FINER)
    inside = frequency <= BAND[1]
    return frequency[inside], amplitude[inside]


@dataclass(frozen=True)
class Vibration:
    """Axial vibration of a record; nan where there is none.

    Attributes
    ----------
    peak : float
        Frequency (Hz) of the highest peak of the amplitude spectrum.
    frequency, damping_ratio : float
        From the maxima over time, by the logarithmic decrement (Hz).
    """

    peak: float = math.nan
    frequency: float = math.nan
    damping_ratio: float = math.nan


def vibration_of(x: NDArray[np.float64], step: float) -> Vibration:
    """Axial vibration of a record of which nothing is missing."""
    found = content(x, step)
    if found is None:
        return Vibration()
    peaks = find_peaks(*found)
    near = (peaks.frequency > NEAR[0]) & (peaks.frequency < NEAR[1])
    if not near.any():
        return Vibration()
    peak = float(peaks.frequency[near][np.argmax(peaks.height[near])])
    try:
        maxima = log_decrement(x, step, rest=0.0, frequency=peak)
    except InputError:  # fewer than two
        return Vibration(peak)
    return Vibration(peak, maxima.damped_frequency, maxima.damping_ratio)


def misfit(film: NDArray[np.float64], model: NDArray[np.float64]) -> float:
    """Root mean square of the difference over that of what was measured, where it was."""
    known = np.isfinite(film)
    return float(np.linalg.norm((model - film)[known]) / np.linalg.norm(film[known]))


def content_misfit(film: NDArray[np.float64], model: NDArray[np.float64], step: float) -> float:
    """The paper's metric; nan where the node was lost for long."""
    measured, said = content(film, step), content(model, step)
    if measured is None or said is None:
        return math.nan
    return float(deviation(said[1][:, None], measured[1][:, None])[0])
