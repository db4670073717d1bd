"""Errors of bars and hinges at rest: their modes beside those of superelements.

Superelements of a low level on one mesh are within 2 % of a fine shell, and take a fraction of a
second. Modes of both are paired by their shapes at the nodes that the models share.
"""

from __future__ import annotations

import warnings
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.condensation.library import different
from foldyn.condensation.structure import Superelements
from foldyn.errors import FoldynWarning, InputError, ModelRangeWarning, warn
from foldyn.linear.mac import pairs, same_places
from foldyn.linear.shell_of import check_reduced, superelements_of
from foldyn.structures import Structure

LEVEL, DIVISIONS = 2, 12
"""The superelements to compare with."""
PANELS, SHAPES = 200, 20
"""Most panels, and most different ones, that are compared: a comparison takes 2 to 4 s."""
SPARE = 10  # additional modes of superelements among which partners are sought
LEAST = 0.5  # least MAC of a partner
DOUBTFUL = 0.05  # relative error above which a mode is told of
SLOW = 1e-3  # frequencies of bands below this, relative to the highest, are not compared
REMEDY = "take superelements (fd.superelements, --model superelements)"
BELOW = 0.9  # modes below this share of the highest frequency that have no partner are missing


def beside(case: Case) -> Case | str:
    """The case with superelements, without loads; or why it is not compared with them.

    Empty for other models than bars and hinges, and for structures without a pattern.
    """
    structure = case.structure
    if structure.kind != Structure.kind or structure.pattern is None:
        return ""
    pattern = structure.pattern
    if len(pattern.faces) > PANELS:
        return f"{len(pattern.faces)} panels, more than {PANELS}"
    try:
        check_reduced(case)
        shapes = different(pattern, structure.sheet)
        if shapes > SHAPES:
            return f"{shapes} different panels, more than {SHAPES}"
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FoldynWarning)
            bare = case.altered(loads=(), contact=None)
            return superelements_of(bare, level=LEVEL, divisions=DIVISIONS)
    except InputError as error:
        return str(error)


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
                f"{_numbered('mode', alone)} resemble{'s' * (len(alone) == 1)} no mode of "
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
    largest = np.nan_to_num(errors[worst, np.arange(len(worst))])
    told = _far_off("band", largest)
    if told:
        warn(
            f"{told} at some wave vectors: {REMEDY}",
            "superelements.md#bars-and-hinges-beside-them",
            ModelRangeWarning,
        )


def judged(
    case: Case, frequency: NDArray, shape: NDArray, other: Case, true: NDArray, shapes: NDArray
) -> Judged:
    """Pair modes of a case with those of superelements.

    frequency, shape : (k,), (k, n, 3) all modes of the case, with nan or 0 Hz for those that are
    not elastic.
    other, true, shapes : the case with superelements, and its elastic modes (j,), (j, n', 3) at
    vertices and then between them.
    """
    structure, reference = case.structure, other.structure
    assert isinstance(reference, Superelements)
    points = np.concatenate([reference.nodes, reference.between(other.held_edges)[0]])
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


def warn_of(own: Judged, elastic: NDArray) -> None:
    """Warn about modes, some (k,) of them elastic, that are far off, alone, or missing."""
    doubts = own.doubts(elastic)
    if doubts:
        warn(
            f"{doubts}: {REMEDY}",
            "superelements.md#bars-and-hinges-beside-them",
            ModelRangeWarning,
        )


def _far_off(name: str, errors: NDArray) -> str:
    """Which modes or bands have errors (k,) that are too large, and the worst; empty if none."""
    off = np.flatnonzero(np.abs(errors) > DOUBTFUL)
    if not len(off):
        return ""
    worst = np.abs(errors).argmax()
    return (
        f"{_numbered(name, off + 1)} differ{'s' * (len(off) == 1)} by more than {DOUBTFUL:.0%} "
        f"from superelements ({name} {worst + 1}: {errors[worst]:+.0%})"
    )


def _numbered(name: str, numbers: NDArray) -> str:
    """Modes or bands by number, as "mode 3", "modes 1, 2" or "modes 4 to 9"."""
    if len(numbers) > 2 and numbers[-1] - numbers[0] == len(numbers) - 1:
        return f"{name}s {numbers[0]} to {numbers[-1]}"
    return f"{name}{'s' * (len(numbers) > 1)} {', '.join(map(str, numbers.tolist()))}"
