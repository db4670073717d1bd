"""The next step of a motion that chooses its steps by their error."""

from __future__ import annotations

SAFETY = 0.9
GROWTH = 2.0  # of a step at most
WORTHWHILE = 1.25  # growth below which the step, and with it the matrix, is kept
NEAR, CUT = 0.95, 0.85  # below which the error is about to be too large, and what is done then
LEAST = 0.2  # share of a refused step that is tried next, at least


MEMORY = 0.9  # share of an error that counts a step later


def remembered(error: float, before: float, h: float, h_before: float) -> float:
    """Error by which the next step is chosen, for a step h (s) after one of `h_before`.

    The error of a vibration vanishes twice in each period; the ones before still count then.
    """
    return max(error, MEMORY * before * (h / h_before) ** 3)


def next_step(h: float, error: float) -> float:
    """Step after an accepted one of h (s) with the error, relative to the tolerance."""
    factor = GROWTH if error <= 0.0 else min(GROWTH, SAFETY * error ** (-1.0 / 3.0))
    if factor < NEAR:
        return h * CUT
    return h if factor < WORTHWHILE else h * factor


def smaller_step(h: float, error: float) -> float:
    """Step after a refused one."""
    return h * min(0.9, max(LEAST, SAFETY * error ** (-1.0 / 3.0)))
