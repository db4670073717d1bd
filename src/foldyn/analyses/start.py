"""Initial states in a case file: rigid motions, and states of stored results."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np

from foldyn.analyses.sections import Vector, Whole, result_file
from foldyn.arguments import Check
from foldyn.cases import Case, State
from foldyn.cases.directions import AXES
from foldyn.dynamics import initial_state
from foldyn.errors import InputError, within
from foldyn.results import load
from foldyn.results.contents import check_variable
from foldyn.tables import Section
from foldyn.values import show

TOLERANCE = 1e-9
"""Velocity of a supported node, relative to the largest velocity, that counts as rounding error."""


class StoredStart(Section):
    """[initial]: a state of a stored result.

    Parameters
    ----------
    file : str
        Result of the same pattern and model, relative to the case file.
    at : int
        Number of its sample; the last by default.
    """

    file: Annotated[str, Check(result_file)]
    at: Whole = -1


class MotionStart(Section):
    """[initial] of a motion: a rigid motion, or a stored state.

    Parameters
    ----------
    velocity : sequence of float, shape (3,)
        Velocity of the center of mass (m/s).
    spin : sequence of float, shape (3,)
        Angular velocity about the center of mass (rad/s).
    """

    like = (StoredStart,)

    velocity: Vector = None
    spin: Vector = None
    file: Annotated[Any, Check(result_file)] = None
    at: Whole = -1

    def agree(self) -> None:
        """Require either a rigid motion or a stored state."""
        given = self.stated
        rigid = sorted(given & {"velocity", "spin"})
        if not given:
            raise InputError(": give velocity or spin or both, or file (a result)")
        if "file" in given and rigid:
            raise InputError(
                f": holds the velocities too; leave out {' and '.join(reversed(rigid))}", "file"
            )
        if "at" in given and "file" not in given:
            raise InputError(": is the number of a sample of a result; give file too", "at")


class Start(NamedTuple):
    """A state; if it was stored, also the load factor of its folded creases, if known."""

    state: State | None = None  # rest
    load_factor: float | None = None


def start_of(section: MotionStart | StoredStart | None, case: Case, folder: Path) -> Start:
    """Start of a case from its section.

    Raises
    ------
    InputError
        A support holds a node that the rigid motion moves, or the result cannot be read or has
        other nodes. The field is inside `initial`.
    """
    if section is None:
        return Start()
    if section.file is None:
        assert isinstance(section, MotionStart)
        return Start(_rigid_motion(case, section))
    return _stored(section, case, folder)


def _stored(section: MotionStart | StoredStart, case: Case, folder: Path) -> Start:
    place = f".file = {show(section.file)}: "
    with within(place):
        result = load(folder / section.file)
    try:
        state = initial_state(result, section.at)
    except InputError as error:
        raise error.within("." if error.key == "at" else place) from None
    count = len(case.structure.nodes)
    for array in (state.displacement, state.velocity):
        if array is not None and len(np.asarray(array)) != count:
            raise InputError(
                f"holds a motion of {len(np.asarray(array))} nodes, but this structure has "
                f"{count}; give a result of the same pattern and model",
                place,
            )
    if "load_factor" not in result:
        return Start(state)
    return Start(state, float(check_variable(result, "load_factor", ("step",))[section.at]))


def _rigid_motion(case: Case, start: MotionStart) -> State:
    """Undeformed state with the velocities of a rigid body.

    v = velocity + spin x (x - center), with the center of mass of the nodes at rest.
    """
    x = case.structure.nodes
    mass = case.nodal_mass
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
            f": {given}: moves node {node} along {AXES[axis]} with {velocity[node, axis]:.4g} m/s, "
            "where a support holds it; free this node, or start from another motion"
        )
    velocity[case.fixed] = 0.0
    return State(velocity=velocity)
