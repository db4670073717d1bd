"""Bands that follow the shapes of their waves from one phase to the next."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from foldyn.linear.bloch import Bloch


def tracked(bloch: Bloch, phases: NDArray, waves: Sequence[Any]) -> list[Any]:
    """Waves (n phases) in the order in which their shapes go on.

    The waves of neighboring phases are paired so that the sum of their MAC, with the mass for a
    weight, is greatest. Bands that leave the lowest ones at a crossing with one above end there.
    """
    out, before = [], None
    for phase, each in zip(phases, waves, strict=True):
        if before is not None:
            mass = bloch.mass.sparse_at(bloch.factors(phase))
            overlap = np.abs(before.conj().T @ (mass @ each.shapes)) ** 2
            order = linear_sum_assignment(overlap, maximize=True)[1]
            each = type(each)(each.values[order], each.shapes[:, order])
        before = each.shapes
        out.append(each)
    return out
