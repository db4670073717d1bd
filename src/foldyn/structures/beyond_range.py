"""Patterns beyond the range of bars and hinges: warned of, but computed.

The limits are where frequency errors relative to the shell exceed 5 to 10 % (docs/fidelity.md,
"Beyond the range").
"""

from __future__ import annotations

from collections.abc import Collection, Iterator

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import ModelRangeWarning, warn
from foldyn.materials import EnhancedLinear
from foldyn.patterns import Pattern
from foldyn.structures.discretized import Discretized
from foldyn.structures.mesh import lengths
from foldyn.structures.rigid_plates import rigid_panels
from foldyn.structures.sheet import Sheet
from foldyn.structures.structure import ModelOptions

STIFF = 3.0  # k w/G of a crease between panels of width w: the sheet bends across it like one plate
STIFF_STRIP, SQUARE = 0.3, 1.4  # the same for creases that do not meet, of longer panels
FEW = 16  # panels of a sheet with clamped edges
SKEW = 33.0  # degrees, smallest corner of a quadrilateral panel
FOLDED = 0.05  # t/(L sin fold) of welds, above which they bow, unlike in the model
FLAT = 0.15  # the same for creases
LOCKING = 1.1  # times the stiffness of a crease: 5 % in frequency
SHUT = 100.0  # the same: panels at such a crease move as one
SMOOTH = 1e-3  # rad, below it a fold is flat
DIGITS = 6  # decimals in comparisons, so that rounding does not exceed limits
SHELL = "take the shell, fd.shell"
GIVING = f'take preset = "n5b8e", or {SHELL[5:]}'


def doubt_range(pattern: Pattern, sheet: Sheet, options: ModelOptions, folds: NDArray) -> None:
    """Warn of patterns beyond the range of the model.

    folds : stiffness (nf,) of the creases alone, N m/rad.
    """
    if options.calibration != "plate":  # a published model is used with its errors
        return
    for text in _doubts(pattern, sheet, options, folds):
        warn(text, "fidelity.md#beyond-the-range", ModelRangeWarning)


def doubt_locking(structure: Discretized) -> None:
    """Warn of creases at rest in the range where the default fold law already locks."""
    law, rest = structure.options.fold_law, structure.fold_rest
    if law != EnhancedLinear() or not len(rest):
        return
    stiffer = law.slope(rest, rest)
    k = int(stiffer.argmax())
    if stiffer[k] > LOCKING:
        how = (
            f"{stiffer[k]:.3g} times as stiff as between them"
            if stiffer[k] < SHUT
            else "which keeps it shut, so that its panels move as one"
        )
        warn(
            f"crease {k} rests at {np.degrees(rest[k]):.3g} degrees, beyond the angles (45 and "
            f'315) from which the default fold law locks, {how}: take fold_law = "linear", or '
            '"enhanced" with other angles',
            "laws.md#hinges",
            ModelRangeWarning,
        )


def _doubts(pattern: Pattern, sheet: Sheet, options: ModelOptions, folds: NDArray) -> Iterator[str]:
    rigid = list(rigid_panels(options.rigid, len(pattern.faces)))
    bent = ~np.isin(pattern.crease_faces, rigid).any(axis=1)
    stiff = np.where(bent, _relative_stiffness(pattern, sheet, folds), 0.0)
    if stiff.max(initial=0.0) > STIFF:
        yield (
            f"crease {int(stiff.argmax())} is {stiff.max():.3g} times as stiff as its panels (k "
            f"w/G, at most {STIFF:g}): the sheet bends across it as one plate, which this model "
            f"gets 5 to 20 % wrong, and more in strips: {SHELL}"
        )
    if options.scheme == "n5b8e":
        thick = _slenderness(pattern, sheet, pattern.welds, pattern.weld_faces)
        if thick.max(initial=0.0) > FOLDED:
            a, b = pattern.welds[thick.argmax()].tolist()
            yield (
                f"weld ({a}, {b}) is folded, and the sheet thick there (t/(L sin fold) = "
                f"{thick.max():.2g}, at most {FOLDED:g}): modes in which it bows come out 5 to 90 "
                f"% too high: {SHELL}"
            )
        return
    strips = stiff * _strips(pattern)
    if strips.max(initial=0.0) > STIFF_STRIP and stiff.max() <= STIFF:
        yield (
            f"crease {int(strips.argmax())} is {strips.max():.2g} times as stiff as its panels (k "
            f"w/G, at most {STIFF_STRIP:g} where creases do not meet): strips bend 5 to 50 % too "
            f"stiffly or softly: {GIVING}"
        )
    least, panel = _smallest_corner(pattern, rigid)
    if least < SKEW:
        yield (
            f"panel {panel} has a corner of {least:.3g} degrees (at least {SKEW:g}): skew panels "
            f"twist up to 40 % too stiffly or softly: {GIVING}"
        )
    thick = bent * _slenderness(pattern, sheet, pattern.creases, pattern.crease_faces)
    if thick.max(initial=0.0) > FLAT and pattern.boards is None:  # their planes are no panels
        yield (
            f"crease {int(thick.argmax())} is nearly flat, or closed (t/(L sin fold) = "
            f"{thick.max():.2g}, at most {FLAT:g}): it bows, which this model does not allow, "
            f"and half the modes are more than 5 % off: {GIVING}"
        )
    if options.clamped and len(pattern.faces) <= FEW:
        yield f"clamped edges: modes come out 4 to 20 % too low: {GIVING}"


def _relative_stiffness(pattern: Pattern, sheet: Sheet, folds: NDArray) -> NDArray[np.float64]:
    """k w/G of creases (nf,), with w and G the mean width and modulus of adjacent panels."""
    modulus = sheet.values("bending_modulus", len(pattern.faces))[pattern.crease_faces]
    length = lengths(pattern.vertices, pattern.creases)
    width = pattern.face_areas[pattern.crease_faces] / length[:, None]
    return np.round(folds / length * (width / modulus).mean(axis=1), DIGITS)


def _strips(pattern: Pattern) -> NDArray[np.bool_]:
    """Mask (nf,) of creases that meet no other, of non-square panels with two creases."""
    count = np.bincount(pattern.creases.ravel(), minlength=len(pattern.vertices))
    alone = (count[pattern.creases] == 1).all(axis=1)
    length = lengths(pattern.vertices, pattern.creases)
    aspect = pattern.face_areas[pattern.crease_faces].max(axis=1) / length**2
    between = (np.bincount(pattern.crease_faces.ravel())[pattern.crease_faces] > 1).any(axis=1)
    return alone & between & ((aspect > SQUARE) | (aspect < 1.0 / SQUARE))


def _smallest_corner(pattern: Pattern, rigid: Collection[int]) -> tuple[float, int]:
    """Smallest corner (degrees) of quadrilateral panels that bend, and the panel."""
    least, panel = np.inf, -1
    for k, face in enumerate(pattern.faces):
        if len(face) != 4 or k in rigid:
            continue
        x = pattern.vertices[list(face)]
        ahead, back = np.roll(x, -1, axis=0) - x, np.roll(x, 1, axis=0) - x
        size = np.linalg.norm(ahead, axis=1) * np.linalg.norm(back, axis=1)
        angle = np.degrees(np.arccos(((ahead * back).sum(axis=1) / size).clip(-1.0, 1.0).max()))
        if angle < least:
            least, panel = float(angle), k
    return round(least, DIGITS), panel


def _slenderness(
    pattern: Pattern, sheet: Sheet, edges: NDArray, faces: NDArray
) -> NDArray[np.float64]:
    """t/(L sin fold) of edges (k, 2) between two panels (k, 2); 0 if these are coplanar."""
    thickness = sheet.values("thickness", len(pattern.faces))[faces].max(axis=1, initial=0.0)
    sine = np.linalg.norm(np.cross(*pattern.face_normals[faces].transpose(1, 0, 2)), axis=1)
    across = lengths(pattern.vertices, edges) * sine
    share = np.divide(thickness, across, out=np.zeros(len(edges)), where=sine > SMOOTH)
    return share.round(DIGITS)
