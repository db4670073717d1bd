"""Contact of panels with each other and with planes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from foldyn.arguments import Check, Flag, Read
from foldyn.cases.decode import Factor, Part, PartOf
from foldyn.cases.history import as_history
from foldyn.cases.reached import Until
from foldyn.errors import InputError
from foldyn.mechanics.contact.boards import BoardSheets
from foldyn.mechanics.contact.candidates import (
    FRICTION,
    HISTORY,
    MOTION,
    NORMAL,
    PLANE_COLUMNS,
    POINT,
    Sheets,
)
from foldyn.mechanics.contact.potential import STIFFNESS
from foldyn.structures.discretized import Discretized
from foldyn.tables import ListOf
from foldyn.values import length, number, objects, vector


@dataclass(frozen=True)
class Plane(Part):
    """A plane that the sheet cannot pass, fixed or moving: the ground, or the plate of a press.

    The plane acts on the nodes of the sheet, or on the corners of the middle surfaces of thick
    panels, at a distance of half the thickness. It does not act on nodes that are held along all
    three axes.

    Parameters
    ----------
    point : sequence of float, shape (3,)
        A point of the plane (m).
    normal : sequence of float, shape (3,)
        Normal of any length, pointing to the side of the sheet.
    friction : float, optional
        Coefficient of Coulomb friction; by default that of the `Contact`.
    motion : sequence of float, shape (3,), optional
        Displacement (m) of the plane at factor 1; none by default. In an equilibrium path it is
        multiplied by the load factor.
    history : History or callable, optional
        Factor of the motion over time; constant by default.
    until : float or mapping, optional
        When the plane is removed; see `Fix`.

    Examples
    --------
    >>> import foldyn as fd
    >>> fd.Plane(point=(0, 0, -0.001), normal=(0, 0, 1), friction=0.3)
    Plane(point=(0.0, 0.0, -0.001), normal=(0.0, 0.0, 1.0), friction=0.3)
    """

    point: Annotated[Sequence[float], Check(vector, unit="m")]
    normal: Annotated[Sequence[float], Check(vector, nonzero=True)]
    friction: Annotated[float | None, Check(number, least=0.0)] = None
    motion: Annotated[Sequence[float] | None, Check(vector, unit="m")] = None
    history: Factor = None
    until: Until = None

    missing = {"normal": "give its normal, on the side of the sheet"}

    def agree(self) -> None:
        """Refuse a history without a motion."""
        if self.motion is not None:
            self._set(history=as_history(self.history))
        elif self.history is not None:
            raise InputError(": a history needs the motion (m) at its factor 1", "motion")


@dataclass(frozen=True)
class Contact(Part):
    """Contact of panels with each other, within the sheet's thickness, and with planes.

    Parameters
    ----------
    thickness : float, optional
        Distance (m) of middle surfaces below which panels repel each other; by default the
        thickness of the sheet, or of each panel.
    friction : float, default 0
        Coefficient of Coulomb friction between panels, and on planes without a coefficient.
    stiffness : float, optional
        k (N/m) of the potential k d0^2 (1 - d/d0)^3 / (d/d0)^4, with d the distance and d0 the
        distance at which contact begins; by default 0.03 times Young's modulus times the thickness.
    panels : bool, default True
        Whether panels touch each other; if not, only planes act.
    planes : sequence of Plane
        Planes that the sheet cannot pass; none by default.

    Examples
    --------
    >>> import foldyn as fd
    >>> fd.Contact(friction=0.3)
    Contact(friction=0.3, panels=True, planes=())
    """

    thickness: Annotated[float | None, Check(length, unit="m")] = None
    friction: Annotated[float, Check(number, least=0.0)] = 0.0
    stiffness: Annotated[float | None, Check(number, above=0.0, unit="N/m")] = None
    panels: Flag = True
    planes: Annotated[
        Sequence[Plane],
        Check(objects, kinds=(Plane,)),
        Read(ListOf(PartOf((Plane,), "contact.planes"))),
    ] = ()

    def agree(self) -> None:
        """Require panels or planes."""
        if not self.panels and not self.planes:
            raise InputError(": without planes nothing touches; give planes, or True", "panels")

    def sheets(self, structure: Discretized, held: NDArray[np.bool_]) -> Sheets:
        """Surfaces in contact; `held` (n,) marks nodes that are held along all axes."""
        # copies: kernels are compiled separately for read-only and for writable arrays
        panel = np.array(structure.triangle_panel)
        count, sheet = int(panel.max(initial=-1)) + 1, structure.sheet
        own = sheet.values("thickness", count)
        moduli = sheet.values("modulus", count)
        stiffness = self.stiffness
        if stiffness is None:
            stiffness = STIFFNESS * float((moduli * own).min())
        origin = structure.nodes.mean(axis=0)  # digits are lost far from the origin
        sheets = Sheets(
            nodes=structure.nodes - origin,
            triangles=np.array(structure.triangles),
            panel=panel,
            thickness=np.array(own) if self.thickness is None else np.full(count, self.thickness),
            stiffness=stiffness,
            panels=self.panels,
            friction=self.friction,
            planes=self._table(origin),
            held=held,
        )
        pattern = structure.pattern
        if pattern is None or pattern.boards is None:
            return sheets
        x, normal = sheets.nodes[sheets.triangles], pattern.boards.normals[panel]
        away = x - (pattern.boards.centers[panel] - origin)[:, None]
        height = np.einsum("tci,ti->tc", away, normal)
        return BoardSheets(**vars(sheets), middle=x - height[:, :, None] * normal[:, None])

    def friction_on(self, plane: Plane) -> float:
        """Coefficient of friction on a plane: the plane's own, or else that of the contact."""
        return self.friction if plane.friction is None else plane.friction

    @property
    def rubs(self) -> bool:
        """Whether there is friction, between panels or on a plane."""
        between = self.panels and self.friction > 0.0
        return between or any(self.friction_on(plane) > 0.0 for plane in self.planes)

    def _table(self, origin: NDArray[np.float64]) -> NDArray[np.float64]:
        table = np.zeros((len(self.planes), PLANE_COLUMNS))
        for row, plane in zip(table, self.planes, strict=True):
            row[POINT : POINT + 3] = np.array(plane.point) - origin
            row[NORMAL : NORMAL + 3] = np.array(plane.normal) / np.linalg.norm(plane.normal)
            row[FRICTION] = self.friction_on(plane)
            row[MOTION : MOTION + 3] = plane.motion or 0.0
            row[HISTORY] = -1
        return table
