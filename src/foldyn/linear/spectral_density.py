"""Power spectral densities of random loads, as tables with a unit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.arguments import Check, Checked
from foldyn.cases import Table
from foldyn.errors import InputError
from foldyn.ram_limit import check_memory
from foldyn.values import choice, increasing, number, numbers, whole

PER_PERIOD = 20  # numbers of a history per period of the highest frequency
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

    missing = dict.fromkeys(
        ("frequency", "value", "unit"), "give frequency (Hz), value, and their unit"
    )

    def agree(self) -> None:
        """Check the table."""
        frequency = increasing("frequency", self.frequency, above=0.0, unit="Hz")
        if len(frequency) < 2:
            raise InputError(": give at least two frequencies (Hz)", "frequency")
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
        return np.where((f >= known[0]) & (f <= known[-1]), UNITS[self.unit][1] * between, 0.0)

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

    def history(self, duration: float, *, seed: int = 0) -> Table:
        """A normal process with this density, as the history of a load or of a base motion.

        Of accelerations it is the displacement (m) of a `BaseMotion`, from 0 at the start; of
        forces, their factor (N). It repeats after the duration; at its start the velocity of a base
        jumps, and motions take some time to forget this.

        Parameters
        ----------
        duration : float
            Time (s), at least one period of the lowest frequency.
        seed : int
            Seed of the random numbers; equal seeds give equal histories.

        Raises
        ------
        InputError
            A duration that is too short, or longer than memory holds.

        Examples
        --------
        >>> import foldyn as fd
        >>> noise = fd.SpectralDensity([5.0, 50.0], [0.01, 0.01], "g2/Hz")
        >>> base = fd.BaseMotion("z", history=noise.history(10.0, seed=1))
        """
        duration = number("duration", duration, least=1.0 / self.frequency[0], unit="s")
        seed = whole("seed", seed, least=0)
        count = int(np.ceil(PER_PERIOD * self.frequency[-1] * duration))
        check_memory("duration", f"{count:.3g} numbers", 80.0 * count, "take a shorter one")
        f = np.fft.rfftfreq(count, duration / count)
        normal = np.random.default_rng(seed).standard_normal((2, len(f)))
        line = 0.5 * count * np.sqrt(self.at(f) / duration) * (normal[0] + 1j * normal[1])
        shaken = self.measures == "acceleration"
        if shaken:
            line /= -((2.0 * np.pi * np.maximum(f, 0.5 / duration)) ** 2)
        value = np.fft.irfft(line, count)
        value = np.append(value, value[0])
        start = value[0] if shaken else 0.0
        return Table(np.linspace(0.0, duration, count + 1), value - start, smooth=shaken)
