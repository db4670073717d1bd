"""Warnings of patterns beyond the range of bars and hinges, and of implausible sheets.

Such patterns are computed all the same. Beyond the limits used here, frequency errors relative to
the shell exceed 5 to 10 % (docs/fidelity.md, "Beyond the range"). Above a certain frequency panels
vibrate as plates, independent of their creases. Panels that meet pass through each other unless the
law of their hinge locks.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import ModelRangeWarning, UnitsWarning, warn
from foldyn.materials import EnhancedLinear, HingeLaw
from foldyn.patterns import Pattern
from foldyn.patterns.topology import Lines
from foldyn.structures.discretized import Discretized
from foldyn.structures.fold_law import OTHERS
from foldyn.structures.mesh import double_areas, lengths
from foldyn.structures.rigid_plates import rigid_panels
from foldyn.structures.sheet import Sheet
from foldyn.structures.structure import ModelOptions

STIFF = 3.0  # largest k w/G of creases between panels of width w: beyond, both bend as one plate
STIFF_STRIP, SQUARE = 0.3, 1.4  # largest k w/G in strips; largest aspect ratio of a square panel
FEW = 16  # with at most this many panels, a sheet with clamped edges is inaccurate
SKEW = 33.0  # degrees, smallest corner of a quadrilateral panel
FOLDED = 0.05  # largest t/(L sin fold) of welds: above it they bow, but not in the model
FLAT = 0.15  # largest t/(L sin fold) of creases
LOCKING = 1.1  # stiffness, relative to between the locking angles: frequencies rise by 5 %
SHUT = 100.0  # relative stiffness above which the panels at a crease move as one
SMOOTH = 1e-3  # rad: a fold with a smaller angle counts as flat
DIGITS = 6  # decimals in comparisons, so that rounding does not exceed limits
TURN = 5.0  # degrees by which panels of a linear model may turn: its strains are off by 0.4 %
LINEAR = "take superelements (fd.superelements, --model superelements)"
SHELL = f"{LINEAR} in linear analyses, else the shell, fd.shell"
GIVING = f'{LINEAR} in linear analyses, else preset = "n5b8e"'


def doubt_range(pattern: Pattern, sheet: Sheet, options: ModelOptions, folds: NDArray) -> None:
    """Warn of patterns beyond the range of the model.

    folds : stiffness (nf,) of the creases alone, N m/rad.
    """
    if options.calibration != "plate":  # published models are taken as they are
        return
    for text in _doubts(pattern, sheet, options, folds):
        warn(text, "fidelity.md#beyond-the-range", ModelRangeWarning)


def panel_turns(structure: Discretized, displacement: NDArray) -> NDArray[np.float64]:
    """Largest turns (k,) of the panels, degrees, at displacements (k, n, 3)."""
    normals = [double_areas(structure.nodes + u, structure.triangles) for u in (0.0, *displacement)]
    rest, *moved = (n / np.linalg.norm(n, axis=1, keepdims=True) for n in normals)
    apart = np.array([np.linalg.norm(normal - rest, axis=1).max() for normal in moved])
    return np.degrees(2.0 * np.arcsin(0.5 * apart))


def far_turn(structure: Discretized, turn: float, where: str) -> str:
    """Warning that panels of a linear model turn too far, in degrees, at a point of a result."""
    return (
        f"panels turn by {turn:.2g} degrees at {where}, and {structure.linear} are linear: reduce "
        "the loads, or take bars and hinges or the shell"
    )


def doubt_locking(structure: Discretized) -> None:
    """Warn of creases whose rest angle lies in the locking range of the default fold law."""
    given, rest, default = structure.options.fold_law, structure.fold_rest, EnhancedLinear()
    usual = given.get(OTHERS) if isinstance(given, Mapping) else given
    if usual != default or not len(rest):
        return
    stiffer = structure.fold_law.each(
        lambda own, rows: default.slope(rest[rows], rest[rows]) * float(own == default)
    )
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
                f"{thick.max():.2g}, at most {FOLDED:g}): modes in which it bows come out up to 20 "
                f"% too high, and more with facets longer than wide: {SHELL}"
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
    if thick.max(initial=0.0) > FLAT and pattern.boards is None:  # planes of boards are no panels
        yield (
            f"crease {int(thick.argmax())} is nearly flat, or closed (t/(L sin fold) = "
            f"{thick.max():.2g}, at most {FLAT:g}): it bows, which this model does not allow, "
            f"and half the modes are more than 5 % off: {GIVING}"
        )
    if options.clamped and len(pattern.faces) <= FEW:
        yield f"clamped edges: modes come out 4 to 20 % too low: {GIVING}"


def _relative_stiffness(pattern: Pattern, sheet: Sheet, folds: NDArray) -> NDArray[np.float64]:
    """k w/G (nf,) of creases, with w and G the mean width and modulus of adjacent panels."""
    modulus = sheet.values("bending_modulus", len(pattern.faces))[pattern.crease_faces]
    length = lengths(pattern.vertices, pattern.creases)
    width = pattern.face_areas[pattern.crease_faces] / length[:, None]
    return np.round(folds / length * (width / modulus).mean(axis=1), DIGITS)


def _strips(pattern: Pattern) -> NDArray[np.bool_]:
    """Mask (nf,) of creases that meet no others, at non-square panels with two or more creases."""
    lines = Lines.of(pattern.creases)
    count = np.bincount(pattern.creases[lines.first].ravel(), minlength=len(pattern.vertices))
    alone = (count[pattern.creases] == 1).all(axis=1)
    length = lengths(pattern.vertices, pattern.creases)
    aspect = pattern.face_areas[pattern.crease_faces].max(axis=1) / length**2
    sides = np.stack([pattern.crease_faces.ravel(), np.repeat(lines.number, 2)], axis=1)
    creased = np.bincount(np.unique(sides, axis=0)[:, 0], minlength=len(pattern.faces))
    between = (creased[pattern.crease_faces] > 1).any(axis=1)
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
    """t/(L sin fold) of edges (k, 2) between pairs of panels (k, 2); 0 between coplanar panels."""
    thickness = sheet.values("thickness", len(pattern.faces))[faces].max(axis=1, initial=0.0)
    sine = np.linalg.norm(np.cross(*pattern.face_normals[faces].transpose(1, 0, 2)), axis=1)
    across = lengths(pattern.vertices, edges) * sine
    return np.divide(thickness, across, out=np.zeros(len(edges)), where=sine > SMOOTH).round(DIGITS)


THICK = 0.2  # largest thickness of a thin sheet, relative to the shortest edge of a panel
THIN, WIDE = 5e-5, 2.0  # thickness/shortest edge, and that edge, m: limits of sails
SLAB = 0.1  # m: a sheet that folds is thinner than this
SLOWEST, FASTEST = 10.0, 25e3  # m/s, sqrt(E / rho): from soft gels to diamond
USUAL = 2000.0  # m/s, a usual wave speed
PRESSURES = {"kPa": 1e3, "MPa": 1e6, "GPa": 1e9}
DENSITIES = {"g/cm3": 1e3, "t/mm3": 1e12}


def doubt_units(pattern: Pattern, sheet: Sheet) -> None:
    """Warn of a thickness or a wave speed that no sheet with such panels has."""
    for text in _unit_doubts(pattern, sheet):
        warn(text, "sheets.md#units", UnitsWarning)


def _unit_doubts(pattern: Pattern, sheet: Sheet) -> Iterator[str]:
    count, shortest = len(pattern.faces), np.array([sides.min() for sides in pattern.sides])
    thickness = sheet.values("thickness", count)
    thick = thickness / shortest
    worst = int(thick.argmax())
    if thick[worst] > THICK:
        yield (
            f"sheet: thickness = {thickness[worst]:g} m is {thick[worst]:.2g} times the shortest "
            f"edge of panel {worst}, {shortest[worst]:.3g} m, and not a thin sheet (at most "
            f"{THICK:g}): lengths are in m; if the thickness is meant in mm, give "
            f"{1e-3 * thickness[worst]:g}"
        )
    elif thickness.max() >= SLAB:
        yield (
            f"sheet: thickness = {thickness.max():g} m, of panels with edges of "
            f"{shortest.min():.3g} m and more, is that of a slab (less than {SLAB:g}): lengths are "
            f"in m; if those of sheet and pattern are meant in mm, give {1e-3 * thickness.max():g} "
            "and a pattern a thousand times smaller"
        )
    least = int(np.where(shortest >= WIDE, thick, np.inf).argmin())
    if thick[least] < THIN and shortest[least] >= WIDE:
        yield (
            f"pattern: panel {least} has edges of {shortest[least]:.3g} m and more and is "
            f"{thickness[least]:g} m thick, below 1/{1.0 / THIN:.0f} of that: lengths are in m; "
            "if those of the pattern are meant in mm, make it a thousand times smaller"
        )
    modulus, density = (sheet.values(name, count) for name in ("modulus", "density"))
    speed = np.sqrt(modulus / density)  # nan without density
    wrong = np.flatnonzero((speed < SLOWEST) | (speed > FASTEST))
    if len(wrong):
        k = int(wrong[0])
        yield (
            f"sheet: youngs_modulus = {modulus[k]:g} Pa with density = {density[k]:g} kg/m3: sound "
            f"would travel at {speed[k]:.3g} m/s in it, but does so at {SLOWEST:g} to {FASTEST:g} "
            f"m/s in all materials; {_meant(modulus[k], density[k], speed[k])}"
        )


def _meant(modulus: float, density: float, speed: float) -> str:
    """Suggestion for values that give the wave speed of usual materials."""
    slow = speed < SLOWEST
    factors = PRESSURES if slow else DENSITIES

    def off(unit: str) -> float:
        return abs(np.log(speed / USUAL) + (0.5 if slow else -0.5) * np.log(factors[unit]))

    unit = min(factors, key=off)
    name, value = ("youngs_modulus", modulus) if slow else ("density", density)
    return f"if {name} is meant in {unit}, give {value * factors[unit]:g}"


NEARLY = 1e-9  # rad from the closed state
BOUND = 1e3  # moment / k: at this angle, only an unbounded law exceeds it


def locks(law: HingeLaw) -> bool:
    """Whether the moment of a law grows without bound as panels meet."""
    nearly = np.array([NEARLY, 2.0 * math.pi - NEARLY])
    return all((np.abs(own.moment(nearly, math.pi)) > BOUND).all() for own, _ in law.parts)


def kept_apart(structure: Discretized, one: int, other: int) -> str:
    """How to keep the panels at the hinge between two nodes apart, in words.

    The energy of a locking law grows slowly (with EnhancedLinear, like the logarithm of the angle):
    panels that are pushed hard pass through each other, however small the steps.
    """
    ends = {one, other}
    creases = structure.edge_nodes[: len(Lines.of(structure.pattern.creases).first)].tolist()
    fold = any(ends == {*pair} for row in creases for pair in pairwise(row) if ends & {*row})
    kind = "fold" if fold else "bend"
    law = structure.fold_law if fold else getattr(structure, "bend_law", None)
    if law is None:
        return "push the panel less, or more slowly: nothing but its stiffness resists"
    if locks(law):
        return (
            f"the law of this {kind} ({law.name}) locks, but is overcome, and would be with any "
            "step: push less, or more slowly, end before panels meet, or give the case contact: "
            "fd.Contact()"
        )
    return (
        f"a law that locks ({kind}_law = 'enhanced', EnhancedLinear) keeps panels apart, unless "
        "they are pushed hard; contact, fd.Contact(), does however hard"
    )


FIRST_OF_A_SQUARE = 13.47  # omega L^2 sqrt(rho t/G) of a free square plate, nu = 0.3 (Leissa 1973)
BELOW = 0.6  # bars and hinges have the sheet's modes up to this fraction of plate_frequency
N5B8E = 0.8  # the same for n5b8e


def plate_frequency(pattern: Pattern, sheet: Sheet, rigid: Collection[int] = ()) -> float:
    """First frequency (Hz) of a free square plate as large as a panel.

    The side is the panel's longest edge, or the square root of its area if that is longer, as in
    panels with five or more corners. Returns the lowest frequency of all panels that are not rigid;
    inf if all are rigid, nan for a sheet without density.
    """
    count = len(pattern.faces)
    speed = (sheet.values("bending_modulus", count) / sheet.values("areal_density", count)) ** 0.5
    longest = np.array([sides.max() for sides in pattern.sides])
    side2 = np.maximum(longest**2, pattern.face_areas)
    frequency = FIRST_OF_A_SQUARE / (2.0 * np.pi) * speed / side2
    return float(np.delete(frequency, list(rigid)).min(initial=np.inf))


def range_of(structure: Discretized) -> tuple[float, float]:
    """Frequency (Hz) up to which a model has the sheet's modes; its ratio to `plate_frequency`.

    Both are inf for shells and for structures made by hand.
    """
    if structure.kind != "bars_and_hinges" or structure.pattern is None:
        return np.inf, np.inf
    share = N5B8E if structure.options.scheme == "n5b8e" else BELOW
    rigid = rigid_panels(structure.options.rigid, len(structure.pattern.faces))
    return share * plate_frequency(structure.pattern, structure.sheet, rigid), share
