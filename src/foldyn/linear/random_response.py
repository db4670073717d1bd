"""`random_response`: root mean squares of a case under random forces or a random base motion.

The response to independent random drives with the densities S has the mean squares

    sum over drives of int |H(f)|^2 S(f) df .

With H a sum of a few motions times amplitudes a(f), the integrals of a a* S give the mean squares
at all nodes. They are computed by Gauss quadrature on intervals that are no longer than twice their
distance from any pole: close to a resonance they shrink with its width, so that narrow peaks need
no fine grid, and the error does not depend on the damping.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray
from numpy.typing import ArrayLike, NDArray

from foldyn.algebra.eigen import Pencil
from foldyn.cases import BaseMotion, Case, Force, State
from foldyn.cases.directions import AXES
from foldyn.errors import InputError, ModelRangeWarning, warn
from foldyn.linear.excitation import Drive, drive_of
from foldyn.linear.frequency_domain import ModalResponse, SuperposedModes
from foldyn.linear.linearized import Linearized, linearize, warn_beyond
from foldyn.linear.spectral_density import SpectralDensity
from foldyn.linear.stresses import small_motions
from foldyn.ram_limit import check_memory
from foldyn.results import random_dataset
from foldyn.strength.dataset import MISES, face_stresses, point_coordinates
from foldyn.strength.resultants import (
    Resultants,
    SuperelementResultants,
    check_stresses,
    for_stresses,
    has_stresses,
    resultants_of,
    without_rigid,
)
from foldyn.values import flag, number, numbers, of_kind, show, whole

TURN = 2.0 * np.pi
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(12)
UNDAMPED = 1e-9  # damping ratios below this count as none
HALVINGS = 60
AT_ONCE = 2048  # frequencies whose amplitudes are in memory
FEWEST, BEYOND = 10, 1.5  # least number of modes; their highest frequency over that of densities
LEFT_OUT = 0.05  # share of the mass in modes above the spectra, of which a warning tells


class Moments(NamedTuple):
    """Mean squares of a response: its displacement and its first three derivatives, (n, 3)."""

    displacement: NDArray
    velocity: NDArray
    acceleration: NDArray
    jerk: NDArray


def random_response(
    case: Case,
    *,
    base: Mapping[str, SpectralDensity] | None = None,
    forces: Sequence[tuple[Force | Sequence[Force], SpectralDensity]] = (),
    state: State | str | None = None,
    count: int | None = None,
    load_factor: float = 1.0,
    frequencies: ArrayLike | None = None,
    stresses: bool = False,
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
        independent of each other and of the base.
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

    Returns
    -------
    xarray.Dataset
        Over node and axis: `displacement_rms` (m), relative to the base, `acceleration_rms` (m/s2),
        absolute, and the mean numbers of zero crossings per second with rising values,
        `displacement_crossings` and `acceleration_crossings` (Hz; 0 where nothing moves). With
        `frequencies`, over frequency, node and axis: `displacement_psd` (m2/Hz) and
        `acceleration_psd` (m2/s3), one-sided. With `stresses`, root mean squares of
        `membrane_force`, `bending_moment`, `von_mises` and `crease_moment`, named `..._rms`.
        `displacement` of the state. Largest values of a normal process are three times the root
        mean square in 99.7 % of time.

    Raises
    ------
    InputError
        No drive; a density of another kind than its drive; a mode without damping in the range of
        the densities; an argument out of range, as in `frf`.

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
    at = None if frequencies is None else _increasing("frequencies", frequencies)
    drives = _drives(of_kind("case", case, Case), base, forces)
    own, model = case, None
    if flag("stresses", stresses):
        check_stresses(case, "stresses")
        own = for_stresses(case)
        model = resultants_of(own) if has_stresses(own.structure) else None
    system = linearize(own, state, load_factor=load_factor)
    total = np.zeros((4, *case.structure.nodes.shape))
    top = max(max(density.frequency) for _, density in drives)
    pencil = Pencil(system.stiffness, system.mass)
    needed = min(pencil.finite, pencil.below((TURN * top) ** 2))
    if count is None:
        count = min(pencil.finite, max(FEWEST, pencil.below((TURN * BEYOND * top) ** 2)))
    shape = 2, 0 if at is None else len(at), *case.structure.nodes.shape
    check_memory("frequencies", f"densities at {shape[1]} frequencies", 16.0 * np.prod(shape),
                 "take fewer")  # fmt: skip
    curves = np.zeros(shape)
    modes = SuperposedModes(system, pencil, count)
    squares: dict[str, NDArray] = {}
    for drive, density in drives:
        response = ModalResponse(modes, drive)
        total += np.stack(_moments(system, drive, response, density))
        if stresses:
            for name, added in _stresses(system, model, drive, response, density, state).items():
                squares[name] = squares.get(name, 0.0) + added
        if at is not None:
            curves += _densities(system, drive, response, density, at)
        if drive.axis is not None:
            _warn_of_mass(system, response, drive, density)
    if count < needed:
        warn(
            f"{count} modes are taken of the {needed} below {top:.4g} Hz, where a density ends: "
            "the others respond statically, without their resonances; give a higher count",
            "random-vibration.md#how-it-is-computed",
        )
    warn_beyond(case.structure, np.array([top]), linear=True)
    facts = {"modes": count, "wall_seconds": time.perf_counter() - began}
    rates = _rates(Moments._make(list(total)))
    more, points = {}, None
    if stresses:
        points = None if model is None else model.points
        more = {name: np.sqrt(square) for name, square in squares.items()}
    return random_dataset(
        case, system.displacement, *rates, facts, at, curves, more,
        {} if points is None else point_coordinates(points),
    )  # fmt: skip


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
        if axis not in (*AXES,):
            raise InputError(f': {show(axis)} is no axis; give "x", "y" or "z"', "base")
        out.append((_density(density, "acceleration", f"base[{axis!r}]"), BaseMotion(axis)))
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


def _moments(
    system: Linearized, drive: Drive, response: ModalResponse, density: SpectralDensity
) -> Moments:
    """Mean squares of the response to one drive."""
    frequency, weight = _quadrature(response, density)
    motions, squares = system.expanded(response.motions), np.zeros((4, system.displacement.size))
    if drive.axis is not None:
        whole = np.zeros_like(system.displacement)
        whole[:, AXES.index(drive.axis)] = 1.0
        motions = np.column_stack([motions, whole.ravel()])
    for first in range(0, len(frequency), AT_ONCE):
        part = slice(first, first + AT_ONCE)
        omega = TURN * frequency[part]
        power, amplitude = weight[part] * density.at(frequency[part]), response.amplitudes(omega)
        powers = power * omega ** (2 * np.arange(4)[:, None])
        if drive.axis is None:
            squares += _mean_squares(motions, amplitude * drive.value, powers)
            continue
        relative = np.pad(amplitude, ((0, 0), (0, 1)))
        absolute = np.pad(amplitude, ((0, 0), (0, 1)), constant_values=1.0)
        squares[:2] += _mean_squares(motions, relative, powers[:2] / omega**4)
        squares[2:] += _mean_squares(motions, absolute, powers[:2])
    return Moments(*squares.clip(0.0).reshape(4, -1, 3))


def _stresses(
    system: Linearized, model: Resultants | None, drive: Drive, response: ModalResponse,
    density: SpectralDensity, state: State | str | None,
) -> dict[str, NDArray]:  # fmt: skip
    """Mean squares of forces, moments and von Mises stresses of panels, and of creases' moments."""
    motions = system.whole(response.motions)
    panels, creases = small_motions(system.case, model, system.displacement, motions, state is None)
    if drive.axis is not None:  # and what panels add, per unit of the acceleration of the base
        creases = np.pad(creases, ((0, 1), (0, 0)))
        if panels is not None:
            carried = np.zeros((1, *panels.shape[1:]))
            if isinstance(model, SuperelementResultants):
                carried = model.accelerated(AXES.index(drive.axis)).reshape(carried.shape)
            panels = np.concatenate([panels, carried])
    rows = {"crease_moment": creases.T}
    if panels is not None and model is not None:
        points = model.points
        panels = without_rigid(system.case, points, panels)
        force, moment = np.moveaxis(panels, (2, 0), (0, -1))
        stress = np.moveaxis(face_stresses(panels, points.thickness), 0, -1)
        equivalent = np.einsum("ca,pfas->pfcs", np.linalg.cholesky(MISES).T, stress)
        rows |= {"membrane_force": force, "bending_moment": moment, "von_mises": equivalent}
    shapes = {name: own.shape[:-1] for name, own in rows.items()}
    flat = np.concatenate([own.reshape(-1, len(creases)) for own in rows.values()])
    frequency, weight = _quadrature(response, density)
    found = np.zeros(len(flat))
    for first in range(0, len(frequency), AT_ONCE):
        part = slice(first, first + AT_ONCE)
        omega = TURN * frequency[part]
        power = weight[part] * density.at(frequency[part])
        amplitude = response.amplitudes(omega)
        if drive.axis is None:
            power = power * drive.value**2
        else:
            amplitude = np.array(np.hstack([amplitude, -(omega[:, None] ** 2)]), np.complex128)
            power = power / omega**4
        found += _mean_squares(flat, amplitude, power[None])[0]
    ends = np.cumsum([math.prod(shape) for shape in shapes.values()])[:-1]
    parts = zip(shapes.items(), np.split(found.clip(0.0), ends), strict=True)
    out = {name: own.reshape(shape) for (name, shape), own in parts}
    if "von_mises" in out:
        out["von_mises"] = out["von_mises"].sum(axis=-1)
    return out


def _densities(
    system: Linearized, drive: Drive, response: ModalResponse, density: SpectralDensity, at: NDArray
) -> NDArray[np.float64]:
    """Densities (2, nf, n, 3) of displacement and absolute acceleration due to one drive."""
    amplitude, omega = response.amplitudes(TURN * at), TURN * at
    moved = (amplitude @ system.expanded(response.motions).T).reshape(len(at), -1, 3)
    accelerated = moved * (omega**2)[:, None, None]
    if drive.axis is None:
        moved, accelerated = moved * drive.value, accelerated * drive.value
    else:
        accelerated = moved.copy()
        accelerated[..., AXES.index(drive.axis)] += 1.0
        moved = moved / (omega**2)[:, None, None]
    return np.abs(np.stack([moved, accelerated])) ** 2 * density.at(at)[:, None, None]


def _mean_squares(
    motions: NDArray, amplitude: NDArray[np.complex128], powers: NDArray
) -> NDArray[np.float64]:
    """Mean squares (k, 3n) of motions (3n, r) with amplitudes (nf, r) and powers (k, nf)."""
    if len(motions) <= motions.shape[1]:  # what moves is less than what is superposed
        moved: NDArray[np.complex128] = amplitude @ motions.T
        return powers @ (moved.real**2 + moved.imag**2)
    found = []
    for power in powers:
        gram = sum(part.T @ (power[:, None] * part) for part in (amplitude.real, amplitude.imag))
        found.append(np.einsum("ia,ia->i", motions @ gram, motions))
    return np.array(found)


def _quadrature(response: ModalResponse, density: SpectralDensity) -> tuple[NDArray, NDArray]:
    """Frequencies and weights (nf,), Hz, that integrate a response between a density's points."""
    poles = _poles(response, density)
    ends = [(a, b) for a, b in zip(density.frequency[:-1], density.frequency[1:], strict=True)]
    first, last = (np.array(column) for column in zip(*ends, strict=True))
    kept: list[tuple[NDArray, NDArray]] = []
    for _ in range(HALVINGS):
        nearest = np.clip(poles.real[:, None], first, last)
        distance = np.hypot(poles.real[:, None] - nearest, poles.imag[:, None])
        distance = np.minimum(distance.min(axis=0, initial=np.inf), first)  # 0 Hz is a pole, too
        done = last - first <= 2.0 * distance
        kept.append((first[done], last[done]))
        middle = 0.5 * (first[~done] + last[~done])
        first, last = np.append(first[~done], middle), np.append(middle, last[~done])
    first, last = (np.concatenate(column) for column in zip(*kept, strict=True))
    half = 0.5 * (last - first)
    frequency = (first + half)[:, None] + half[:, None] * POINTS
    return frequency.ravel(), (half[:, None] * WEIGHTS).ravel()


def _poles(response: ModalResponse, density: SpectralDensity) -> NDArray[np.complex128]:
    """Poles (k,), Hz: natural frequencies, and half widths of their peaks as imaginary parts."""
    basis, modal = response.modes.basis, response.modes.basis.inertia > 0.0
    frequency = np.sqrt(basis.values[modal].clip(0.0)) / TURN
    width = response.modes.damping.diagonal()[modal] / (2.0 * TURN)
    low, high = density.frequency[0], density.frequency[-1]
    free = (width <= UNDAMPED * frequency) & (frequency >= low) & (frequency <= high)
    if free.any() and not response.remembers:
        k = int(free.argmax())
        raise InputError(
            f": the mode at {frequency[k]:.6g} Hz has no damping, so that its random response is "
            "unbounded: give some, as ModalDamping(0.01)",
            "damping",
        )
    return frequency + 1j * np.maximum(width, UNDAMPED * frequency)


def _warn_of_mass(
    system: Linearized, response: ModalResponse, drive: Drive, density: SpectralDensity
) -> None:
    """Warn if modes above the density's highest frequency have much of the mass along its axis."""
    axis, basis = AXES.index(drive.axis or "x"), response.modes.basis
    modal = basis.inertia > 0.0
    inertia = system.inertia[:, axis]
    effective = (basis.shapes[:, modal].T @ inertia) ** 2
    within = np.sqrt(basis.values[modal].clip(0.0)) / TURN <= density.frequency[-1]
    along = (system.free < system.displacement.size) & (system.free % 3 == axis)
    whole = inertia[along].sum()  # 0 if only edges and panels between held nodes move
    share = 1.0 - effective[within].sum() / whole if whole > 0.0 else 0.0
    if share > LEFT_OUT:
        warn(
            f"modes above {density.frequency[-1]:.4g} Hz, where the density along {drive.axis} "
            f"ends, have {share:.0%} of the moving mass: extend the density if it goes on there",
            "random-vibration.md#how-it-is-computed",
            ModelRangeWarning,
        )


def _increasing(name: str, given: ArrayLike) -> NDArray[np.float64]:
    """Frequencies (nf,), Hz, above 0 and increasing."""
    frequency = np.atleast_1d(numbers(name, given))
    if frequency.ndim != 1 or not len(frequency) or frequency[0] <= 0.0:
        raise InputError(": give a list of frequencies (Hz) above 0", name)
    if (np.diff(frequency) <= 0.0).any():
        raise InputError(": must increase; sort them and drop doubles", name)
    return frequency


def _rates(moments: Moments) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Root mean squares of displacement and acceleration (n, 3), and their zero crossings, Hz."""
    pairs = (moments.displacement, moments.velocity), (moments.acceleration, moments.jerk)
    out = [np.sqrt(square) for square, _ in pairs]
    for square, rate in pairs:
        ratio = np.divide(rate, square, out=np.zeros_like(rate), where=square > 0.0)
        out.append(np.sqrt(ratio) / TURN)
    return out[0], out[1], out[2], out[3]
