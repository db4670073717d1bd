"""Limits of values that two meshes have (Richardson's extrapolation).

An error of the order h^2, h the size of the pieces, is told by two meshes: with N and M < N pieces
of every edge, f_N + (f_N - f_M) / ((N/M)^2 - 1) is the limit.
"""

from __future__ import annotations

from typing import Any


def extrapolated(coarse: Any, fine: Any, ratio: float) -> Any:
    """What values tend to that two meshes have, the fine one with `ratio` times the divisions."""
    return fine + (fine - coarse) / (ratio**2 - 1.0)
