"""What pages and figures show of measurements."""

from __future__ import annotations

import numpy as np

from foldyn.cases import Case
from foldyn.cases.directions import AXES
from foldyn.experiment.calibration.measured import ForceDisplacement, Shapes

MOST = 8
"""Nodes, and shapes, that are shown at most."""
POINTS = 25
"""Points of the curve through measured forces."""


def dense(one: ForceDisplacement) -> ForceDisplacement:
    """The same test at more displacements, from 0 to beyond the measured ones, for a curve."""
    ends = min(0.0, one.displacement.min()), max(0.0, one.displacement.max())
    return one.at(np.union1d(np.linspace(*ends, POINTS), one.displacement))


def plane(one: Shapes, case: Case) -> tuple[int, int]:
    """Indices in `axes` of the directions that pictures have across and upwards.

    They are those along which the nodes lie farthest apart.
    """
    rest = case.structure.nodes[one.where(case)]
    spans = [np.ptp(rest[:, AXES.index(axis)]) for axis in one.axes]
    first, second = sorted(np.argsort(spans)[-2:].tolist())
    return (second, first) if one.axes[first] == "x" else (first, second)
