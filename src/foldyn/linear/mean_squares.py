"""Mean squares, densities and zero crossings of what moves linearly with random drives.

Quantities and columns are those of `amounts`. Drives of one source act together, with the
amplitudes of a unit white noise.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.linear.amounts import Amounts
from foldyn.linear.excitation import Drive
from foldyn.linear.frequency_domain import ModalResponse
from foldyn.linear.spectral_density import SpectralDensity

TURN = 2.0 * np.pi
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(12)
UNDAMPED = 1e-9  # damping ratios below this count as none
HALVINGS = 60
AT_ONCE = 2048  # frequencies whose amplitudes are in memory
ROOM = 4_000_000  # numbers of a quantity in memory, at so many frequencies as fit


class Driven(NamedTuple):
    """The response to one drive, with the density of its factor or of the base's acceleration."""

    drive: Drive
    response: ModalResponse
    density: SpectralDensity

    def columns(self, omega: NDArray) -> NDArray[np.complex128]:
        """Amplitudes (nf, c) at frequencies (nf,), rad/s, times the root of the density."""
        own = self.response.amplitudes(omega)
        base, unit = np.zeros(len(omega)), np.ones(len(omega))
        if self.drive.axis is None:
            own = own * self.drive.value
        else:  # per unit of the acceleration of the base
            base = -1.0 / omega**2
            own = own * base[:, None]
        root = np.sqrt(self.density.at(omega / TURN))
        columns = root[:, None] * np.column_stack([own, base, unit])
        return np.array(columns, np.complex128)


class Source(NamedTuple):
    """Drives that act together, with their factors on a unit white noise."""

    drives: tuple[Driven, ...]
    factors: tuple[float, ...]
    amounts: tuple[dict[str, Amounts], ...]  # of each drive, by quantity

    def rows(self, name: str) -> NDArray[np.float64]:
        """Rows (k, n) of a quantity, for its `columns`."""
        return np.hstack([part for own in self.amounts for part in own[name].rows])

    def columns(self, omega: NDArray) -> list[NDArray[np.complex128]]:
        """Amplitudes (nf, c) of each drive."""
        each = zip(self.factors, self.drives, strict=True)
        return [factor * driven.columns(omega) for factor, driven in each]

    def parts(
        self, frequency: NDArray, at_once: int
    ) -> Iterator[tuple[slice, str, NDArray[np.complex128]]]:
        """Columns (k, n), with their powers, of each quantity at k of the frequencies (nf,), Hz.

        at_once : the largest k.
        """
        for first in range(0, len(frequency), at_once):
            part = slice(first, first + at_once)
            omega = TURN * frequency[part]
            columns = self.columns(omega)
            for name in self.amounts[0]:
                raised = [
                    ((1j * omega) ** power)[:, None] * own
                    for amounts, own in zip(self.amounts, columns, strict=True)
                    for power in amounts[name].powers
                ]
                yield part, name, np.hstack(raised)


class Found(NamedTuple):
    """Of a quantity with k parts: mean squares of it and its rate, and those over frequency."""

    square: NDArray  # (k,)
    rate: NDArray  # (k,) mean squares of the rate
    density: NDArray  # (nf, k) per Hz
    below: NDArray  # (nf, k) mean squares of the part below each frequency


def mean_squares(source: Source, at: NDArray) -> dict[str, Found]:
    """Mean squares of all quantities under one source, and densities at frequencies (nf,), Hz."""
    rows = {name: source.rows(name) for name in source.amounts[0]}
    sizes = {name: len(own) for name, own in rows.items()}
    totals = {name: np.zeros((2, size)) for name, size in sizes.items()}
    parts = {name: np.zeros((len(at) + 1, size)) for name, size in sizes.items()}
    at_once = AT_ONCE
    if len(at):  # all parts are found at each frequency
        at_once = int(np.clip(ROOM // max(sizes.values()), 16, AT_ONCE))
    frequency, weight = _quadrature(source, at)
    powers, slot = weight * (TURN * frequency) ** (2 * np.arange(2)[:, None]), at.searchsorted
    for part, name, raised in source.parts(frequency, at_once):
        if not len(at):
            totals[name] += _squares(rows[name], raised, powers[:, part])
            continue
        square, place = _moved(rows[name], raised), slot(frequency[part])
        totals[name] += powers[:, part] @ square
        first = np.flatnonzero(np.diff(place, prepend=-1))
        parts[name][place[first]] += np.add.reduceat(weight[part, None] * square, first)
    density = {name: np.zeros((len(at), size)) for name, size in sizes.items()}
    for part, name, raised in source.parts(at, at_once):
        density[name][part] = _moved(rows[name], raised)
    found = {}
    for name in rows:
        square, rate = totals[name].clip(0.0)
        found[name] = Found(square, rate, density[name], parts[name].cumsum(axis=0)[:-1])
    return found


def _moved(rows: NDArray, columns: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Squared magnitudes (nf, k) of what moves, rows (k, n) times columns (nf, n)."""
    moved: NDArray[np.complex128] = columns @ rows.T
    return moved.real**2 + moved.imag**2


def _squares(
    rows: NDArray, columns: NDArray[np.complex128], powers: NDArray
) -> NDArray[np.float64]:
    """Sums (q, k) over frequency of `_moved` with powers (q, nf)."""
    if len(rows) <= rows.shape[1]:  # what moves is less than what is superposed
        return powers @ _moved(rows, columns)
    found = []
    for power in powers:
        gram = sum(part.T @ (power[:, None] * part) for part in (columns.real, columns.imag))
        found.append(np.einsum("ia,ia->i", rows @ gram, rows))
    return np.array(found)


def _quadrature(source: Source, at: NDArray) -> tuple[NDArray, NDArray]:
    """Frequencies, increasing, and weights (nf,), Hz, that integrate a response.

    No interval reaches across `at`.
    """
    known = np.concatenate([driven.density.frequency for driven in source.drives])
    low, high = known.min(), known.max()
    ends = np.unique(np.concatenate([known, at[(at > low) & (at < high)]]))
    poles = _poles(source.drives[0].response, low, high)
    first, last = ends[:-1], ends[1:]
    kept: list[tuple[NDArray, NDArray]] = []
    for _ in range(HALVINGS):
        nearest = np.clip(poles.real[:, None], first, last)
        distance = np.hypot(poles.real[:, None] - nearest, poles.imag[:, None])
        distance = np.minimum(distance.min(axis=0, initial=np.inf), first)  # 0 Hz is a pole, too
        done = last - first <= 2.0 * distance
        kept.append((first[done], last[done]))
        middle = 0.5 * (first[~done] + last[~done])
        first, last = np.append(first[~done], middle), np.append(middle, last[~done])
    first, last = (np.sort(np.concatenate(column)) for column in zip(*kept, strict=True))
    half = 0.5 * (last - first)
    frequency = (first + half)[:, None] + half[:, None] * POINTS
    return frequency.ravel(), (half[:, None] * WEIGHTS).ravel()


def _poles(response: ModalResponse, low: float, high: float) -> NDArray[np.complex128]:
    """Poles (k,), Hz: natural frequencies, and half widths of their peaks as imaginary parts."""
    basis, modal = response.modes.basis, response.modes.basis.inertia > 0.0
    frequency = np.sqrt(basis.values[modal].clip(0.0)) / TURN
    width = response.modes.damping.diagonal()[modal] / (2.0 * TURN)
    free = (width <= UNDAMPED * frequency) & (frequency >= low) & (frequency <= high)
    if free.any() and not response.remembers:
        k = int(free.argmax())
        raise InputError(
            f": the mode at {frequency[k]:.6g} Hz has no damping, so that its random response is "
            "unbounded: give some, as ModalDamping(0.01)",
            "damping",
        )
    return frequency + 1j * np.maximum(width, UNDAMPED * frequency)
