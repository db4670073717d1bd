"""Sheets whose values are probably not in SI units: warned of, but computed."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from foldyn.errors import UnitsWarning, warn
from foldyn.patterns import Pattern
from foldyn.structures.sheet import Sheet

THICK = 0.2  # of the shortest edge of a panel: above it a sheet is not thin
THIN, WIDE = 5e-5, 2.0  # of the shortest edge, and its length, m: thin films of such size are sails
SLAB = 0.1  # m: sheets that fold are thinner
SLOWEST, FASTEST = 10.0, 25e3  # m/s, sqrt(E / rho): from soft gels to diamond
USUAL = 2000.0  # m/s
PRESSURES = {"kPa": 1e3, "MPa": 1e6, "GPa": 1e9}
DENSITIES = {"g/cm3": 1e3, "t/mm3": 1e12}


def doubt_units(pattern: Pattern, sheet: Sheet) -> None:
    """Warn of a thickness or a wave speed that no sheet with such panels has."""
    for text in _doubts(pattern, sheet):
        warn(text, "sheets.md#units", UnitsWarning)


def _doubts(pattern: Pattern, sheet: Sheet) -> Iterator[str]:
    count, shortest = len(pattern.faces), np.array([sides.min() for sides in pattern.sides])
    thickness = sheet.values("thickness", count)
    thick = thickness / shortest
    worst = int(thick.argmax())
    if thick[worst] > THICK:
        yield (
            f"sheet: thickness = {thickness[worst]:g} m is {thick[worst]:.2g} times the shortest "
            f"edge of panel {worst}, {shortest[worst]:.3g} m, which is no thin sheet (at most "
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
    modulus, density = (sheet.values(name, count) for name in ("youngs_modulus", "density"))
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
