"""The instant at which a held specimen is let go, in the record of one node."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError

HELD = 0.0125  # s, for which it must have been still before
AVERAGED = 0.05  # s, over which the held position is averaged
STILL = 0.05  # part of its way by which it may wander while it is held
SLOW = 0.1  # part of its largest speed below which it has not been let go yet
FEWEST = 8  # samples


def release_of(x: NDArray[np.float64], step: float, name: str) -> tuple[int, int]:
    """Find the release: where the fastest motion of a record begins.

    Parameters
    ----------
    x : ndarray, shape (n,)
        Record of a node, NaN where it was lost.
    step : float
        Sampling interval (s).
    name : str
        Of the record, for messages.

    Returns
    -------
    first, released : int
        Samples between which the node is held: since when it has been still, and the last one
        before it is let go.

    Raises
    ------
    InputError
        Too few samples, or the node is not still before it moves.
    """
    known = np.flatnonzero(np.isfinite(x))
    if known.size < FEWEST:
        raise InputError(f"{name} was measured in {known.size} frames; at least {FEWEST} needed")
    speed = np.diff(x[known]) / np.diff(known)
    k = int(np.argmax(np.abs(speed)))
    least, sign = SLOW * abs(speed[k]), np.sign(speed[k])
    while k > 0 and sign * speed[k - 1] > least:
        k -= 1
    released = int(known[k])
    wander = np.abs(x[: released + 1] - x[released])
    moving = np.flatnonzero(wander > STILL * np.abs(x[known[k:]] - x[released]).max())
    first = max(int(moving[-1]) + 1 if moving.size else 0, released - round(AVERAGED / step))
    if (released - first) * step < HELD:
        raise InputError(
            f"{name} is not still for {HELD:g} s before it moves fastest, {released * step:.3g} s "
            "after the beginning: so the press before the release is unknown; give a film that "
            "begins while the specimen is held"
        )
    return first, released
