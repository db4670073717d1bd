"""Whether a result rests on how much bars resist the stretching of panels in their plane.

A panel's bars are right in uniform strain at most. Where a sheet bends or twists as a whole its
panels shear and stretch unevenly, and bars resist that too much: structures in which they hold a
good part of the strain energy come out too stiff, by whatever preset.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.structures.discretized import Discretized

BARS = "strain_bars"
MOST = 0.05  # of the strain energy: above, it is told
LEAST = 1e-9  # mean strain of the bars, below which rounding may be all there is
FELT = 1e-3  # of the kinetic energy: less strain energy does not matter to a motion
REMEDY = (
    "panels stretch in their plane there, which bars resist too much. Couple those of each panel "
    '(membrane = "panel", and preset = "n5b8e" for towers of triangles; edges that are held or '
    "loaded along their length belong in straight), compare with the shell (foldyn fidelity, "
    "fd.fidelity), or compute it (--model shell, fd.shell)"
)


class Stretch(NamedTuple):
    """State with the largest strain energy: its number, and the share that bars hold in it."""

    at: int
    share: float


def resists_stretch(structure: Discretized) -> bool:
    """Whether bars that are too stiff stand for the panels of a pattern.

    Not those of a structure made by hand, nor coupled ones, but in towers of triangles whose
    corners do not give way.
    """
    if BARS not in structure.energy_groups or structure.pattern is None:
        return False
    coupled = getattr(structure, "membranes", ())
    if getattr(structure, "edge_gives", None) is not None:
        return False
    return not coupled or all(len(face) == 3 for face in structure.pattern.faces)


def stretch(structure: Discretized, energies: Mapping[str, NDArray]) -> Stretch | None:
    """What bars hold in states with these energies (k,), J, by name; None where that is little.

    Nor is it told of motions that hardly strain the structure: `kinetic` is among theirs.
    """
    if not resists_stretch(structure) or not np.size(energies[BARS]):
        return None
    bars = np.nan_to_num(energies[BARS])
    total = np.nan_to_num(np.sum([energies[name] for name in structure.energy_groups], axis=0))
    at = int(total.argmax())
    kinetic = np.nan_to_num(energies.get("kinetic", np.zeros(1))).max()
    felt = max(FELT * kinetic, LEAST**2 * _tension(structure) @ structure.bar_length**2)
    if bars[at] <= max(MOST * total[at], felt):
        return None
    return Stretch(at, float(bars[at] / total[at]))


def stretching(structure: Discretized, displacement: NDArray, motions: NDArray) -> NDArray:
    """Twice the energy (k,), J, that bars take in small motions (3n, k) about a state (n, 3)."""
    x = structure.nodes + displacement
    start, end = structure.bars.T
    along = x[end] - x[start]
    along /= np.linalg.norm(along, axis=1)[:, None]
    nodal = motions.reshape(len(x), 3, -1)
    longer = np.einsum("bi,bik->bk", along, nodal[end] - nodal[start])
    return _tension(structure) @ np.abs(longer) ** 2


def _tension(structure: Any) -> NDArray:
    """Stiffness (nb,) of the bars, N/m."""
    return structure.sheet.youngs_modulus * structure.bar_area / structure.bar_length
