"""Error of a model relative to the shell: the paper's metric, and frequencies of similar modes.

The metric of a node is the norm of the difference of the amplitude spectra up to a frequency,
divided by the norm of the shell's spectrum. The metric of a case is the mean over its reported
nodes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import xarray
from numpy.typing import ArrayLike, NDArray
from scipy.stats import spearmanr

from foldyn.errors import InputError
from foldyn.linear import mac, pair_modes
from foldyn.signals import find_peaks, sampling_interval, spectrum

UP_TO = 5.0  # Hz
LEAST_MAC = 0.5  # modes with a smaller MAC are no partners
FAR = 2.0  # largest ratio of the frequencies of partners


def content(
    motion: xarray.Dataset, nodes: Sequence[int], axis: str, up_to: float = UP_TO
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Frequency content of one displacement component of some nodes.

    Parameters
    ----------
    motion : xarray.Dataset
        With `displacement` (m) at evenly spaced times.
    nodes : sequence of int
    axis : {"x", "y", "z"}
    up_to : float
        Highest frequency (Hz) that is kept.

    Returns
    -------
    frequency : ndarray, shape (m,)
        Hz.
    amplitude : ndarray, shape (m, nodes)
        m.
    """
    record = motion["displacement"].sel(node=list(nodes), axis=axis).transpose("time", "node")
    return content_of(motion["time"].values, record.values, up_to)


def content_of(
    time: NDArray[np.float64], record: NDArray[np.float64], up_to: float = UP_TO
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Frequency content of a record (time, nodes) in m at evenly spaced times (s)."""
    frequency, amplitude = spectrum(record, sampling_interval(time))
    kept = frequency <= up_to * (1.0 + 1e-9)
    return frequency[kept], amplitude[kept]


def strongest_peak(
    frequency: NDArray[np.float64],
    amplitude: NDArray[np.float64],
    band: tuple[float, float],
    prominence: float,
) -> float:
    """Frequency (Hz) of the highest peak within a band; nan if none."""
    peaks = find_peaks(frequency, amplitude, prominence=prominence)
    inside = (peaks.frequency > band[0]) & (peaks.frequency < band[1])
    if not inside.any():
        return float("nan")
    return float(peaks.frequency[inside][np.argmax(peaks.height[inside])])


def deviation(amplitude: ArrayLike, reference: ArrayLike) -> NDArray[np.float64]:
    """Norm of the difference of two spectra divided by the norm of the second, for each node.

    Parameters
    ----------
    amplitude, reference : array_like, shape (m, nodes)
        Spectra at the same frequencies.

    Returns
    -------
    ndarray, shape (nodes,)

    Raises
    ------
    InputError
        The spectra have different shapes, or the reference does not move a node.
    """
    ours, theirs = np.asarray(amplitude, float), np.asarray(reference, float)
    if ours.shape != theirs.shape or ours.ndim != 2:
        raise InputError(
            f"amplitude: shape {ours.shape}, but the reference has shape {theirs.shape}: give "
            "spectra (frequencies, nodes) of motions of the same length and sampling interval"
        )
    size = np.linalg.norm(theirs, axis=0)
    if (size == 0.0).any():
        raise InputError(f"reference: node column {int(np.argmin(size))} is still; leave it out")
    return np.linalg.norm(ours - theirs, axis=0) / size


def errors(
    motion: xarray.Dataset,
    reference: xarray.Dataset,
    nodes: Sequence[int],
    axis: str,
    up_to: float = UP_TO,
) -> NDArray[np.float64]:
    """Deviation of the frequency content of a motion from that of a reference, for each node.

    The paper's metric is the mean of these deviations.
    """
    ours, theirs = (content(one, nodes, axis, up_to)[1] for one in (motion, reference))
    return deviation(ours, theirs)


def ranks(values: Mapping[str, float]) -> dict[str, int]:
    """Rank of each model by error, from 1 for the smallest; models without an error have none."""
    known = {name: value for name, value in values.items() if np.isfinite(value)}
    return {name: 1 + sum(v < value for v in known.values()) for name, value in known.items()}


def best(values: Mapping[str, float]) -> str:
    """Name of the model with the smallest error, or ""."""
    known = {name: value for name, value in values.items() if np.isfinite(value)}
    return min(known, key=known.__getitem__, default="")


def rank_correlation(a: Mapping[str, float], b: Mapping[str, float]) -> float:
    """Spearman's rank correlation of two sets of errors: 1 for equal, -1 for reverse order."""
    return float(spearmanr([*a.values()], [b[m] for m in a]).statistic)


@dataclass(frozen=True, eq=False)
class Partners:
    """Modes of the shell and their partners in a model; nan for modes without a partner.

    Attributes
    ----------
    reference, frequency : (k,)
        Hz.
    mac : (k,)
        MAC of their shapes at the pattern's vertices.
    """

    reference: NDArray
    frequency: NDArray
    mac: NDArray

    @property
    def deviation(self) -> NDArray:
        """Frequency divided by the shell's, minus one."""
        return self.frequency / self.reference - 1.0

    @property
    def mean_error(self) -> float:
        """Mean absolute deviation of the modes with a partner."""
        known = self.deviation[np.isfinite(self.deviation)]
        return float(np.abs(known).mean()) if len(known) else float("nan")


def partners(reference: xarray.Dataset, ours: xarray.Dataset) -> Partners:
    """Match modes of `ours` to modes of `reference`; both have shapes at the pattern's vertices."""
    vertices = reference["node"].values.tolist()
    theirs = reference["frequency"].values
    ratio = ours["frequency"].values / theirs[:, None]
    near = (ratio > 1.0 / FAR) & (ratio < FAR)  # a few vertices cannot distinguish short waves
    pairs = pair_modes(np.where(near, mac(reference, ours, nodes=vertices), 0.0), LEAST_MAC)
    frequency, likeness = (np.full(len(theirs), np.nan) for _ in range(2))
    frequency[pairs.first] = ours["frequency"].values[pairs.second]
    likeness[pairs.first] = pairs.mac
    return Partners(theirs, frequency, likeness)
