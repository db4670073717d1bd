"""Errors of the frequencies of superelements, from other levels and coarser meshes.

Each level contains the lower ones, so that frequencies fall with the level, toward those of the
shell. The next level alone is no measure of the error: some numbers of shapes do not rise from one
level to the next. So each level is compared with the highest one, and that with level 3, and the
differences are multiplied by `SHARES`, found to be large enough in 97 % of modes of 28 sheets
(docs/superelements.md). The error of the mesh is the difference between extrapolations from two
pairs of meshes.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from foldyn.cases import Case
from foldyn.condensation import Superelements
from foldyn.condensation.shapes import LEVELS
from foldyn.errors import ModelRangeWarning, warn
from foldyn.linear.linearized import numbered
from foldyn.linear.linearized_cell import LinearizedCell, linearize_cell
from foldyn.linear.wave_solver import Waves, WaveSolver

LOWER = 3  # level with which the highest one is compared
SHARES = (2.0, 2.0, 2.0, 3.0, 1.0)  # error of each level / difference to the other one
LEAST = 1e-3  # error of every frequency, relative to it, that no comparison shows
DOUBTFUL = 0.05  # relative error of a frequency up to which results are said to hold
ROUNDING = 1e-4  # errors below this, relative to the highest frequency, are no reason for doubt
TURN = 2.0 * np.pi


def other_level(structure: Any) -> Superelements:
    """The structure with the level to compare with."""
    highest = structure.options.level == len(LEVELS)
    return structure.at_level(LOWER if highest else len(LEVELS))


def frequency_errors(
    case: Case, values: NDArray, other: NDArray, changes: Iterable[NDArray]
) -> NDArray[np.float64]:
    """Bounds (k,), Hz, of the errors of frequencies relative to a shell on a fine mesh.

    values : (k,) the lowest eigenvalues.
    other : (k,) those with the structure of `other_level`.
    changes : of stiffness and mass (k, k), in the space of the modes, by coarser meshes.
    """
    structure: Any = case.structure
    stiffness, mass = (0.5 * (each + each.conj().T) for each in changes)
    coarse = eigh(np.diag(values) + stiffness, np.eye(len(values)) + mass, eigvals_only=True)
    own, level, mesh = (np.sqrt(each.clip(min=0.0)) / TURN for each in (values, other, coarse))
    share = SHARES[structure.options.level - 1]
    return share * np.abs(level - own) + np.abs(mesh - own) + LEAST * own


def warn_of_errors(structure: Superelements, frequency: NDArray, error: NDArray) -> None:
    """Warn about modes whose frequencies (k,), Hz, may be off by `error` (k,), more than 5 %."""
    off = np.flatnonzero(error > DOUBTFUL * frequency)
    if not len(off):
        return
    share = error[off] / np.maximum(frequency[off], ROUNDING * frequency.max())
    better = "take a higher level"
    if structure.options.level == len(LEVELS):
        better = "cut panels that are much longer than wide into welded ones (Pattern(welds=...))"
    warn(
        f"{numbered('mode', off + 1)} may be more than {DOUBTFUL:.0%} off (frequency_error; mode "
        f"{off[share.argmax()] + 1}: {share.max():.0%}): {better}",
        "superelements.md#errors",
        ModelRangeWarning,
    )


def band_errors(
    linear: LinearizedCell, phases: NDArray, waves: Sequence[Waves]
) -> NDArray[np.float64]:
    """Bounds (n, k), Hz, of the errors of bands at phases (n, d); 0 for a frequency of 0."""
    case = linear.cell.case
    leveled = case.altered(structure=other_level(case.structure))
    compared = linearize_cell(linear.cell.with_case(leveled)).bloch
    others = WaveSolver(compared, len(waves[0].values)).at(phases)
    patch: Any = linear.patch.case
    changes = [linear.reach.hops(part) for part in patch.structure.changes(patch.held_edges)]
    out = np.zeros((len(phases), len(waves[0].values)))
    for row, phase, own, other in zip(out, phases, waves, others, strict=True):
        order, factors = np.argsort(own.values), linear.bloch.factors(phase)
        values, shapes, _ = own.ordered(order)
        parts = (shapes.conj().T @ (part.sparse_at(factors) @ shapes) for part in changes)
        errors = frequency_errors(case, values, other.values, parts)
        row[order] = np.where(values > 0.0, errors, 0.0)
    return out


def first_doubtful(frequency: NDArray, error: NDArray) -> float:
    """Lowest of some frequencies (Hz) whose error is more than `DOUBTFUL`; infinite if none is."""
    least = ROUNDING * np.max(frequency, initial=0.0)
    doubtful = frequency[error > np.maximum(DOUBTFUL * frequency, least)]
    return float(np.min(doubtful, initial=np.inf))
