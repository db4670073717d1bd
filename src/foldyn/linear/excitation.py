"""Drives of frequency responses, nodal forces or a moving base, and the responses to them.

The response to a moving base is the absolute displacement divided by the base displacement. With x
= t y + z, where t is the unit translation of all nodes along the axis of the base, y the motion of
the base and z the motion relative to it, the equation of motion M x'' + C x' + K x = 0 on the free
dofs becomes

    M z'' + C z' + K z = -(M t)_f (y'' + alpha y') - (C_g t)_f y',

because a translation strains nothing: K t = 0, and the same holds for beta K0, creases, dashpots
between nodes and modal damping. (Springs to the ground do resist a translation; their -K t (y +
beta y') is added.) Rayleigh's alpha M and the dashpots to the ground, C_g, damp the absolute
motion, as air does, and therefore exert drag on the moving body; beta K0 damps the strain. For one
mass m on a spring k

    x / y = (k + i w beta k) / (k - w^2 m + i w (alpha m + beta k)),

the textbook formula with c = beta k if alpha = 0.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import BaseMotion, Case, Constant, Force
from foldyn.cases.directions import AXES
from foldyn.errors import FoldynWarning, InputError, warn
from foldyn.linear.linearized import Linearized
from foldyn.values import show

NAMED = 5  # most frequencies listed in a warning


class Answer(NamedTuple):
    """Result of a method of frequency response.

    Attributes
    ----------
    response : ndarray, complex
        Response per unit of the drive. From matrix methods: on the free dofs, shape (m, nf),
        relative to the base. From simulated motions: at all nodes, shape (m, n, 3), absolute.
    more : dict
        Further variables of the dataset.
    facts : dict
        Attributes of the dataset.
    """

    response: NDArray[Any]
    more: dict[str, NDArray[Any]]
    facts: dict[str, Any]


@dataclass(frozen=True, eq=False)
class Drive:
    """A drive with its amplitude.

    Attributes
    ----------
    amplitude : float
        Factor on the given drive.
    vector : (n, 3)
        Amplitudes of the forces on the nodes (N), or of the displacements of the base (m).
    value : float
        Divisor of the response: the sum of the magnitudes of the nodal forces (N), or the
        displacement of the base (m).
    axis : str or None
        Axis of the base motion; None for forces.
    """

    amplitude: float
    vector: NDArray[np.float64]
    value: float
    axis: str | None

    @property
    def quantity(self) -> str:
        """Name of the response."""
        return "receptance" if self.axis is None else "transmissibility"

    def facts(self) -> dict[str, Any]:
        """Attributes of the dataset."""
        what = {"drive_force": self.value}
        if self.axis is not None:
            what = {"base_axis": self.axis, "drive_displacement": self.value}
        return {**what, "amplitude": self.amplitude}


def drive_of(case: Case, drive: Any, amplitude: float) -> Drive:
    """Check the drive of a case.

    Raises
    ------
    InputError
        Neither forces nor a single base motion; a drive with a history; forces on held axes
        only; or a base that cannot move as a whole.

    Warns
    -----
    FoldynWarning
        A force acts partly on held axes: that part moves nothing and is left out.
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
        raise InputError("drive: a BaseMotion must be the only drive; compute a response for each")
    return _base(case, bases[0], amplitude)


def _forces(case: Case, parts: list[Force], amplitude: float) -> Drive:
    """A drive by forces, without their components on held axes."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", FoldynWarning)
        try:
            driven = replace(case, loads=parts)
        except InputError as error:
            raise InputError(str(error).replace("loads[", "drive[", 1)) from None
    for warning in caught:
        text = str(warning.message).replace("loads[", "drive[", 1)
        warnings.warn_explicit(text, warning.category, warning.filename, warning.lineno)
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
    imposed = [case.imposed, *(vectors for vectors, _ in case.imposed_terms)]
    if any(one[:, column].any() for one in imposed):
        raise InputError(
            f"drive[0]: an Impose holds nodes along {part.axis}, which would not follow the base; "
            "use Fix instead of Impose there and start from a state with these displacements"
        )
    held = case.fixed[:, column]
    if not (case.reaction_dofs % 3 == column).any():
        raise InputError(
            f"drive[0]: the base moves along {part.axis}, but no support holds a node along "
            f'{part.axis}; add one with axes = "{part.axis}", or drive by forces'
        )
    vector = np.zeros(case.fixed.shape)
    vector[held, column] = amplitude * part.value
    return Drive(amplitude, vector, amplitude * part.value, part.axis)


class Term(NamedTuple):
    """Part of the load per unit of a drive: a shape times a factor that depends on frequency."""

    shape: NDArray[np.float64]  # (nf,)
    factor: Callable[[float], complex]  # function of the angular frequency (rad/s)


def drive_terms(system: Linearized, drive: Drive) -> list[Term]:
    """Load per unit of the drive: forces per N, or the effective load of a moving base.

    A moving base drives masses by inertia. Springs, planes and dashpots attached to the ground,
    which stays at rest, hold the masses back.
    """
    if drive.axis is None:
        return [Term(system.projected((drive.vector / drive.value).ravel()), lambda omega: 1.0)]
    axis, damping = AXES.index(drive.axis), system.case.rayleigh
    parts = (
        (system.inertia, lambda omega: omega**2 - 1j * omega * damping.alpha),
        (system.pushed, lambda omega: omega**2),
        (system.ground, lambda omega: -1.0 - 1j * omega * damping.beta),
        (system.drag, lambda omega: -1j * omega),
    )
    inertia, *others = (Term(forces[:, axis], factor) for forces, factor in parts)
    return [inertia, *(term for term in others if term.shape.any())]


def absolute(system: Linearized, drive: Drive, relative: NDArray) -> NDArray[np.complex128]:
    """Absolute response (m, n, 3) from the response (m, nf) of free dofs relative to the base."""
    response = system.expanded(relative.T).T.reshape(-1, *drive.vector.shape).copy()
    if drive.axis is not None:
        response[:, :, AXES.index(drive.axis)] += 1.0
    return response


def warn_at(frequency: NDArray, text: str) -> None:
    """Warn about frequencies (m,), if any; `text` has a placeholder for the frequencies."""
    if not frequency.size:
        return
    listed = ", ".join(f"{f:.6g}" for f in frequency[:NAMED])
    more = " and others" if frequency.size > NAMED else ""
    warn(f"frequencies: {text.format(f'{listed} Hz{more}')}", "frequency-response.md#methods")
