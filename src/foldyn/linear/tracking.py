"""Bands that follow the shapes of their waves from one phase to the next."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from foldyn.linear.bloch import Bloch
from foldyn.linear.group_velocity import Waves, separated


def tracked(bloch: Bloch, phases: NDArray, waves: Sequence[Waves]) -> list[Waves]:
    """Waves of phases (n, d), sorted so that their shapes continue.

    The waves of neighboring phases are paired so that the sum of their mass-weighted MAC is
    greatest; waves of equal frequency are first combined as they continue along the step between
    the phases. Bands that leave the lowest ones, at a crossing with one above, end there.
    """
    from scipy.optimize import linear_sum_assignment

    out = [waves[0]]
    for k in range(1, len(waves)):
        way = phases[k] - phases[k - 1]
        before = separated(bloch, phases[k - 1], out[-1], way)
        here = separated(bloch, phases[k], waves[k], way)
        overlap = np.abs(before.shapes.conj().T @ here.momentum) ** 2
        out.append(here.ordered(linear_sum_assignment(overlap, maximize=True)[1]))
    return out
