"""The air, or water, around a sheet: the mass that moves with it, and its drag."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from foldyn.arguments import Check, Flag
from foldyn.cases.decode import Factor, Part
from foldyn.cases.history import STEADY
from foldyn.errors import InputError
from foldyn.structures.discretized import Discretized
from foldyn.structures.mesh import double_areas
from foldyn.values import flag, number, show, vector, whole

LOCAL = "local"
SHORTER_TO_LONGER = (0.0, 0.05, 0.1, 0.2, 1.0)
PLATE_DRAG = (2.0, 1.5, 1.3, 1.2, 1.18)
"""Drag coefficients of flat plates normal to the flow, by the ratio of their sides: White (2011),
Fluid Mechanics, 7th edition, table 7.3, after Hoerner (1965), Fluid-Dynamic Drag."""


def _added_mass(name: str, value: Any) -> bool | str:
    if isinstance(value, str) and value != LOCAL:
        raise InputError(f" = {show(value)}: must be true, false or {show(LOCAL)}", name)
    return value if isinstance(value, str) else flag(name, value)


@dataclass(frozen=True)
class Air(Part):
    """Air, or another fluid of constant density, on both sides of the sheet.

    Parameters
    ----------
    density : float, default 1.204
        Density of the fluid (kg/m3): dry air at 20 C and 1013 hPa by default; water has 998.
    velocity : sequence of float, shape (3,)
        Velocity of the fluid far from the sheet (m/s); still air by default.
    added_mass : bool or "local", default True
        Whether the fluid that the sheet moves adds to its mass. "local" treats each panel as if it
        were alone in the fluid: for sheets whose full matrix is too large.
    drag : bool, default True
        Whether the pressure drag of the panels acts in motions.
    drag_coefficient : float, optional
        C_d in the force C_d / 2 density area v|v| on a panel, with v the normal velocity of the
        panel relative to the fluid. By default the value for a flat plate with the sheet's aspect
        ratio at rest: from 1.18 for a square to 2 for a long strip (see `coefficient`).
    resolution : int, default 4
        Number of boundary elements along each edge of a panel, for the added mass; must be even.
    history : History or callable, optional
        Factor of the velocity over time, for gusts; constant by default. With added mass it must
        not jump, because accelerating fluid exerts pressure.

    Examples
    --------
    >>> import foldyn as fd
    >>> fd.Air(density=998.0, drag=False)
    Air(density=998.0, velocity=(0.0, 0.0, 0.0), added_mass=True, drag=False, resolution=4,
        history=Constant())
    """

    density: Annotated[float, Check(number, above=0.0, unit="kg/m3")] = 1.204
    velocity: Annotated[Sequence[float], Check(vector, unit="m/s")] = (0.0, 0.0, 0.0)
    added_mass: Annotated[bool | str, Check(_added_mass)] = True
    drag: Flag = True
    drag_coefficient: Annotated[float | None, Check(number, least=0.0)] = None
    resolution: Annotated[int, Check(whole, least=2)] = 4
    history: Factor = STEADY

    def agree(self) -> None:
        """Require an even resolution, and added mass or drag."""
        if self.resolution % 2:
            raise InputError(
                f" = {self.resolution}: must be even, so that panels of any number of corners can "
                "be cut; take one more",
                "resolution",
            )
        if not self.added_mass and not self.drag:
            raise InputError(": without added mass and drag nothing acts; leave air out", "drag")

    @property
    def blows(self) -> bool:
        """Whether there is wind, which acts on a sheet at rest."""
        return any(self.velocity)

    def coefficient(self, structure: Discretized) -> float:
        """Drag coefficient of the panels of a structure.

        Interpolated from flat plates by the ratio of the shorter to the longer side of a rectangle
        with the sheet's second moments of area at rest.
        """
        if self.drag_coefficient is not None:
            return self.drag_coefficient
        return float(np.interp(_side_ratio(structure), SHORTER_TO_LONGER, PLATE_DRAG))


def _side_ratio(structure: Discretized) -> float:
    """Ratio of the sides, at most 1, of a rectangle with the sheet's second moments at rest."""
    corners = structure.nodes[structure.triangles]
    area = np.linalg.norm(double_areas(structure.nodes, structure.triangles), axis=1)
    center = np.average(corners.mean(axis=1), axis=0, weights=area)
    away = np.concatenate([corners - center, 3.0 * (corners.mean(axis=1) - center)[:, None]], 1)
    moments = np.einsum("t,tci,tcj->ij", area, away, away)  # 24 times the second moments
    _, shorter, longer = np.sqrt(np.linalg.eigvalsh(moments).clip(min=0.0))
    return float(shorter / longer)


def refuse_air(case: Any, name: str) -> None:
    """Refuse a case in air for a function `name` that does not support it.

    Raises
    ------
    InputError
        The case has air.
    """
    if case.air is not None:
        raise InputError(f": {name} would leave it out; take the case without air", "air")


def refuse_wind(case: Any, name: str) -> None:
    """Refuse a case with wind for a function `name` that does not support it.

    Raises
    ------
    InputError
        The case has air with a velocity.
    """
    if case.air is not None and case.air.blows:
        raise InputError(
            f" = {show(case.air.velocity)}: {name} would leave wind out; take still air",
            "air.velocity",
        )
