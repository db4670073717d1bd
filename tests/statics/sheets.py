"""The specimen of the paper and other sheets that the tests of statics share."""

from __future__ import annotations

import numpy as np

import foldyn as fd

TOP, BOTTOM = list(range(7)), list(range(56, 63))
HEIGHT = 0.10048  # m
STROKE = 0.056  # m


def specimen(rest="stress_free", **model):
    """The specimen of section 7 of the design: Canson paper, 4 x 3 cells, tilt 70.40 degrees.

    Half a cell is s = 12.56 mm long: with s = b t / sqrt(1 + t^2) and t = cos(tilt) tan(60).
    """
    t = np.tan(np.arcsin(HEIGHT / 8 / 0.025))
    tilt = np.degrees(np.arccos(t / np.tan(np.radians(60))))
    pattern = fd.patterns.miura(
        cells=(4, 3), a=0.025, b=0.025, panel_angle=60, dihedral=180 - 2 * tilt
    )
    sheet = fd.Sheet(1219e6, 0.2, 0.24e-3, 667.0, 2.7)
    law = fd.EnhancedLinear(75, 285, rest=rest)
    return fd.discretize(pattern, sheet, fold_law=law, **model, preset="herkal")


def ideal_supports():
    """Row 8 held along x, otherwise free to slide: no mechanism, nothing held twice."""
    return [fd.Fix(BOTTOM, "x"), fd.Fix([59], "y"), fd.Fix([57, 59, 61], "z")]


def compression(rest="stress_free", weight=False, stroke=STROKE, **model):
    """The specimen pressed together by its top row, which stays straight."""
    loads = [fd.Gravity((9.81, 0, 0))] if weight else []
    supports = [*ideal_supports(), fd.Impose(TOP, "x", stroke)]
    return fd.Case(specimen(rest, **model), supports, loads)


def total_force(path, nodes=TOP, axis="x"):
    """Sum (N) of the reactions of some nodes along an axis, at each point of a path."""
    chosen = path.support_node.isin(nodes).values & (path.support_axis.values == axis)
    return path.reaction.values[:, chosen].sum(axis=1)


def imbalance(case, path, step=-1):
    """Resultant force and moment of loads and reactions on the deformed structure.

    As fractions of the sums of their magnitudes.
    """
    s = case.structure
    x = s.nodes + path.displacement.values[step]
    forces = np.zeros_like(x)
    for vector, _ in case.load_terms:
        forces += float(path.load_factor[step]) * vector
    np.add.at(
        forces,
        (path.support_node.values, [{"x": 0, "y": 1, "z": 2}[a] for a in path.support_axis.values]),
        path.reaction.values[step],
    )
    moments = np.cross(x - x.mean(axis=0), forces)
    return (
        np.abs(forces.sum(axis=0)).max() / np.abs(forces).sum(),
        np.abs(moments.sum(axis=0)).max() / np.abs(moments).sum(),
    )
