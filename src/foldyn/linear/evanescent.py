"""Waves of a given frequency: waves that travel, and waves that decay from cell to cell.

With the dynamic stiffness D_s = K_s + i omega C_s - omega^2 M_s between cells s periods apart along
one direction, for a given phase along the other direction, a wave u lambda^s satisfies

    sum over s of lambda^s D_s u = 0,    lambda = exp(i k),

a polynomial eigenvalue problem in lambda, quadratic if only neighbors interact. Dofs without
coupling to other cells are condensed. Im k is the attenuation (Np per cell); k and -k come in
pairs (B. R. Mace, E. Manconi, J. Sound Vib. 318, 2008).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray
from numpy.typing import NDArray
from scipy import linalg

from foldyn.cases import State
from foldyn.errors import InputError
from foldyn.linear.bloch import Bloch
from foldyn.linear.linearized import warn_beyond
from foldyn.linear.linearized_cell import linearize_cell
from foldyn.linear.unit_cell import UnitCell
from foldyn.results.dataset import result_dataset
from foldyn.threads import in_threads
from foldyn.values import number_or_list, numbers, one_or_each, whole

TRAVELS = 1e-6  # Np per cell: below this attenuation a wave counts as traveling
FASTEST = 40.0  # Np per cell: waves that decay faster are lost in round-off
TURN = 2.0 * np.pi


class Reach(NamedTuple):
    """A matrix by distance of cells: `steps` (s,) from -r to r, and `blocks` (s, n, n)."""

    steps: NDArray[np.int64]
    blocks: NDArray


def attenuation(
    cell: UnitCell,
    frequencies: Any,
    *,
    along: int = 0,
    phase: float | Sequence[float] = 0.0,
    count: int = 6,
    state: State | None = None,
    secant: float | None = None,
    load_factor: float = 1.0,
) -> xarray.Dataset:
    """Complex phases of the waves of given frequencies along one direction, and their attenuation.

    Parameters
    ----------
    cell : UnitCell
        The cell; its damping is included, and makes all waves decay.
    frequencies : float or array_like, shape (n,)
        Frequencies (Hz), above 0.
    along : int
        Number of the period, from 0.
    phase : float or sequence of float
        Phase (rad) along the other period of a sheet, or those along the others of a solid.
    count : int
        Number of waves, beginning with the slowest-decaying wave.
    state, secant, load_factor
        As in `bands`.

    Returns
    -------
    xarray.Dataset
        Dimensions frequency, wave. `phase`, complex, rad per cell, nan if there are fewer waves:
        the real part is from -pi to pi, and the imaginary part is not negative, so that waves decay
        in the direction; for traveling waves only phases from 0 to pi are listed if the argument
        `phase` is 0. `attenuation` (Np per cell) of the slowest-decaying wave, 0 if a wave travels:
        motions of this frequency fall by exp(-attenuation) per cell.

    Raises
    ------
    InputError
        An argument out of range; a state that does not repeat.

    Examples
    --------
    >>> import foldyn as fd
    >>> sheet = fd.Sheet(youngs_modulus=1e9, poissons_ratio=0.3, thickness=1e-3, density=1000.0)
    >>> pattern = fd.patterns.miura(a=0.03, b=0.03)
    >>> cell = fd.UnitCell(fd.Case(fd.discretize(pattern, sheet)))
    >>> found = fd.linear.attenuation(cell, [1700.0, 1200.0], phase=3.14159)
    >>> (found.attenuation > 0.01).values.tolist()
    [False, True]
    """
    linear = linearize_cell(cell, state, secant, load_factor)
    wanted = np.atleast_1d(numbers("frequencies", frequencies))
    if wanted.ndim != 1 or not len(wanted) or (wanted <= 0.0).any():
        raise InputError(": give numbers above 0 (Hz)", "frequencies")
    warn_beyond(cell.case.structure, wanted)
    count, phase = whole("count", count, least=1), number_or_list("phase", phase, "period")
    along = cell.period("along", along)
    others = one_or_each("phase", phase, cell.dimensions - 1, "other periods")
    if np.any(phase) and cell.dimensions == 1:
        raise InputError(f" = {phase:g}: the cell has no other period", "phase")
    parts = [
        _blocks(linear.bloch, part, along, others)
        for part in (linear.bloch.stiffness, linear.bloch.damping, linear.bloch.mass)
    ]
    ties = _blocks(linear.bloch, linear.bloch.ties, along, others)
    kept = np.flatnonzero(~linear.bloch.held)

    def waves(frequency: float) -> NDArray[np.complex128]:
        """Phases (count,) of the waves at a frequency, Hz."""
        omega = TURN * frequency
        stiffness, damping, mass = (each.blocks[:, kept[:, None], kept] for each in parts)
        dynamic = stiffness + 1j * omega * damping - omega**2 * mass
        blocks = _bordered(dynamic, ties.blocks[:, :, kept])
        found = phases_of(Reach(parts[0].steps, blocks), linear.bloch.ties.empty)
        found = _forward(found, both=not others.any())[:count]
        return np.pad(found, (0, count - len(found)), constant_values=np.nan)

    out = np.array(in_threads(waves, wanted))
    decay = np.imag(out)
    least = decay.min(axis=1, initial=FASTEST, where=~np.isnan(decay))
    data: dict[str, Any] = {
        "phase": (("frequency", "wave"), out, {"units": "rad"}),
        "attenuation": ("frequency", np.where(least <= TRAVELS, 0.0, least), {"units": "Np"}),
    }
    number = 1 + np.arange(count)
    run = {"frequency": ("frequency", wanted, {"units": "Hz"}), "wave": ("wave", number)}
    facts = {"count": count, "secant": secant, "along": along, "other_phase": phase}
    return result_dataset("attenuation", cell.case, data | linear.variables, run, facts)


def _blocks(bloch: Bloch, matrix: Any, along: int, phases: NDArray) -> Reach:
    """Blocks of a matrix by cells along a direction, summed with phases along the others."""
    steps = bloch.steps[:, along]
    other = np.delete(bloch.steps, along, axis=1) @ phases
    reach = int(np.abs(steps).max(initial=0))
    every = np.arange(-reach, reach + 1)
    factors = np.exp(1j * other)
    blocks = np.array([matrix.at(np.where(steps == step, factors, 0.0)) for step in every])
    return Reach(every, blocks)


def _bordered(dynamic: NDArray, ties: NDArray) -> NDArray[np.complex128]:
    """Blocks with constraints (s, k, n) added, whose forces are further unknowns."""
    count, scale = ties.shape[1], np.abs(dynamic).max()
    turned = ties[::-1].conj().transpose(0, 2, 1)  # G^H at 1 / lambda*
    none = np.zeros((len(ties), count, count))
    above = np.concatenate([dynamic, scale * turned], axis=2)
    below = np.concatenate([scale * ties, none], axis=2)
    return np.concatenate([above, below], axis=1).astype(complex)


def phases_of(reach: Reach, condense: bool = True) -> NDArray[np.complex128]:
    """All complex phases k of waves u exp(i k s), except those that decay too fast to resolve.

    condense : whether unknowns without coupling to other cells are eliminated first.
    """
    steps, blocks = reach
    far = blocks[steps != 0]
    coupled = (np.abs(far).sum(axis=(0, 1)) + np.abs(far).sum(axis=(0, 2))) > 0.0
    coupled |= not condense
    b, i = np.flatnonzero(coupled), np.flatnonzero(~coupled)
    own = blocks[steps == 0][0]
    reduced = blocks[:, b[:, None], b].astype(complex)
    follow = np.linalg.solve(own[np.ix_(i, i)], own[np.ix_(i, b)])
    reduced[steps == 0] -= own[np.ix_(b, i)] @ follow
    used = np.flatnonzero(np.abs(reduced).sum(axis=(1, 2)))
    low, high = int(used.min()), int(used.max())
    reduced, order, size = reduced[low : high + 1], high - low, len(b)
    if not order or not size:
        return np.zeros(0, complex)
    scale = 1.0 / np.sqrt(np.abs(reduced).max(axis=(0, 2)))
    reduced = scale[:, None] * reduced * scale
    left, right = np.zeros((2, order * size, order * size), complex)
    eye = np.eye(size)
    for k in range(order - 1):  # lambda^(k+1) u follows lambda^k u
        left[k * size : (k + 1) * size, (k + 1) * size : (k + 2) * size] = eye
        right[k * size : (k + 1) * size, k * size : (k + 1) * size] = eye
    for k in range(order):
        left[-size:, k * size : (k + 1) * size] = -reduced[k]
    right[-size:, -size:] = reduced[order]
    above, below = linalg.eig(left, right, right=False, homogeneous_eigvals=True)
    resolved = (np.abs(above) > np.exp(-FASTEST) * np.abs(below)) & (
        np.abs(below) > np.exp(-FASTEST) * np.abs(above)
    )
    return -1j * np.log(above[resolved] / below[resolved])


def _forward(phases: NDArray, both: bool) -> NDArray[np.complex128]:
    """Waves that decay in the direction, slowest first, and traveling waves.

    both : whether -k is a solution with every k, so that only one of the two is kept.
    """
    real, decay = np.real(phases), np.imag(phases)
    travels = np.abs(decay) <= TRAVELS
    kept = (decay > TRAVELS) | (travels & (real >= -TRAVELS if both else True))
    found = np.where(travels, real + 0j, phases)[kept]
    return found[np.lexsort((np.real(found), np.imag(found)))]
