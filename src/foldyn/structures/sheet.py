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
from foldyn.structures.ply import (
    Density,
    Length,
    Moduli,
    Modulus,
    Ply,
    Ratio,
    check_material,
    constants,
    elastic,
    pair,
    stiffness,
)
from foldyn.tables import ListOf, TableOf
from foldyn.values import indices, length, number, objects, show, single, vector


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


def _panels(name: str, value: Any) -> tuple[int, ...]:
    """Return numbers of panels."""
    chosen = indices(name, value, "panel", "as in [0, 1]")
    if min(chosen) < 0:
        raise InputError(f" = {show(list(chosen))}: panels are counted from 0", name)
    return chosen


Plies = Annotated[Sequence[Ply], Check(objects, kinds=(Ply,)), Read(ListOf(TableOf(Ply)))]
Direction = Annotated[float | Sequence[Any] | Mapping[str, Any], Check(_direction)]
MATERIAL = (
    "youngs_modulus", "poissons_ratio", "thickness", "density", "strength", "shear_modulus",
    "direction", "plies",
)  # fmt: skip
"""Values that may differ from panel to panel."""
OF_FIBERS = ("shear_modulus", "direction")
"""Values that isotropic sheets do not have."""
ALIKE = 1e-9  # relative difference of values that count as equal
OF_PLIES = ("youngs_modulus", "poissons_ratio", "thickness", "density", "shear_modulus")
"""Values that follow from plies."""


@dataclass(frozen=True)
class PanelSheet(Checked):
    """Panels whose thickness or material differs from the rest of the sheet.

    Parameters
    ----------
    panels : int or sequence of int
        Indices of the panels, in the order of `pattern.faces`.
    youngs_modulus, poissons_ratio, thickness, density, strength, shear_modulus, direction, plies
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
    plies: Plies | None = None

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
        """The values that differ, with those that follow from them."""
        if self.plies:
            return {**dict.fromkeys(OF_PLIES), **self.own, **constants("plies", self.plies)}
        if self.youngs_modulus is None:
            return self.own
        isotropic = isinstance(self.youngs_modulus, float)
        return {"plies": None, **(dict.fromkeys(OF_FIBERS) if isotropic else {}), **self.own}


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
    plies : sequence of Ply, optional
        Layers of a laminate from the back to the front, symmetric about the middle, in place of
        moduli, Poisson's ratio, thickness and density.

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

    youngs_modulus: Moduli = None  # type: ignore[assignment]  # plies have one
    poissons_ratio: Ratio = None  # type: ignore[assignment]
    thickness: Length = None  # type: ignore[assignment]
    density: Density | None = None
    length_scale_ratio: Annotated[float, Check(number, above=0.0)] = 1.0
    panels: Annotated[
        Sequence[PanelSheet], Check(objects, kinds=(PanelSheet,)), Read(ListOf(TableOf(PanelSheet)))
    ] = ()
    strength: Modulus | None = None
    shear_modulus: Modulus | None = None
    direction: Direction | None = None
    plies: Plies | None = None

    place = "sheet: "
    either = ("youngs_modulus", "poissons_ratio", "thickness"), ("plies",)

    def agree(self) -> None:
        """Refuse impossible materials, panels named twice, and densities of some panels only."""
        if self.plies:
            self._follow(constants("plies", self.plies))
        for name in self.either[0]:
            if getattr(self, name) is None:
                raise InputError(": missing; or give plies", name)
        check_material(vars(self), OF_FIBERS)
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
                check_material({**vars(self), **part.instead}, OF_FIBERS)

    def _follow(self, made: Mapping[str, Any]) -> None:
        """Take what plies make; refuse other values."""
        for name, value in made.items():
            given = getattr(self, name)
            if given is not None and not np.allclose(given, np.array(value, float), rtol=ALIKE):
                raise InputError(
                    f" = {show(given)}: follows from the plies, {show(value)}; leave it out", name
                )
        self._set(**made)

    @property
    def weighed(self) -> Sheet:
        """The sheet with 1 kg/m3 if it has no density, for what does not depend on it."""
        if self.density is not None:
            return self
        plies = [replace(ply, density=1.0) for ply in self.plies or ()]
        return replace(self, density=1.0, plies=plies or None)

    @property
    def orthotropic(self) -> bool:
        """Whether the sheet has two moduli."""
        return isinstance(self.youngs_modulus, tuple)

    @property
    def moduli(self) -> tuple[float, float]:
        """E1 and E2, Pa; of an isotropic sheet E twice."""
        return pair(self.youngs_modulus)

    @property
    def modulus(self) -> float:
        """E, or E1, Pa: a measure of the stiffness."""
        return self.moduli[0]

    @property
    def stretching(self) -> NDArray[np.float64]:
        """Membrane stiffness A (3, 3) along direction 1 and across, N/m; see `plane_stress`."""
        return stiffness(self.plies, 1) if self.plies else self.thickness * self._elastic

    @property
    def bending(self) -> NDArray[np.float64]:
        """Bending stiffness D (3, 3) along direction 1 and across, N m."""
        return stiffness(self.plies, 3) if self.plies else self.thickness**3 / 12.0 * self._elastic

    @property
    def _elastic(self) -> NDArray[np.float64]:
        return elastic(self.youngs_modulus, self.poissons_ratio, self.shear_modulus)

    @property
    def bending_modulus(self) -> float:
        """E t^3 / (12 (1 - nu^2)), N m; of an orthotropic sheet the root of D11 D22."""
        if self.orthotropic:
            own = self.bending
            return math.sqrt(own[0, 0] * own[1, 1])
        return self.modulus * self.thickness**3 / (12.0 * (1.0 - self.poissons_ratio**2))

    @property
    def has_strength(self) -> bool:
        """Whether a panel, or a ply, has a strength."""
        return any(
            own.strength is not None or any(ply.strength for ply in own.plies or ())
            for own in self.kinds(0)[0]
        )

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
