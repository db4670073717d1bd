"""What drives a frequency response: forces on nodes, or the motion of the base."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import BaseMotion, Case, Constant, Force
from foldyn.cases.supports import AXES
from foldyn.errors import FoldynWarning, InputError
from foldyn.values import show


@dataclass(frozen=True, eq=False)
class Drive:
    """A drive with its amplitude.

    Attributes
    ----------
    amplitude : float
        Factor on what was given.
    vector : (n, 3)
        Amplitudes of the forces on the nodes (N), or of the displacements of the base (m).
    value : float
        What the response is divided by: the sum of the magnitudes of the nodal forces (N), or the
        displacement of the base (m).
    axis : str or None
        Of the motion of the base; None for forces.
    """

    amplitude: float
    vector: NDArray[np.float64]
    value: float
    axis: str | None

    @property
    def quantity(self) -> str:
        """What the response is called."""
        return "receptance" if self.axis is None else "transmissibility"

    def facts(self) -> dict[str, Any]:
        """Attributes of the dataset."""
        if self.axis is None:
            return {"drive_force": self.value, "amplitude": self.amplitude}
        return {
            "base_axis": self.axis,
            "drive_displacement": self.value,
            "amplitude": self.amplitude,
        }


def drive_of(case: Case, drive: Any, amplitude: float) -> Drive:
    """Check the drive of a case.

    Raises
    ------
    InputError
        Neither forces nor one motion of the base, a history of its own, forces on held axes only,
        or a base that cannot move as a whole.

    Warns
    -----
    FoldynWarning
        A force acts in part on held axes: that part moves nothing and is left out.
    """
    parts = (drive,) if isinstance(drive, Force | BaseMotion) else drive
    if not isinstance(parts, Sequence) or isinstance(parts, str) or not len(parts):
        raise InputError(
            f"drive = {show(drive)}: must be a list of Force, as [fd.Force([0], (1, 0, 0))], or of "
            'one BaseMotion, as [fd.BaseMotion("x")]'
        )
    for i, part in enumerate(parts):
        if not isinstance(part, Force | BaseMotion):
            raise InputError(f"drive[{i}] = {show(part)}: must be a Force or a BaseMotion")
        if part.history != Constant():
            raise InputError(
                f"drive[{i}].history: the method of the frequency response gives it; leave it out"
            )
    forces = [part for part in parts if isinstance(part, Force)]
    bases = [part for part in parts if isinstance(part, BaseMotion)]
    if not bases:
        return _forces(case, forces, amplitude)
    if len(parts) > 1:
        raise InputError(
            "drive: a BaseMotion drives alone, along one axis; compute a response for each"
        )
    return _base(case, bases[0], amplitude)


def _forces(case: Case, parts: list[Force], amplitude: float) -> Drive:
    """A drive by forces; those on held axes reach the supports, not the structure."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always", FoldynWarning)
        try:
            driven = Case(case.structure, case.supports, parts)
        except InputError as error:
            raise InputError(str(error).replace("loads[", "drive[", 1)) from None
    for warning in told:
        text = str(warning.message).replace("loads[", "drive[", 1)
        warnings.warn(text, FoldynWarning, stacklevel=5)
    vector = amplitude * driven.force_terms[0][0]
    vector[driven.fixed] = 0.0
    size = float(np.linalg.norm(vector, axis=1).sum())
    if not size > 0.0:
        raise InputError(
            "drive: the forces are zero on all free axes (or cancel); a response per force needs "
            "a force"
        )
    return Drive(amplitude, vector, size, None)


def _base(case: Case, part: BaseMotion, amplitude: float) -> Drive:
    """A drive by the base."""
    if part.value == 0.0:
        raise InputError("drive[0].value = 0: the base must move")
    column = AXES.index(part.axis)
    if case.imposed[:, column].any():
        raise InputError(
            f"drive[0]: an Impose holds nodes along {part.axis}, which would not follow the base; "
            "use Fix instead of Impose there and start from a state that has been brought there"
        )
    held = case.fixed[:, column]
    if not held.any():
        raise InputError(
            f"drive[0]: the base moves along {part.axis}, but no support holds a node along "
            f'{part.axis}; add one with axes = "{part.axis}", or drive by forces'
        )
    vector = np.zeros(case.fixed.shape)
    vector[held, column] = amplitude * part.value
    return Drive(amplitude, vector, amplitude * part.value, part.axis)
