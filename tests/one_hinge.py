"""A single hinge along y, whose wing moves along z, and a mass beside it that is always free."""

from __future__ import annotations

import numpy as np

import foldyn as fd
from foldyn.structures import ModelOptions

STIFFNESS = 0.02  # N m/rad
WING = 3


def one_hinge(law, supports=(), loads=(), mass=1e-3, damping=None, hold=True):
    """The case; the wing, 1 m from the hinge, is held along z unless `hold` is False."""
    nodes = np.array([[0, 0, 0], [0, 1, 0], [-1, 0.5, 0], [1, 0.5, 0], [0, -1, 0]], float)
    structure = fd.Structure(
        nodes=nodes,
        bars=np.array([[0, 4]]),
        bar_area=np.array([1e-4]),
        sheet=fd.Sheet(1e3, 0.3, 0.01),
        options=ModelOptions(fold_law=law, bar_law="linear"),
        folds=np.array([[0, 1, 2, WING]]),
        fold_stiffness=np.array([STIFFNESS]),
        fold_rest=np.array([np.pi]),
        node_mass=np.array([1.0, 1.0, 1.0, mass, 1.0]),
    )
    held = [fd.Fix([0, 1, 2], "xyz"), fd.Fix([WING], "xy"), fd.Fix([4], "xz"), *supports]
    if hold:
        held.append(fd.Fix([WING], "z"))
    return fd.Case(structure, held, list(loads), damping or fd.Rayleigh())


def turned(angle):
    """Displacements (5, 3) with the wing turned by an angle (rad)."""
    u = np.zeros((5, 3))
    u[WING, 2] = np.tan(angle)
    return u


def opened(result):
    """Turn (nt,) of the hinge from rest, rad, in the direction of the wing's motion along z."""
    return np.arctan(result.displacement.sel(node=WING, axis="z").values)


def moment(result):
    """Moment (nt,) of the hinge, N m, from the reaction of the wing."""
    support = (result.support_node == WING) & (result.support_axis == "z")
    force = result.reaction.values[:, np.flatnonzero(support)[0]]
    return force * (1.0 + np.tan(opened(result)) ** 2)
