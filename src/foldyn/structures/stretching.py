"""Whether a result rests on how panels stretch in their plane, which models get only roughly.

A panel's bars are right in uniform strain at most, and too stiff in all else. Coupled ones have the
panel's membrane, but edges that are straight: too stiff, too, where most energy is in the plane.
With the scheme n5b8e edges give way, which is right in open sheets; closed ones, and sheets with
welds, are off by 5 to 20 % there, either way (docs/models.md, "Where panels stretch").
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.structures.discretized import Discretized

BARS = "strain_bars"
SINGLE, TRIANGLES, COUPLED, GIVING = 0.05, 0.1, 0.3, 0.5
"""Shares of the strain energy above which it is told: with single bars; with coupled ones of
triangles, and of other panels; and where edges give way. Measured with the mixed sets of
docs/fidelity.md."""
LEAST = 1e-9  # mean strain of the bars, below which rounding may be all there is
FELT = 1e-3  # of the kinetic energy: less strain energy does not matter to a motion
SHELL = "compare with the shell (foldyn fidelity, fd.fidelity) or take it (--model shell, fd.shell)"


class Stretch(NamedTuple):
    """State with the largest strain energy: its number, and the share that stretching has in it."""

    at: int
    share: float


def most(structure: Discretized) -> float:
    """Share of the strain energy that stretching may have before a result is doubtful.

    Infinite of structures made by hand, of shells, and of open sheets whose edges give way.
    """
    pattern = structure.pattern
    if BARS not in structure.energy_groups or pattern is None:
        return np.inf
    if not getattr(structure, "membranes", ()):
        return SINGLE
    if getattr(structure, "edge_gives", None) is not None:
        corners = {vertex for face in pattern.faces for vertex in face}
        closed = len(corners) - len(pattern.edges) + len(pattern.faces) < 1
        return GIVING if closed or len(pattern.welds) else np.inf
    return TRIANGLES if all(len(face) == 3 for face in pattern.faces) else COUPLED


def remedy(structure: Discretized) -> str:
    """What to do where stretching has more than that share: the end of a message."""
    if not getattr(structure, "membranes", ()):
        return f'where single bars are far too stiff: take membrane = "panel", or {SHELL}'
    if getattr(structure, "edge_gives", None) is None:
        return (
            'where edges that stay straight can be too stiff: take preset = "n5b8e" (and straight '
            f"= edges held along their length), or {SHELL}"
        )
    return f"where closed and welded sheets are often 5 to 20 % off: {SHELL}"


def stretch(structure: Discretized, energies: Mapping[str, NDArray]) -> Stretch | None:
    """What stretching holds in states with these energies (k,), J, by name; None if that is little.

    Nor is it told of motions that hardly strain the structure: `kinetic` is among theirs.
    """
    limit = most(structure)
    if not np.isfinite(limit) or not np.size(energies[BARS]):
        return None
    bars = np.nan_to_num(energies[BARS])
    total = np.nan_to_num(np.sum([energies[name] for name in structure.energy_groups], axis=0))
    at = int(total.argmax())
    kinetic = np.nan_to_num(energies.get("kinetic", np.zeros(1))).max()
    felt = max(FELT * kinetic, LEAST**2 * _tension(structure) @ structure.bar_length**2)
    if bars[at] <= max(limit * total[at], felt):
        return None
    return Stretch(at, float(bars[at] / total[at]))


def stretching(structure: Discretized, displacement: NDArray, motions: NDArray) -> NDArray:
    """Twice the energy (k,), J, of stretching in small motions (m, k) about a state (n, 3)."""
    body = structure.body
    q, hinges = body.dofs(displacement), body.hinges_alone
    matrix = body.tangent(q)
    if hinges is not None:
        matrix = matrix - hinges.tangent(q)
    own = motions[: body.size]
    return np.einsum("ik,ik->k", own.conj(), matrix @ own).real


def _tension(structure: Any) -> NDArray:
    """Stiffness (nb,) of the bars, N/m."""
    return structure.sheet.youngs_modulus * structure.bar_area / structure.bar_length
