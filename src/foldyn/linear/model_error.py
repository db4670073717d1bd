"""Errors of the modes of bars and hinges, and of superelements, at rest, by comparisons.

Modes of bars and hinges are compared with those of superelements. These, of a low level on one
mesh, are within 3 % of a fine shell up to twice the frequency of a plate (docs/superelements.md),
and take a fraction of a second. Modes of both are paired by their shapes at the nodes that the
models share.

Errors of superelements themselves, from other levels and coarser meshes: each level contains the
lower ones, so that frequencies fall with the level, toward those of the shell. The next level alone
is no measure of the error: some numbers of shapes do not rise from one level to the next. So each
level is compared with the highest one, and that with level 3, and the differences are multiplied by
`SHARES`, found to be large enough in 97 % of modes of 28 sheets (docs/superelements.md). The error
of the mesh is the difference between extrapolations from two pairs of meshes.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from foldyn.cases import Case
from foldyn.condensation import Superelements
from foldyn.condensation.library import different
from foldyn.condensation.shapes import LEVELS
from foldyn.errors import InputError, ModelRangeWarning, quietly, warn
from foldyn.linear.linearized import numbered
from foldyn.linear.linearized_cell import LinearizedCell, linearize_cell
from foldyn.linear.mac import pairs, same_places
from foldyn.linear.shell_of import check_reduced, superelements_of
from foldyn.linear.wave_solver import Waves, WaveSolver
from foldyn.structures import Structure
from foldyn.structures.beyond_range import LINEAR
from foldyn.values import flag

BESIDE: dict[str, Any] = {"level": 3, "divisions": 12}
"""The superelements to compare with."""
PANELS, SHAPES = 200, 20
"""Most panels, and most different ones, that are compared: a comparison takes 2 to 4 s."""
OF_STIFFNESS = 16, 8  # the same for effective properties, which need finer superelements
SPARE = 10  # additional modes of superelements among which partners are sought
LEAST = 0.5  # least MAC of a partner
SLOW = 1e-3  # frequencies of bands below this, relative to the highest, are not compared
BELOW = 0.9  # modes below this share of the highest frequency that have no partner are missing
LOWER = 3  # level with which the highest one is compared
SHARES = (2.0, 2.0, 2.0, 3.0, 1.0)  # error of each level / difference to the other one
SMALLEST = 1e-3  # error of every frequency, relative to it, that no comparison shows
DOUBTFUL = 0.05  # relative error of a frequency up to which results are said to hold
ROUNDING = 1e-4  # errors below this, relative to the highest frequency, are no reason for doubt
WEIGHTLESS = 1e-9  # mass of a motion that a coarse mesh leaves without any, relative to its mass
TURN = 2.0 * np.pi


class Beside(NamedTuple):
    """What a case is compared with.

    Attributes
    ----------
    case : Case or None
        The case with superelements, without loads.
    why : str or None
        Why bars and hinges are not compared; None for other models, and where nobody asks.
    """

    case: Case | None = None
    why: str | None = None


ALONE = Beside()
"""Not compared."""


def beside(case: Case, asked: bool, state: Any, secant: Any, stiffness: bool = False) -> Beside:
    """What a case is compared with, if asked for; at rest, and with the slopes of its laws only.

    stiffness : whether effective properties are compared. On one mesh of 12 divisions they
    would be up to 16 % off, so that the superelements are the default ones.
    """
    structure = case.structure
    if not flag("check_model", asked) or state is not None or secant is not None:
        return ALONE
    if structure.kind != Structure.kind or structure.pattern is None:
        return ALONE
    pattern = structure.pattern
    if case.air is not None:
        return Beside(why="it moves in a fluid, whose flow would have to be computed once more")
    panels, kinds = OF_STIFFNESS if stiffness else (PANELS, SHAPES)
    if len(pattern.faces) > min(panels, PANELS):
        return Beside(why=f"{len(pattern.faces)} panels, more than {min(panels, PANELS)}")
    try:
        check_reduced(case)
        shapes = different(pattern, structure.sheet)
        if shapes > kinds:
            return Beside(why=f"{shapes} different panels, more than {kinds}")
        with quietly():
            bare = case.altered(loads=(), contact=None)
            return Beside(superelements_of(bare, **({} if stiffness else BESIDE)))
    except InputError as error:
        return Beside(why=str(error))


class Judged(NamedTuple):
    """Modes of a model, k of them, beside those of superelements.

    Attributes
    ----------
    frequency : (k,)
        Frequency of the partner, Hz; nan for rigid and unstable modes, and without a partner.
    error : (k,)
        Relative error of the frequency; nan without a partner.
    lost : (m,)
        Frequencies, Hz, of superelements' modes that no mode of the model resembles.
    """

    frequency: NDArray[np.float64]
    error: NDArray[np.float64]
    lost: NDArray[np.float64]

    def doubts(self, elastic: NDArray) -> str:
        """What is wrong with the modes, of which some (k,) are elastic; empty if nothing."""
        alone = np.flatnonzero(elastic & np.isnan(self.error)) + 1
        far = _far_off("mode", np.nan_to_num(self.error))
        told = [far] if far else []
        if len(alone):
            told.append(
                f"{numbered('mode', alone)} resemble{'s' * (len(alone) == 1)} no mode of "
                "superelements"
            )
        if len(self.lost):
            listed = ", ".join(f"{each:.4g}" for each in self.lost[:3])
            more = ", ..." if len(self.lost) > 3 else ""
            told.append(f"modes of superelements at {listed}{more} Hz are missing")
        return "; ".join(told)


def errors_of_bands(own: NDArray, true: NDArray) -> NDArray[np.float64]:
    """Relative errors (n, k) of frequencies of bands at n phases, each in order of frequency.

    nan where the frequency is nearly zero, as of acoustic waves at long wavelengths, or undefined.
    """
    rank = own.argsort(axis=1).argsort(axis=1)
    other = np.take_along_axis(np.sort(true, axis=1), rank, axis=1)
    near_zero = np.minimum(own, other) < SLOW * np.nanmax(true)
    return np.where(near_zero, np.nan, own / np.where(near_zero, 1.0, other) - 1.0)


def warn_of_bands(errors: NDArray) -> None:
    """Warn about bands whose frequencies, with errors (n, k) at n phases, are far off."""
    worst = np.abs(np.nan_to_num(errors)).argmax(axis=0)
    told = _far_off("band", np.nan_to_num(errors[worst, np.arange(len(worst))]))
    warn_of(told and f"{told} at some wave vectors")


def judged(
    case: Case, frequency: NDArray, shape: NDArray, points: NDArray, true: NDArray, shapes: NDArray
) -> Judged:
    """Pair modes of a case with those of superelements.

    frequency, shape : (k,), (k, n, 3) all modes of the case, with nan or 0 Hz for those that are
    not elastic.
    points, true, shapes : (p, 3), (j,), (j, p, 3) points and elastic modes of superelements.
    """
    structure = case.structure
    shared, place = same_places(points, structure.nodes, structure.pattern.size)
    elastic = np.flatnonzero(frequency > 0.0)
    found = pairs(
        frequency[elastic], shape[elastic][:, shared],
        true, shapes[:, place], np.ones(len(shared)),
    )  # fmt: skip
    alike = found.mac >= LEAST
    first, second = elastic[found.first[alike]], found.second[alike]
    partner = np.full(len(frequency), np.nan)
    partner[first] = true[second]
    top = BELOW * frequency[elastic].max(initial=0.0)
    lost = np.setdiff1d(np.flatnonzero(true < top), second)
    return Judged(partner, frequency / partner - 1.0, true[lost])


def warn_of(doubts: str) -> None:
    """Warn about modes or bands that are far off, alone, or missing; not if there is no doubt."""
    if doubts:
        text = f"{doubts}: {LINEAR}"
        warn(text, "superelements.md#bars-and-hinges-beside-them", ModelRangeWarning)


def _far_off(name: str, errors: NDArray) -> str:
    """Which modes or bands have errors (k,) that are too large, and the worst; empty if none."""
    off = np.flatnonzero(np.abs(errors) > DOUBTFUL)
    if not len(off):
        return ""
    worst = np.abs(errors).argmax()
    return (
        f"{numbered(name, off + 1)} differ{'s' * (len(off) == 1)} by more than {DOUBTFUL:.0%} "
        f"from superelements ({name} {worst + 1}: {errors[worst]:+.0%})"
    )


def other_level(structure: Any) -> Superelements:
    """The structure with the level to compare with."""
    return structure.at_level(LOWER if structure.options.level == len(LEVELS) else len(LEVELS))


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
    size, ways = eigh(np.eye(len(values)) + mass)
    ways /= np.sqrt(size.clip(min=WEIGHTLESS))
    coarse = eigh(ways.conj().T @ (np.diag(values) + stiffness) @ ways, eigvals_only=True)
    own, level, mesh = (np.sqrt(each.clip(min=0.0)) / TURN for each in (values, other, coarse))
    share = SHARES[structure.options.level - 1]
    return share * np.abs(level - own) + np.abs(mesh - own) + SMALLEST * own


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
