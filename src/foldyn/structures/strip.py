"""Creases with a width: a strip that bends evenly between the ends of two panels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from foldyn.arguments import Checked
from foldyn.errors import InputError
from foldyn.patterns import Pattern
from foldyn.structures.material_axes import bending_across
from foldyn.structures.ply import Length, Modulus, Ratio
from foldyn.structures.sheet import Sheet

STIFF = 0.999  # bending stiffness of a strip, over the panels', above which it is no crease


@dataclass(frozen=True)
class Strip(Checked):
    """A crease as a strip of film or of thinner material; `crease_stiffness` takes it.

    The strip, of the width w, bends evenly, and does not curve along the crease. Panels reach to
    the middle of it in the model, so that they add w/2 of themselves on either side; the hinge in
    their place has per length the stiffness k,

        1/k = w / D_strip - w/2 (1 / D_1 + 1 / D_2),

    with D = E t^3 / 12 (1 - nu^2), of the panels across the crease.

    Parameters
    ----------
    width : float
        w, m.
    thickness : float, optional
        m; by default that of the panels.
    youngs_modulus : float, optional
        Pa; by default the strip has the material of the panels beside it.
    poissons_ratio : float, optional
        Of a strip with its own modulus; by default that of the sheet.

    Examples
    --------
    >>> import foldyn as fd
    >>> pattern = fd.patterns.simple_fold(a=0.1, b=0.1, dihedral=120)
    >>> sheet = fd.Sheet(3e9, 0.3, thickness=1e-3)
    >>> film = fd.Strip(width=2e-3, thickness=1e-4)
    >>> folds = fd.shell(pattern, sheet, divisions=4, crease_stiffness=film).fold_stiffness
    >>> print(f"{folds[0] / 0.1:.4f} N")  # 3e9 0.1^3 / 12 (1 - 0.09) / 2, with 1e-3 of it
    0.1375 N
    """

    width: Length
    thickness: Length | None = None
    youngs_modulus: Modulus | None = None
    poissons_ratio: Ratio | None = None

    def stiffness(self, pattern: Pattern, sheet: Sheet, *, name: str) -> NDArray[np.float64]:
        """Stiffness (nf,) per length, N m/rad per m, as each crease of a pattern.

        Raises
        ------
        InputError
            Wider than a panel beside it; as stiff as the panels; plies without an own modulus.
        """
        count, faces = len(pattern.faces), pattern.crease_faces
        length = np.linalg.norm(np.subtract(*pattern.vertices[pattern.creases.T]), axis=1)
        beside = (pattern.face_areas[faces] / length[:, None]).min(axis=1)
        narrow = np.flatnonzero(beside < self.width)
        if len(narrow):
            raise InputError(
                f" = {self.width:g}: wider than a panel beside crease {narrow[0]} "
                f"({beside[narrow[0]]:.3g} m)",
                f"{name}.width",
            )
        panels, thickness = bending_across(pattern, sheet), sheet.values("thickness", count)[faces]
        own = thickness if self.thickness is None else np.full(faces.shape, self.thickness)
        if self.youngs_modulus is not None:
            nu = sheet.poissons_ratio if self.poissons_ratio is None else self.poissons_ratio
            bending = self.youngs_modulus * own**3 / (12.0 * (1.0 - nu**2))
        elif sheet.plies or any(part.plies for part in sheet.panels):
            raise InputError(": missing; the panels have plies", f"{name}.youngs_modulus")
        else:
            bending = panels * (own / thickness) ** 3
        if (bending > STIFF * panels).any():
            raise InputError(
                ": as stiff in bending as the panels, and no crease; give it a thickness or a "
                "modulus of its own, or weld the panels",
                name,
            )
        return 1.0 / (0.5 * self.width * (1.0 / bending - 1.0 / panels).sum(axis=1))
