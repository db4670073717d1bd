"""`Diagnosis`: what was assumed, repaired and doubted when a pattern was read."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Diagnosis:
    """What a reader says of a pattern; `str` is the text of ``foldyn convert --check``.

    Attributes
    ----------
    size : tuple of float
        Extent of the sheet along x, y and z (m).
    assumptions : tuple of str
        What the file does not say: its unit, what its colors mean.
    repairs : tuple of str
        What was put right.
    doubts : tuple of str
        What may not be as intended.
    """

    size: tuple[float, float, float]
    assumptions: tuple[str, ...] = ()
    repairs: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()

    def __str__(self) -> str:
        """Text of several lines."""
        lines = ["size: " + " x ".join(f"{length:.4g}" for length in self.size) + " m"]
        for title in ("assumptions", "repairs", "doubts"):
            lines += [f"{title}:", *(f"  {line}" for line in getattr(self, title) or ("none",))]
        return "\n".join(lines)
