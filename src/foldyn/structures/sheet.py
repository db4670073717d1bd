"""The material of a pattern: a sheet, panels that differ from it, and bonded layers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from foldyn.arguments import Check, Checked, Read
from foldyn.errors import InputError, within
from foldyn.mechanics.triangle import isotropic, plane_stress
from foldyn.tables import ListOf, TableOf
from foldyn.values import indices, length, number, objects, show, single, vector


def _moduli(name: str, value: Any) -> float | tuple[float, float]:
    """Return Young's modulus, or those along and across a direction."""
    value = single(value)
    if not isinstance(value, list | tuple | np.ndarray):
        return number(name, value, above=0.0, unit="Pa")
    if len(value) != 2:
        raise InputError(
            f" = {show(list(value))}: must be one number (Pa), or two: along the direction and "
            "across",
            name,
        )
    first, second = (
        number(f"{name}[{k}]", each, above=0.0, unit="Pa") for k, each in enumerate(value)
    )
    return first, second


def _direction(name: str, value: Any) -> Any:
    """Return an angle (degrees), a vector, or an edge and the angle from it."""
    value = single(value)
    if isinstance(value, Mapping):
        if {*value} - {"angle"} != {"edge"}:
            raise InputError(
                f" = {show(dict(value))}: must be {{ edge = [0, 1], angle = 30 }}, with two "
                "vertices and degrees",
                name,
            )
        value = value["edge"], value.get("angle", 0.0)
    if isinstance(value, list | tuple) and len(value) == 2:
        edge, angle = value
        ends = indices(f"{name}.edge", edge, "vertex", "as in [0, 1]")
        if len(ends) != 2:
            raise InputError(f" = {show(list(ends))}: must be two vertices", f"{name}.edge")
        return tuple(ends), number(f"{name}.angle", angle)
    if isinstance(value, list | tuple | np.ndarray):
        return vector(name, value, nonzero=True)
    return number(name, value)


def _check_material(given: Mapping[str, Any]) -> None:
    """Refuse constants that do not fit together."""
    moduli, nu = given["youngs_modulus"], given["poissons_ratio"]
    if isinstance(moduli, tuple):
        for name in OF_FIBERS:
            if given[name] is None:
                raise InputError(": missing; two moduli need it", name)
        most = math.sqrt(moduli[0] / moduli[1])
        if abs(nu) >= most:
            raise InputError(
                f" = {nu:g}: must lie below the root of E1/E2, {most:.4g}", "poissons_ratio"
            )
        return
    if nu >= 0.5:
        raise InputError(
            f" = {nu:g}: must lie between -1 and 0.5, both excluded (0.5 makes the bar areas "
            "infinite)",
            "poissons_ratio",
        )
    for name in OF_FIBERS:
        if given[name] is not None:
            raise InputError(
                ": belongs to orthotropic sheets; give youngs_modulus = [E1, E2] too", name
            )


def _panels(name: str, value: Any) -> tuple[int, ...]:
    """Return numbers of panels."""
    chosen = indices(name, value, "panel", "as in [0, 1]")
    if min(chosen) < 0:
        raise InputError(f" = {show(list(chosen))}: panels are counted from 0", name)
    return chosen


Modulus = Annotated[float, Check(number, above=0.0, unit="Pa")]
Moduli = Annotated[float | Sequence[float], Check(_moduli, unit="Pa")]
Ratio = Annotated[float, Check(number, above=-1.0)]
Direction = Annotated[float | Sequence[Any] | Mapping[str, Any], Check(_direction)]
Length = Annotated[float, Check(length, unit="m")]
Density = Annotated[float, Check(number, above=0.0, unit="kg/m3")]
MATERIAL = (
    "youngs_modulus", "poissons_ratio", "thickness", "density", "strength", "shear_modulus",
    "direction",
)  # fmt: skip
"""Values that may differ from panel to panel."""
OF_FIBERS = ("shear_modulus", "direction")
"""Values that isotropic sheets do not have."""


@dataclass(frozen=True)
class PanelSheet(Checked):
    """Panels whose thickness or material differs from the rest of the sheet.

    Parameters
    ----------
    panels : int or sequence of int
        Indices of the panels, in the order of `pattern.faces`.
    youngs_modulus, poissons_ratio, thickness, density, strength, shear_modulus, direction
        As in `Sheet`. Give at least one; the sheet's values apply to the rest.

    Raises
    ------
    InputError
        A value out of range, or no value at all.
    """

    panels: Annotated[Sequence[int] | int, Check(_panels)]
    youngs_modulus: Moduli | None = None
    poissons_ratio: Ratio | None = None
    thickness: Length | None = None
    density: Density | None = None
    strength: Modulus | None = None
    shear_modulus: Modulus | None = None
    direction: Direction | None = None

    def agree(self) -> None:
        """Refuse panels without a value that differs."""
        if not self.own:
            raise InputError(f": give what differs there: {', '.join(MATERIAL)}", "panels")

    @property
    def own(self) -> dict[str, Any]:
        """The values that differ from the rest of the sheet."""
        return {name: getattr(self, name) for name in self.given(*MATERIAL)}

    @property
    def instead(self) -> dict[str, Any]:
        """The values that differ; isotropic panels have no direction."""
        isotropic = isinstance(self.youngs_modulus, float)
        return {**(dict.fromkeys(OF_FIBERS) if isotropic else {}), **self.own}


@dataclass(frozen=True)
class Sheet(Checked):
    """An elastic sheet, isotropic or orthotropic.

    Parameters
    ----------
    youngs_modulus : float or (float, float)
        E (Pa), positive; of an orthotropic sheet E1 along `direction` and E2 across.
    poissons_ratio : float
        nu, -1 < nu < 0.5. N5B8 quadrilaterals need nu > 0: their spokes have an area
        proportional to nu. Of an orthotropic sheet nu12, the contraction across under a stress
        along `direction`, with nu12^2 E2 < E1.
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
    shear_modulus : float, optional
        G12 (Pa) of an orthotropic sheet.
    direction : float, (float, float, float) or dict, optional
        Direction 1 of an orthotropic sheet: an angle (degrees) from the first edge of each panel,
        counter-clockwise seen from the front; a vector, projected on each panel at rest; or
        ``{"edge": (0, 1), "angle": 30}``, the angle from an edge of the pattern (from its first to
        its second vertex), continued over all creases as in the flat sheet. It turns with the
        panels.

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

    youngs_modulus: Moduli
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
    shear_modulus: Modulus | None = None
    direction: Direction | None = None

    place = "sheet: "

    def agree(self) -> None:
        """Refuse impossible materials, panels named twice, and densities of some panels only."""
        _check_material(vars(self))
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
            with within(f"panels[{i}]."):
                _check_material({**vars(self), **part.instead})

    @property
    def orthotropic(self) -> bool:
        """Whether the sheet has two moduli."""
        return isinstance(self.youngs_modulus, tuple)

    @property
    def moduli(self) -> tuple[float, float]:
        """E1 and E2, Pa; of an isotropic sheet E twice."""
        given = self.youngs_modulus
        return given if isinstance(given, tuple) else (given, given)  # type: ignore[return-value]

    @property
    def modulus(self) -> float:
        """E, or E1, Pa: a measure of the stiffness."""
        return self.moduli[0]

    @property
    def elastic(self) -> NDArray[np.float64]:
        """Stiffness (3, 3) in plane stress, Pa; see `mechanics.triangle.plane_stress`."""
        nu = self.poissons_ratio
        if self.shear_modulus is None:
            return self.modulus / (1.0 - nu**2) * isotropic(nu)
        return plane_stress(*self.moduli, nu, self.shear_modulus)

    @property
    def stretching(self) -> NDArray[np.float64]:
        """Membrane stiffness (3, 3) along the material's axes, N/m."""
        return self.thickness * self.elastic

    @property
    def bending(self) -> NDArray[np.float64]:
        """Bending stiffness (3, 3) along the material's axes, N m."""
        return self.thickness**3 / 12.0 * self.elastic

    @property
    def bending_modulus(self) -> float:
        """E t^3 / (12 (1 - nu^2)), N m, with the geometric mean of E1 and E2."""
        first, second = self.moduli
        mean = first if first == second else math.sqrt(first * second)
        nu2 = self.poissons_ratio**2 * second / first
        return mean * self.thickness**3 / (12.0 * (1.0 - nu2))

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
        return [rest, *(replace(rest, **part.instead) for part in self.panels)], kind

    def values(self, name: str, count: int) -> NDArray[np.float64]:
        """A number of the sheet, such as "thickness", for each of `count` panels (count,)."""
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
