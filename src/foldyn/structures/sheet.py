"""The material of a pattern: a sheet, panels that differ from it, and bonded layers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from foldyn.arguments import Check, Checked, Read
from foldyn.errors import InputError
from foldyn.tables import ListOf, TableOf
from foldyn.values import indices, length, number, objects, show, single


def _ratio(name: str, value: Any) -> float:
    """Return a Poisson's ratio."""
    checked = number(name, value)
    if not -1.0 < checked < 0.5:
        raise InputError(
            f" = {checked}: must lie between -1 and 0.5, both excluded (0.5 makes the bar areas "
            "infinite)",
            name,
        )
    return checked


def _panels(name: str, value: Any) -> tuple[int, ...]:
    """Return numbers of panels."""
    chosen = indices(name, value, "panel", "as in [0, 1]")
    if min(chosen) < 0:
        raise InputError(f" = {show(list(chosen))}: panels are counted from 0", name)
    return chosen


Modulus = Annotated[float, Check(number, above=0.0, unit="Pa")]
Ratio = Annotated[float, Check(_ratio)]
Length = Annotated[float, Check(length, unit="m")]
Density = Annotated[float, Check(number, above=0.0, unit="kg/m3")]
MATERIAL = ("youngs_modulus", "poissons_ratio", "thickness", "density", "strength")
"""Values that may differ from panel to panel."""


@dataclass(frozen=True)
class PanelSheet(Checked):
    """Panels whose thickness or material differs from the rest of the sheet.

    Parameters
    ----------
    panels : int or sequence of int
        Indices of the panels, in the order of `pattern.faces`.
    youngs_modulus, poissons_ratio, thickness, density, strength : float, optional
        As in `Sheet`. Give at least one; the sheet's values apply to the rest.

    Raises
    ------
    InputError
        A value out of range, or no value at all.
    """

    panels: Annotated[Sequence[int] | int, Check(_panels)]
    youngs_modulus: Modulus | None = None
    poissons_ratio: Ratio | None = None
    thickness: Length | None = None
    density: Density | None = None
    strength: Modulus | None = None

    def agree(self) -> None:
        """Refuse panels without a value that differs."""
        if not self.own:
            raise InputError(f": give what differs there: {', '.join(MATERIAL)}", "panels")

    @property
    def own(self) -> dict[str, float]:
        """The values that differ from the rest of the sheet."""
        return {name: getattr(self, name) for name in self.given(*MATERIAL)}


@dataclass(frozen=True)
class Sheet(Checked):
    """An isotropic elastic sheet.

    Parameters
    ----------
    youngs_modulus : float
        E (Pa), positive.
    poissons_ratio : float
        nu, -1 < nu < 0.5. N5B8 quadrilaterals need nu > 0: their spokes have an area
        proportional to nu.
    thickness : float
        t (m), positive.
    density : float, optional
        rho (kg/m3), positive. Needed for the mass, not for statics.
    length_scale_ratio : float, default 1
        L*/L_F, positive: determines the stiffness of calibrated creases; larger is softer.
    panels : sequence of PanelSheet, optional
        Panels that differ from the rest.
    strength : float, optional
        Largest von Mises stress that the sheet bears, Pa, positive; only `margins` needs it.

    Raises
    ------
    InputError
        A value out of range; a panel named twice; panels with a density in a sheet without density.

    Examples
    --------
    >>> import foldyn as fd
    >>> stiff = fd.PanelSheet(panels=[0, 1], thickness=0.02)
    >>> fd.Sheet(1e6, 0.25, thickness=0.01, panels=[stiff]).of(1).thickness
    0.02
    """

    youngs_modulus: Modulus
    poissons_ratio: Ratio
    thickness: Length
    density: Density | None = None
    length_scale_ratio: Annotated[float, Check(number, above=0.0)] = 1.0
    panels: Annotated[
        Sequence[PanelSheet],
        Check(objects, kinds=(PanelSheet,)),
        Read(ListOf(TableOf(PanelSheet))),
    ] = ()
    strength: Modulus | None = None

    place = "sheet: "

    def agree(self) -> None:
        """Refuse panels that are named twice, and densities given for some panels only."""
        before: dict[int, int] = {}
        for i, part in enumerate(self.panels):
            if part.density is not None and self.density is None:
                raise InputError(
                    f" = {part.density:g}: the rest of the sheet has none; give sheet.density",
                    f"panels[{i}].density",
                )
            for panel in _numbers(part):
                if panel in before:
                    raise InputError(
                        f": panel {panel} is already in panels[{before[panel]}]; "
                        "leave it out of one of the two",
                        f"panels[{i}].panels",
                    )
                before[panel] = i

    @property
    def bending_modulus(self) -> float:
        """E t^3 / (12 (1 - nu^2)), N m."""
        return self.youngs_modulus * self.thickness**3 / (12.0 * (1.0 - self.poissons_ratio**2))

    @property
    def areal_density(self) -> float:
        """rho t, kg/m2; nan without a density."""
        return math.nan if self.density is None else self.density * self.thickness

    def of(self, panel: int) -> Sheet:
        """The uniform sheet that one panel is made of."""
        kinds, kind = self.kinds(panel + 1)
        return kinds[kind[panel]]

    def kinds(self, count: int) -> tuple[list[Sheet], NDArray[np.int64]]:
        """Uniform sheets, and the index of the sheet of each of `count` panels."""
        rest = replace(self, panels=())
        kind = np.zeros(count, np.int64)
        for number_of, part in enumerate(self.panels, 1):
            chosen = np.array(_numbers(part))
            kind[chosen[chosen < count]] = number_of
        return [rest, *(replace(rest, **part.own) for part in self.panels)], kind

    def values(self, name: str, count: int) -> NDArray[np.float64]:
        """An attribute of the sheet, such as "thickness", for each of `count` panels (count,)."""
        kinds, kind = self.kinds(count)
        return np.array([getattr(sheet, name) for sheet in kinds], float)[kind]

    def check_panels(self, count: int) -> None:
        """Refuse panels that a pattern of `count` panels does not have."""
        for i, part in enumerate(self.panels):
            beyond = [panel for panel in _numbers(part) if panel >= count]
            if beyond:
                raise InputError(
                    f"sheet: panels[{i}].panels: panel {beyond[0]} is out of range; this pattern "
                    f"has panels 0 to {count - 1}"
                )


def _numbers(part: PanelSheet) -> tuple[int, ...]:
    return part.panels  # type: ignore[return-value]  # checked


def check_layers(name: str, layers: Sequence[Sequence[float]]) -> tuple[tuple[float, ...], ...]:
    """Layers of a laminate as tuples of numbers, checked."""
    layers = single(layers)
    listed = isinstance(layers, Sequence | np.ndarray) and not isinstance(layers, str)
    if not listed or not len(layers):
        raise InputError(
            f" = {show(layers)}: give a row [thickness (m), Young's modulus (Pa), expansion (1/K)] "
            "for each layer, from the back to the front",
            name,
        )
    rows = []
    for i, row in enumerate(layers):
        place = f"{name}[{i}]"
        if isinstance(row, str) or not hasattr(row, "__len__") or len(row) != 3:
            raise InputError(
                f" = {show(row)}: must be [thickness (m), Young's modulus (Pa), expansion (1/K)]",
                place,
            )
        thickness = length(f"{place}[0]", row[0])
        modulus = number(f"{place}[1]", row[1], above=0.0)
        rows.append((thickness, modulus, number(f"{place}[2]", row[2])))
    return tuple(rows)


@dataclass(frozen=True)
class Laminate(Checked):
    """Layers of isotropic materials, bonded face to face.

    With z_i the distance of the middle of a layer from the neutral surface, sum E_i t_i z_i = 0,
    the free sheet has no force and no moment where its neutral surface stretches by `expansion`
    and bends by `curvature` per kelvin,

        expansion = sum E_i t_i alpha_i / sum E_i t_i
        curvature = sum E_i t_i z_i alpha_i / sum E_i (t_i^3 / 12 + t_i z_i^2)

    which for two layers is Timoshenko's formula (Analysis of bi-metal thermostats, J. Opt. Soc.
    Am. 11, 1925, equation 4). All layers have the same Poisson's ratio.

    Parameters
    ----------
    layers : sequence of (float, float, float)
        Thickness (m), Young's modulus (Pa) and expansion (1/K) of each layer, from the back of the
        sheet to the front.

    Attributes
    ----------
    expansion : float
        Strain of the neutral surface per kelvin, 1/K.
    curvature : float
        Curvature per kelvin, 1/(m K), positive if the sheet bends like a valley fold, toward its
        front.

    Examples
    --------
    >>> import foldyn as fd
    >>> bimetal = fd.Laminate([(5e-4, 140e9, 1.0e-6), (5e-4, 140e9, 20.0e-6)])
    >>> print(f"{bimetal.curvature:.4f}")  # Timoshenko: -1.5 * 19e-6 / 1e-3
    -0.0285
    """

    layers: Annotated[Sequence[Sequence[float]], Check(check_layers)]

    @property
    def _columns(self) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        """Thickness, E t, expansion and height above the neutral surface of each layer."""
        t, modulus, expansion = np.array(self.layers).T
        middle = np.cumsum(t) - 0.5 * t
        stiff = modulus * t
        return t, stiff, expansion, middle - stiff @ middle / stiff.sum()

    @property
    def _bending(self) -> float:
        """Sum of E (t^3 / 12 + t z^2), N m."""
        t, stiff, _, z = self._columns
        return float(stiff @ (t**2 / 12.0 + z**2))

    @property
    def expansion(self) -> float:
        """Strain of the neutral surface per kelvin, 1/K."""
        _, stiff, expansion, _ = self._columns
        return float(stiff @ expansion / stiff.sum())

    @property
    def curvature(self) -> float:
        """Curvature per kelvin, 1/(m K), toward the front."""
        _, stiff, expansion, z = self._columns
        return -float(stiff @ (z * expansion)) / self._bending

    def sheet(
        self, poissons_ratio: float, areal_density: float | None = None, **others: Any
    ) -> Sheet:
        """Sheet with the same stiffness in stretching and in bending, about the neutral surface.

        Parameters
        ----------
        poissons_ratio : float
            Poisson's ratio of all layers.
        areal_density : float, optional
            Mass per area, kg/m2.
        **others
            Further arguments of `Sheet`.
        """
        stretching = float(self._columns[1].sum())
        thickness = math.sqrt(12.0 * self._bending / stretching)
        density = None if areal_density is None else areal_density / thickness
        return Sheet(stretching / thickness, poissons_ratio, thickness, density, **others)
