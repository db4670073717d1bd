"""How a motion starts, as a case file says it: as a rigid body, or from a stored result."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from foldyn.cases.case import Case
from foldyn.cases.state import State
from foldyn.cases.supports import AXES
from foldyn.errors import InputError
from foldyn.values import show

TOLERANCE = 1e-9
"""Velocity of a supported node, relative to the largest, that counts as rounding."""

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Initial:
    """A start of a motion that is not rest.

    Attributes
    ----------
    velocity : tuple of float or None
        Translation (m/s).
    spin : tuple of float or None
        Rotation (rad/s) about the center of mass.
    file : str or None
        Result from which the motion goes on instead, relative to the case file's folder.
    at : int
        Number of its sample; negative ones count from the end.
    """

    velocity: Vector | None = None
    spin: Vector | None = None
    file: str | None = None
    at: int = -1


def rigid_motion(case: Case, start: Initial) -> State:
    """State at rest in shape, with the velocities of a rigid body.

    v = velocity + spin x (x - center), with the center of the nodes' masses at rest.

    Raises
    ------
    InputError
        A support holds a node that would move.
    """
    x = case.structure.nodes
    mass = np.asarray(case.structure.mass.sum(axis=1)).ravel()
    arm = x - mass @ x / mass.sum()
    velocity = np.array(start.velocity or (0.0, 0.0, 0.0)) + np.cross(start.spin or (0, 0, 0), arm)
    speed = np.abs(velocity)
    held = np.argwhere(case.fixed & (speed > TOLERANCE * speed.max()))
    if held.size:
        node, axis = held[0].tolist()
        given = " and ".join(
            f"{name} = {show(value)}"
            for name, value in (("velocity", start.velocity), ("spin", start.spin))
            if value is not None
        )
        raise InputError(
            f"{given}: moves node {node} along {AXES[axis]} with {velocity[node, axis]:.4g} m/s, "
            "where a support holds it; free this node, or start from another motion"
        )
    velocity[case.fixed] = 0.0
    return State(velocity=velocity)
