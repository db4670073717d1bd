"""`random_response`: root mean squares of a case under random forces or a random base motion.

The response to independent random drives with the densities S has the mean squares

    sum over drives of int |H(f)|^2 S(f) df .

H is a sum of a few motions times amplitudes. The integrals are computed by Gauss quadrature on
intervals that are no longer than twice their distance from any pole: close to a resonance they
shrink with its width, so that narrow peaks need no fine grid, and the error does not depend on the
damping (`mean_squares`).

Quantities and columns are those of `amounts`. Drives of one source act together, with the
amplitudes of a unit white noise.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import block_diag

from foldyn.algebra.eigen import Pencil
from foldyn.cases import BaseMotion, Case, Force, State
from foldyn.cases.directions import AXES
from foldyn.cases.releases import refuse_releases
from foldyn.errors import InputError, ModelRangeWarning, warn
from foldyn.linear.amounts import Amounts, Parts, covered_mass, squared_parts
from foldyn.linear.excitation import Drive, drive_of
from foldyn.linear.frequency_domain import ModalResponse, SuperposedModes
from foldyn.linear.linearized import Linearized, warn_beyond
from foldyn.linear.spectral_density import SpectralDensity
from foldyn.ram_limit import check_memory
from foldyn.results import random_dataset
from foldyn.values import choice, flag, increasing, number, numbers, of_kind, show, whole

FEWEST, BEYOND = 10, 1.5  # least number of modes; their highest frequency over that of densities
LEFT_OUT = 0.05  # share of the mass in modes above the spectra, of which a warning tells
FULL = 1e-9  # negative eigenvalues of a coherence, relative to 1, that are rounding
COPIES = 3  # densities and mean squares over frequency in memory, about
TURN = 2.0 * np.pi
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(12)
UNDAMPED = 1e-9  # damping ratios below this count as none
HALVINGS = 60
AT_ONCE = 2048  # frequencies whose amplitudes are in memory
ROOM = 4_000_000  # numbers of a quantity in memory, at so many frequencies as fit


def random_response(
    case: Case,
    *,
    base: Mapping[str, SpectralDensity] | None = None,
    forces: Sequence[tuple[Force | Sequence[Force], SpectralDensity]] = (),
    coherence: ArrayLike = 0.0,
    state: State | str | None = None,
    count: int | None = None,
    load_factor: float = 1.0,
    frequencies: ArrayLike | None = None,
    stresses: bool = False,
    reactions: bool = False,
) -> xarray.Dataset:
    """Root mean square response of a case to random vibration, linearized about a state.

    Parameters
    ----------
    case : Case
        Loads and imposed displacements of the case are preloads, as in `frf`.
    base : mapping of str to SpectralDensity, optional
        Accelerations of the base, of all nodes that `Fix` holds along an axis, by axis: "x", "y" or
        "z". Axes are independent of each other.
    forces : sequence of (Force or sequence of Force, SpectralDensity)
        Forces without histories, with the density of a factor: the force times a random number of
        unit density would be the force itself. Forces in one sequence are in phase; others are
        independent of the base.
    coherence : float or array_like
        Of the pairs of `forces`: the real part of the cross density of two of them over the root of
        the product of their densities, from -1 to 1; one number for all, or a symmetric matrix with
        ones on its diagonal. By default 0: they are independent of each other.
    state : State or "equilibrium", optional
        State to vibrate about, as in `frf`; by default the rest state.
    count : int, optional
        Number of modes, from the lowest on; by default those up to 1.5 times the highest frequency
        of a density. The other modes respond statically.
    load_factor : float
        As in `frf`.
    frequencies : array_like, optional
        Frequencies (Hz), increasing, at which the densities of the response are wanted.
    stresses : bool
        Whether to find stresses, too, at the points that `stresses` has, and moments of creases.
    reactions : bool
        Whether to find the forces of supports, too, and their sums.

    Returns
    -------
    xarray.Dataset
        Over node and axis: `displacement_rms` (m), relative to the base, `acceleration_rms` (m/s2),
        absolute, and the mean numbers of zero crossings per second with rising values,
        `displacement_crossings` and `acceleration_crossings` (Hz; 0 where nothing moves). With
        `frequencies`, over frequency, node and axis: `displacement_psd` (m2/Hz) and
        `acceleration_psd` (m2/s3), one-sided, and `displacement_cumulative` and
        `acceleration_cumulative`, the root mean squares of the part below each frequency.
        With `stresses` the same of `membrane_force`, `bending_moment`, `von_mises` (without
        crossings) and `crease_moment`; with `reactions` of `reaction` (support) and
        `total_reaction` (axis), N. `displacement` of the state. Largest values of a normal process
        are three times the root mean square in 99.7 % of time.

    Raises
    ------
    InputError
        No drive; a density of another kind than its drive; a mode without damping in the range of
        the densities; reactions of laws with memory; an argument out of range, as in `frf`.

    Warns
    -----
    FoldynWarning
        Modes below the highest frequency of a density are left out.
    ModelRangeWarning
        Modes above the highest frequency of a base's density have more than 5 % of the mass, or
        frequencies lie above the range of the model.

    Notes
    -----
    For one degree of freedom under a constant density S of base acceleration the mean square of the
    absolute acceleration is about pi f S / (4 zeta) (Miles, J. Aeronaut. Sci. 21, 1954). Densities
    are one-sided. All damping of the case counts, as in `frf` by the method "modal".

    Examples
    --------
    >>> import foldyn as fd
    >>> pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60)
    >>> s = fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.01, 1.0))
    >>> supports = [fd.Fix([4, 5], "xyz"), fd.Fix([0, 1], "z")]
    >>> case = fd.Case(s, supports, damping=fd.Rayleigh(alpha=0.5))
    >>> noise = fd.SpectralDensity([0.1, 100.0], [0.01, 0.01], "m2/s3")
    >>> found = fd.random_response(case, base={"x": noise})
    >>> found.acceleration_rms.sel(node=0, axis="x").round(2).item()
    13.95
    """
    began = time.perf_counter()
    count = None if count is None else whole("count", count, least=1, what="modes")
    load_factor = number("load_factor", load_factor)
    at = np.zeros(0)
    if frequencies is not None:
        at = increasing("frequencies", frequencies, above=0.0, unit="Hz")
    refuse_releases(of_kind("case", case, Case), "random vibration")
    drives = _drives(case, base, forces)
    together = _coherence(coherence, len(forces))
    parts = Parts(
        case, state, load_factor=load_factor, stresses=flag("stresses", stresses),
        reactions=flag("reactions", reactions),
    )  # fmt: skip
    system = parts.system
    top = max(max(density.frequency) for _, density in drives)
    pencil = Pencil(system.stiffness, system.mass)
    needed = min(pencil.finite, pencil.below((TURN * top) ** 2))
    if count is None:
        count = min(pencil.finite, max(FEWEST, pencil.below((TURN * BEYOND * top) ** 2)))
    modes = SuperposedModes(system, pencil, count)
    driven = [Driven(drive, ModalResponse(modes, drive), density) for drive, density in drives]
    amounts = [parts.amounts(one.drive, one.response) for one in driven]
    size = sum(own.rows.shape[1] for own in amounts[0].values())
    check_memory("frequencies", f"densities at {len(at)} frequencies",
                 8.0 * COPIES * len(at) * size, "take fewer")  # fmt: skip
    total: dict[str, Found] = {}
    for noise in block_diag(np.eye(len(driven) - len(together)), together).T:
        each = [(driven[k], float(noise[k]), amounts[k]) for k in np.flatnonzero(noise).tolist()]
        source = Source(*zip(*each, strict=True))
        for name, found in mean_squares(source, at).items():
            known = total.get(name)
            total[name] = found if known is None else Found(*map(np.add, known, found))
    for one in driven:
        if one.drive.axis is not None:
            _warn_of_mass(system, one)
    if count < needed:
        warn(
            f"{count} modes are taken of the {needed} below {top:.4g} Hz, where a density ends: "
            "the others respond statically, without their resonances; give a higher count",
            "random-vibration.md#how-it-is-computed",
        )
    warn_beyond(case.structure, np.array([top]), linear=True)
    return random_dataset(
        case, system.displacement, {name: _values(name, own) for name, own in total.items()},
        {"modes": count, "wall_seconds": time.perf_counter() - began}, at, parts.coordinates,
    )  # fmt: skip


def _values(name: str, found: Found) -> dict[str, NDArray]:
    """Root mean squares and the like of a quantity, flat."""
    found = Found(*(squared_parts(name, own) for own in found))
    ratio = np.divide(found.rate, found.square, out=np.zeros_like(found.rate),
                      where=found.square > 0.0)  # fmt: skip
    out = {"rms": np.sqrt(found.square), "crossings": np.sqrt(ratio) / TURN}
    if name == "von_mises":
        del out["crossings"]  # it has no sign
    if len(found.density):
        out |= {"psd": found.density, "cumulative": np.sqrt(found.below)}
    return out


def _drives(
    case: Case, base: Mapping[str, SpectralDensity] | None,
    forces: Sequence[tuple[Force | Sequence[Force], SpectralDensity]],
) -> list[tuple[Drive, SpectralDensity]]:  # fmt: skip
    """Drives of unit base displacement, or of the given forces, each with its density."""
    out = []
    if base is not None and not isinstance(base, Mapping):
        raise InputError(f' = {show(base)}: give densities by axis, as {{"z": density}}', "base")
    if not isinstance(forces, Sequence) or isinstance(forces, str | bytes):
        raise InputError(f" = {show(forces)}: give a list of pairs (force, density)", "forces")
    for axis, density in (base or {}).items():
        place = f"base[{choice('base', axis, AXES)!r}]"
        out.append((_density(density, "acceleration", place), BaseMotion(axis)))
    for k, pair in enumerate(forces):
        if not isinstance(pair, Sequence) or len(pair) != 2:
            raise InputError(
                f" = {show(pair)}: give pairs of a Force, or a list of them, and a density",
                f"forces[{k}]",
            )
        out.append((_density(pair[1], "force", f"forces[{k}]"), pair[0]))
    if not out:
        raise InputError(": give a base or forces, with their spectral densities", "base")
    return [(drive_of(case, drive, 1.0), density) for density, drive in out]


def _density(given: Any, measures: str, place: str) -> SpectralDensity:
    density = of_kind(place, given, SpectralDensity)
    if density.measures != measures:
        units = "g2/Hz or m2/s3" if measures == "acceleration" else "N2/Hz"
        raise InputError(f": its unit is {density.unit}; give {units}", place)
    return density


def _coherence(given: ArrayLike, count: int) -> NDArray[np.float64]:
    """Factors (n, k) of n forces on k independent white noises, from their coherence."""
    own = np.asarray(numbers("coherence", given), float)
    if own.ndim == 0:
        own = np.full((count, count), own)
        own[np.diag_indices(count)] = 1.0
    alike = own.shape == (count, count) and np.allclose(own, own.T)
    if not alike or not np.allclose(np.diag(own), 1.0) or (np.abs(own) > 1.0).any():
        raise InputError(
            f": give a number from -1 to 1, or a symmetric {count} x {count} matrix with ones on "
            "its diagonal",
            "coherence",
        )
    values, vectors = np.linalg.eigh(own)
    if values.min(initial=0.0) < -FULL:
        raise InputError(
            ": no forces have these coherences (the matrix has a negative eigenvalue, "
            f"{values[0]:.3g}); give smaller ones",
            "coherence",
        )
    kept = values > FULL
    return vectors[:, kept] * np.sqrt(values[kept])


def _warn_of_mass(system: Linearized, driven: Driven) -> None:
    """Warn if modes above the density's highest frequency have much of the mass along its axis."""
    axis, top = AXES.index(driven.drive.axis or "x"), driven.density.frequency[-1]
    share = 1.0 - covered_mass(driven.response.modes, system.inertia[:, axis], axis, top)
    if share > LEFT_OUT:
        warn(
            f"modes above {top:.4g} Hz, where the density along {driven.drive.axis} ends, have "
            f"{share:.0%} of the moving mass: extend the density if it goes on there",
            "random-vibration.md#how-it-is-computed",
            ModelRangeWarning,
        )


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
        return np.array(root[:, None] * np.column_stack([own, base, unit]), np.complex128)


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
