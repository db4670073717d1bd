"""`Diagnosis`: assumptions, repairs and doubts from reading a pattern."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from foldyn.patterns.flat_foldability import FlatFoldability
from foldyn.patterns.topology import Edge

ROUNDING = np.radians(0.1)
"""Error of angles (rad) due to the digits of a file."""
MOST_ROWS = 30
MOST_MOVED = 10
CONDITIONS = ("Maekawa", "Kawasaki", "not developable")
LISTED = 1e-9
"""Smallest move of a vertex (m) that is reported."""


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Diagnosis of a read pattern; `str` is the text of ``foldyn convert --check``.

    Attributes
    ----------
    size : tuple of float
        Extent of the sheet along x, y and z (m).
    assumptions : tuple of str
        What was assumed because the file does not say it, such as its unit or the meaning of
        colors.
    repairs : tuple of str
        What was repaired.
    doubts : tuple of str
        What may not be as intended.
    vertices : FlatFoldability
        Maekawa's and Kawasaki's conditions at interior vertices.
    facets : tuple of pairs of int
        Flat creases that the file itself assigns "F", which are not meant to fold.
    moves : ndarray, shape (n,)
        Distance (m) that each vertex was moved, or would be moved by ``flat_foldable=True``, to
        fold flat; empty if none needs to move.
    """

    size: tuple[float, float, float]
    assumptions: tuple[str, ...]
    repairs: tuple[str, ...]
    doubts: tuple[str, ...]
    vertices: FlatFoldability
    facets: tuple[Edge, ...]
    moves: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))

    def __str__(self) -> str:
        """Text of several lines."""
        lines = ["size: " + " x ".join(f"{length:.4g}" for length in self.size) + " m"]
        for title in ("assumptions", "repairs", "doubts"):
            told = getattr(self, title)
            lines += [f"{title}: none"] if not told else [f"{title}:", *(f"  {t}" for t in told)]
        return "\n".join(lines + self._move_lines() + self._vertex_lines())

    def _move_lines(self) -> list[str]:
        """How many vertices move to fold flat, and the largest moves."""
        number = int((self.moves > LISTED).sum())
        if not number:
            return []
        order = np.argsort(-self.moves, kind="stable")[: min(number, MOST_MOVED)]
        shown = ", ".join(f"{v} by {1e6 * self.moves[v]:.3g}" for v in order.tolist())
        least = f"; the {MOST_MOVED} that move most" if number > MOST_MOVED else ""
        return [f"vertices moved, or to be moved, to fold flat: {number}{least} (um): {shown}"]

    def _vertex_lines(self) -> list[str]:
        """Table of interior vertices, starting with those that cannot fold flat."""
        v = self.vertices
        maekawa, kawasaki = v.maekawa, v.kawasaki(ROUNDING)
        developable = v.developable(ROUNDING)
        good = maekawa & kawasaki & developable
        lines = [
            f"vertices inside: {len(good)}; Maekawa holds at {maekawa.sum()}, Kawasaki at "
            f"{kawasaki.sum()}, developable {developable.sum()} (within "
            f"{np.degrees(ROUNDING):g} degrees)"
        ]
        if not len(good):
            return lines
        lines.append("  vertex creases     M     V     U  Kawasaki   deficit  (sums, degrees)")
        for k in np.argsort(good, kind="stable")[:MOST_ROWS].tolist():
            holds = zip(CONDITIONS, (maekawa[k], kawasaki[k], developable[k]), strict=True)
            faults = [name for name, held in holds if not held]
            deficit = round(float(np.degrees(v.deficits[k])), 3) + 0.0  # avoid -0
            alternating = "odd" if v.degrees[k] % 2 else f"{np.degrees(v.alternating[k]):.3f}"
            lines.append(
                f"{v.vertices[k]:8d}{v.degrees[k]:8d}{v.mountains[k]:6d}{v.valleys[k]:6d}"
                f"{v.unassigned[k]:6d}{alternating:>10}{deficit:10.3f}"
                + (f"  {', '.join(faults)}" if faults else "")
            )
        if len(good) > MOST_ROWS:
            left = len(good) - MOST_ROWS
            lines.append(f"  ... and {left} more, {good.sum()} in all without fault")
        return lines
