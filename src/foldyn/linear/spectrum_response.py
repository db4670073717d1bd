"""`spectrum_response`: largest responses to a shock of the base, from its response spectrum.

Mode k reaches its largest acceleration Gamma_k S(f_k), with the participation factor Gamma_k and
the spectrum S. The modes do so at different times; their largest responses r_k are combined as

    r^2 = sum over i, j of rho_ij r_i r_j ,

with rho = 0 for i != j (square root of the sum of squares), or by complete quadratic combination.
Modes above the spectrum, and what all modes leave of the mass, move with the base, with the last
acceleration of the spectrum.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray
from numpy.typing import ArrayLike, NDArray

from foldyn.algebra.eigen import Pencil
from foldyn.cases import BaseMotion, Case, State
from foldyn.cases.directions import AXES
from foldyn.errors import InputError, ModelRangeWarning, warn
from foldyn.linear.amounts import Amounts, Parts, covered_mass, squared_parts
from foldyn.linear.excitation import drive_of
from foldyn.linear.frequency_domain import ModalResponse, SuperposedModes
from foldyn.linear.linearized import Linearized, warn_beyond
from foldyn.results import random_dataset
from foldyn.signals import ShockSpectrum
from foldyn.values import choice, flag, increasing, number, numbers, of_kind, show, whole

TURN = 2.0 * np.pi
FEWEST = 10  # modes
COVERED = 0.9  # share of the mass in modes below which a warning tells
RULES = ("cqc", "srss")

Spectrum = ShockSpectrum | tuple[ArrayLike, ArrayLike]


def spectrum_response(
    case: Case,
    base: Mapping[str, Spectrum],
    *,
    combine: str = "cqc",
    count: int | None = None,
    state: State | str | None = None,
    load_factor: float = 1.0,
    stresses: bool = False,
    reactions: bool = False,
) -> xarray.Dataset:
    """Estimate the largest responses to a shock of the base from its response spectrum.

    Parameters
    ----------
    case : Case
        Loads and imposed displacements of the case are preloads, as in `frf`.
    base : mapping of str to ShockSpectrum or (frequencies, accelerations)
        Spectrum of the acceleration of the base by axis, "x", "y" or "z": a result of
        `signals.shock_spectrum` of a record in m/s2 (its `maximax` counts), or frequencies (Hz) and
        accelerations (m/s2) above 0, between which lines are straight in a log-log plot. It has to
        be that of the damping of the modes. Axes are combined by the root of the sum of squares.
    combine : {"cqc", "srss"}
        Complete quadratic combination, which counts that modes with close frequencies move
        together, or the root of the sum of squares.
    count : int, optional
        Number of modes, from the lowest on; by default all below the last frequency of a spectrum.
        Other modes and what they leave of the mass move with the base.
    state, load_factor
        As in `frf`.
    stresses, reactions : bool
        Whether to find stresses and forces of supports, too, as in `random_response`.

    Returns
    -------
    xarray.Dataset
        Over node and axis: `displacement_peak` (m), relative to the base, and `acceleration_peak`
        (m/s2), absolute. With `stresses` those of `membrane_force`, `bending_moment`, `von_mises`
        and `crease_moment`; with `reactions` of `reaction` and `total_reaction`. `displacement` of
        the state. Attributes `covered_x`, ...: share of the moving mass in the modes, by axis.

    Raises
    ------
    InputError
        No spectrum, or one that begins above the lowest mode; springs or dashpots to the ground,
        which a moving base does not carry along; laws with memory; an argument out of range.

    Warns
    -----
    ModelRangeWarning
        The modes within the spectrum have less than 90 % of the moving mass, or lie above the range
        of the model.

    Notes
    -----
    A. Der Kiureghian, Earthquake Eng. Struct. Dyn. 9, 1981 (CQC). Damping of modes counts in the
    combination only. Estimates, not bounds: docs/random-vibration.md has comparisons with motions.

    Examples
    --------
    >>> import foldyn as fd
    >>> import numpy as np
    >>> pattern = fd.patterns.simple_fold(a=0.1, b=0.1, dihedral=120)
    >>> sheet = fd.Sheet(3e9, 0.3, thickness=1e-3, density=1000.0)
    >>> case = fd.Case(fd.superelements(pattern, sheet, clamped="xmin"), [fd.Fix("xmin")],
    ...                damping=fd.ModalDamping(0.05))
    >>> pulse = 200.0 * np.sin(np.linspace(0, np.pi, 111))  # m/s2, 11 ms
    >>> f = np.geomspace(5.0, 2000.0, 200)
    >>> shock = fd.signals.shock_spectrum(pulse, 1e-4, frequency=f)
    >>> found = fd.spectrum_response(case, {"z": shock})
    >>> found.acceleration_peak.sel(node=5, axis="z").round(0).item()
    192.0
    """
    began = time.perf_counter()
    rule = choice("combine", combine, RULES)
    count = None if count is None else whole("count", count, least=1, what="modes")
    spectra = _spectra(of_kind("case", case, Case), base)
    parts = Parts(
        case, state, load_factor=number("load_factor", load_factor),
        stresses=flag("stresses", stresses), reactions=flag("reactions", reactions),
    )  # fmt: skip
    system = parts.system
    if system.responding is not None:
        raise InputError(
            ": laws with memory have no modes whose largest responses could be combined; take "
            "fd.simulate with the record, or an elastic law",
            "case",
        )
    top = max(float(frequency[-1]) for frequency, _ in spectra.values())
    pencil = Pencil(system.stiffness, system.mass)
    if count is None:
        count = max(FEWEST, pencil.below((TURN * top) ** 2))  # those above top are not combined
    modes = SuperposedModes(system, pencil, min(pencil.finite, count))
    squares: dict[str, NDArray] = {}
    facts: dict[str, Any] = {"modes": modes.count, "combine": rule}
    for axis, spectrum in spectra.items():
        drive, k = drive_of(case, BaseMotion(axis), 1.0), AXES.index(axis)
        if system.ground[:, k].any() or system.drag[:, k].any():
            raise InputError(
                f": springs, dashpots or planes hold the case to the ground along {axis}, which "
                "does not move with the base; connect them to held nodes (between = ...), or take "
                "fd.simulate with the record",
                "supports",
            )
        shock = _Shock(system, modes, axis, spectrum, rule)
        for name, amounts in parts.amounts(drive, ModalResponse(modes, drive)).items():
            squares[name] = squares.get(name, 0.0) + shock.square(amounts)
        facts[f"covered_{axis}"] = shock.covered
        _warn_of_mass(axis, shock.covered)
    frequency = np.sqrt(modes.basis.values[modes.basis.inertia > 0.0].clip(0.0)) / TURN
    warn_beyond(case.structure, frequency[frequency <= top], "mode", linear=True)
    summed = {name: squared_parts(name, own.clip(0.0)) for name, own in squares.items()}
    found = {name: {"peak": np.sqrt(own)} for name, own in summed.items()}
    facts["wall_seconds"] = time.perf_counter() - began
    return random_dataset(
        case, system.displacement, found, facts, np.zeros(0), parts.coordinates, of="spectrum"
    )


def _spectra(case: Case, given: Any) -> dict[str, tuple[NDArray, NDArray]]:
    """Frequencies (Hz) and accelerations (m/s2) by axis."""
    if not isinstance(given, Mapping) or not given:
        raise InputError(f' = {show(given)}: give spectra by axis, as {{"z": spectrum}}', "base")
    out = {}
    for axis, spectrum in given.items():
        place = f"base[{choice('base', axis, AXES)!r}]"
        if isinstance(spectrum, ShockSpectrum):
            spectrum = spectrum.frequency, spectrum.maximax
        if not isinstance(spectrum, tuple | list) or len(spectrum) != 2:
            raise InputError(
                ": give a spectrum of signals.shock_spectrum, or a pair of frequencies (Hz) and "
                "accelerations (m/s2)",
                place,
            )
        frequency = increasing(f"{place}[0]", spectrum[0], above=0.0, unit="Hz")
        value = np.atleast_1d(numbers(f"{place}[1]", spectrum[1]))
        if value.shape != frequency.shape or not (value > 0.0).all():
            raise InputError(": give an acceleration (m/s2) above 0 for each frequency", place)
        out[axis] = frequency, value
    return out


class _Shock:
    """Largest amplitudes of the modes under a spectrum, and how they combine.

    covered : share of the moving mass in the modes.
    """

    def __init__(
        self, system: Linearized, modes: SuperposedModes, axis: str,
        spectrum: tuple[NDArray, NDArray], rule: str,
    ) -> None:  # fmt: skip
        basis, k = modes.basis, AXES.index(axis)
        modal = np.flatnonzero(basis.inertia > 0.0)
        self._count, self._squared = len(basis.values), basis.values[modal]
        omega = np.sqrt(self._squared.clip(0.0))
        moved = system.inertia[:, k] + system.pushed[:, k]
        self._participation = basis.shapes[:, modal].T @ moved
        frequency, value = spectrum
        taking = np.abs(self._participation) > 0.0
        low = omega[taking] < TURN * frequency[0]
        if low.any():
            raise InputError(
                f": begins at {frequency[0]:.4g} Hz, above the mode at "
                f"{omega[taking][low].min() / TURN:.4g} Hz; extend it",
                f"base[{axis!r}]",
            )
        with np.errstate(divide="ignore"):
            at = np.interp(np.log(omega / TURN), np.log(frequency), np.log(value))
        self._reached, self._swings = np.exp(at), omega <= TURN * frequency[-1]
        self._last, self._modal = float(value[-1]), modal
        self.covered = covered_mass(modes, moved, k, float(frequency[-1]))
        zeta = np.divide(
            modes.damping.diagonal()[modal], 2.0 * omega, out=np.zeros_like(omega),
            where=omega > 0.0,
        )  # fmt: skip
        self._alike = np.eye(len(modal) + 1)
        if rule == "cqc":
            self._alike[:-1, :-1] = correlation(omega, zeta)

    def square(self, amounts: Amounts) -> NDArray[np.float64]:
        """Squares (k,) of the largest values of a quantity."""
        each = zip(amounts.powers, amounts.rows, strict=True)
        largest = sum(self._columns(power, rows.shape[1]) @ rows.T for power, rows in each)
        return np.einsum("ip,ij,jp->p", largest, self._alike, largest)

    def _columns(self, power: int, size: int) -> NDArray[np.float64]:
        """Amplitudes (modes + 1, size) of all columns; the last row is that of the other mass.

        power : derivative. Velocities are zero when displacements are largest.
        """
        out, last = np.zeros((len(self._modal) + 1, size)), self._last
        pull, swings = self._participation, self._swings
        stiff = np.where(self._squared > 0.0, self._squared, np.inf)
        own = np.arange(len(self._modal)), self._modal
        if power == 0:
            out[own] = -np.where(swings, pull * self._reached / stiff, 0.0)
            out[-1, self._modal] = -last * np.where(swings, 0.0, pull / stiff)
            out[-1, self._count : -2], out[-1, -1] = -last, last
        elif power == 2:
            out[own] = np.where(swings, pull * self._reached, 0.0)
            out[-1, self._modal], out[-1, -2] = -last * np.where(swings, pull, 0.0), last
        return out


def correlation(omega: NDArray, zeta: NDArray) -> NDArray[np.float64]:
    """Coefficients (k, k) of the complete quadratic combination (Der Kiureghian 1981).

    omega, zeta : (k,) frequencies, rad/s, and damping ratios.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        r = omega[None, :] / omega[:, None]
        a, b = zeta[:, None], zeta[None, :]
        over = 8.0 * np.sqrt(a * b) * (a + r * b) * r**1.5
        under = (1.0 - r**2) ** 2 + 4.0 * a * b * r * (1.0 + r**2) + 4.0 * (a**2 + b**2) * r**2
        out = np.where(under > 0.0, over / under, 0.0)
    out[np.diag_indices(len(out))] = 1.0
    return np.nan_to_num(out)


def _warn_of_mass(axis: str, covered: float) -> None:
    if covered < COVERED:
        warn(
            f"the modes within the spectrum have {covered:.0%} of the mass that moves along "
            f"{axis}; the rest is taken as moving with the base: give a higher count, or a "
            "spectrum that reaches farther",
            "random-vibration.md#response-spectra",
            ModelRangeWarning,
        )
