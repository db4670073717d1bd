"""Power spectral densities of random loads, as tables with a unit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.arguments import Check, Checked
from foldyn.errors import InputError
from foldyn.values import choice, numbers

STANDARD_GRAVITY = 9.80665  # m/s2, ISO 80000-3
UNITS = {"g2/Hz": ("acceleration", STANDARD_GRAVITY**2), "m2/s3": ("acceleration", 1.0),
         "N2/Hz": ("force", 1.0)}  # fmt: skip
"""What each unit measures, and its value in (m/s2)2/Hz or N2/Hz."""


def _column(name: str, value: Any) -> tuple[float, ...]:
    return tuple(np.atleast_1d(numbers(name, value)).tolist())


@dataclass(frozen=True)
class SpectralDensity(Checked):
    """One-sided power spectral density: straight lines between points of a log-log table.

    Parameters
    ----------
    frequency : sequence of float
        Frequencies (Hz) of the points, above 0 and increasing. The density is 0 outside.
    value : sequence of float
        Densities at these frequencies, above 0, in `unit`.
    unit : {"g2/Hz", "m2/s3", "N2/Hz"}
        Of accelerations in multiples of 9.80665 m/s2, of accelerations (m2/s3 is (m/s2)2/Hz), or of
        forces.

    Examples
    --------
    >>> import foldyn as fd
    >>> launch = fd.SpectralDensity([20.0, 80.0, 800.0, 2000.0], [0.01, 0.04, 0.04, 0.016], "g2/Hz")
    >>> print(f"{launch.rms:.2f} m/s2")
    75.72 m/s2
    """

    frequency: Annotated[Sequence[float], Check(_column)]
    value: Annotated[Sequence[float], Check(_column)]
    unit: Annotated[str, Check(choice, known=tuple(UNITS))]

    def agree(self) -> None:
        """Check the table."""
        frequency = np.array(self.frequency)
        if len(frequency) < 2 or frequency[0] <= 0.0 or (np.diff(frequency) <= 0.0).any():
            raise InputError(
                ": give at least two frequencies (Hz), above 0 and increasing", "frequency"
            )
        if len(self.value) != len(frequency) or min(self.value) <= 0.0:
            raise InputError(
                f": {len(self.value)} densities for {len(frequency)} frequencies: give one above 0 "
                "for each; leave out frequencies at which there is none",
                "value",
            )

    @property
    def measures(self) -> str:
        """Kind of quantity: "acceleration" or "force"."""
        return UNITS[self.unit][0]

    def at(self, frequency: ArrayLike) -> NDArray[np.float64]:
        """Densities at frequencies (Hz), in (m/s2)2/Hz or N2/Hz."""
        f, known = np.asarray(frequency, float), np.array(self.frequency)
        with np.errstate(divide="ignore"):
            between = np.exp(np.interp(np.log(f), np.log(known), np.log(self.value)))
        within = (f >= known[0]) & (f <= known[-1])
        return np.where(within, UNITS[self.unit][1] * between, 0.0)

    @property
    def rms(self) -> float:
        """Root mean square of the whole spectrum, m/s2 or N."""
        f, value = np.array(self.frequency), self.at(self.frequency)
        slope = np.diff(np.log(value)) / np.diff(np.log(f))
        ratio = f[1:] / f[:-1]
        flat = np.abs(slope + 1.0) < 1e-9
        power = np.where(flat, 0.0, slope + 1.0)
        area = np.where(flat, np.log(ratio), (ratio**power - 1.0) / np.where(flat, 1.0, power))
        return float(np.sqrt((value[:-1] * f[:-1] * area).sum()))
