"""Plies: layers of a laminate with fibers along an angle, and constants of such materials."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from foldyn.arguments import Check, Checked
from foldyn.errors import InputError
from foldyn.mechanics.triangle import isotropic, plane_stress, turned_axes, turned_strain
from foldyn.values import length, number, numbers, show, single

COUPLED = 1e-9  # coupling of stretching and bending, relative to E t^2, that counts as none
STRENGTHS = 5


def one_or_two(
    name: str, value: Any, unit: str, above: float = -math.inf
) -> float | tuple[float, float]:
    """Return a number, or those along and across a direction."""
    value = single(value)
    if not isinstance(value, list | tuple | np.ndarray):
        return number(name, value, above=above, unit=unit)
    if len(value) != 2:
        raise InputError(
            f" = {show(list(value))}: must be one number ({unit}), or two: along the direction and "
            "across",
            name,
        )
    first = number(f"{name}[0]", value[0], above=above, unit=unit)
    return first, number(f"{name}[1]", value[1], above=above, unit=unit)


def check_material(given: Mapping[str, Any], needed: Sequence[str]) -> None:
    """Refuse constants that do not fit together; `needed` are those that fibers need."""
    moduli, nu = given["youngs_modulus"], given["poissons_ratio"]
    if isinstance(moduli, tuple):
        for name in needed:
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
    for name in needed:
        if given[name] is not None:
            raise InputError(
                ": belongs to orthotropic materials; give youngs_modulus = [E1, E2] too", name
            )


def _strengths(name: str, value: Any) -> tuple[float, ...]:
    """Return the strengths of a ply."""
    array = numbers(name, value)
    if array.shape != (STRENGTHS,) or not (array > 0.0).all():
        raise InputError(
            f" = {show(value)}: must be five numbers (Pa) above 0: along the fibers in tension and "
            "in compression, across in tension and in compression, and in shear",
            name,
        )
    return tuple(array.tolist())


Modulus = Annotated[float, Check(number, above=0.0, unit="Pa")]
Moduli = Annotated[float | Sequence[float], Check(one_or_two, unit="Pa", above=0.0)]
Ratio = Annotated[float, Check(number, above=-1.0)]
Length = Annotated[float, Check(length, unit="m")]
Expansion = Annotated[float | Sequence[float], Check(one_or_two, unit="1/K")]
Density = Annotated[float, Check(number, above=0.0, unit="kg/m3")]


@dataclass(frozen=True)
class Ply(Checked):
    """A layer of a laminate; `Sheet(plies=...)` lists them from the back to the front.

    Parameters
    ----------
    thickness : float
        m.
    youngs_modulus : (float, float) or float
        E1 along the fibers and E2 across, Pa; one number if the ply is isotropic.
    poissons_ratio : float
        nu12, the contraction across under a stress along the fibers.
    shear_modulus : float, optional
        G12, Pa; not of isotropic plies.
    angle : float
        Angle (degrees) of the fibers from direction 1 of the sheet, counter-clockwise seen from the
        front.
    density : float, optional
        kg/m3.
    strength : sequence of 5 floats, optional
        Largest stresses, Pa, all positive: along the fibers in tension and in compression, across
        in tension and in compression, and in shear. `margins` needs them.
    expansion : float or (float, float), optional
        Free strain per kelvin along the fibers and across, 1/K; for ``Temperature(...,
        expansion="plies")``.

    Examples
    --------
    >>> import foldyn as fd
    >>> carbon = {"youngs_modulus": (140e9, 10e9), "poissons_ratio": 0.3, "shear_modulus": 5e9}
    >>> plies = [fd.Ply(1.25e-4, angle=angle, **carbon) for angle in (0, 45, -45, 90)]
    >>> sheet = fd.Sheet(plies=[*plies, *plies[::-1]], direction=0.0)
    >>> first, second = sheet.moduli  # 0, 45, -45 and 90 degrees: alike in the plane
    >>> print(f"{first / second:.3f}, t = {sheet.thickness} m")
    1.000, t = 0.001 m
    """

    thickness: Length
    youngs_modulus: Moduli
    poissons_ratio: Ratio
    shear_modulus: Modulus | None = None
    angle: Annotated[float, Check(number, unit="degrees")] = 0.0
    density: Density | None = None
    strength: Annotated[Sequence[float] | None, Check(_strengths, unit="Pa")] = None
    expansion: Expansion | None = None

    def agree(self) -> None:
        """Refuse constants that do not fit together."""
        check_material(vars(self), ("shear_modulus",))

    @property
    def fibers(self) -> NDArray[np.float64]:
        """Stiffness (3, 3), Pa, along the fibers and across; see `plane_stress`."""
        return elastic(self.youngs_modulus, self.poissons_ratio, self.shear_modulus)

    @property
    def elastic(self) -> NDArray[np.float64]:
        """Stiffness (3, 3), Pa, along the axes of the sheet."""
        return turned_axes(self.fibers, math.radians(self.angle))


def pair(values: float | Sequence[float]) -> tuple[float, float]:
    """Values along and across the fibers, such as E1 and E2; of an isotropic material one twice."""
    first, second = np.broadcast_to(values, 2).tolist()
    return first, second


def elastic(
    moduli: float | Sequence[float], poissons_ratio: float, shear: float | None
) -> NDArray[np.float64]:
    """Stiffness (3, 3) in plane stress, Pa, of an isotropic or orthotropic material."""
    first, second = pair(moduli)
    if shear is None:
        return first / (1.0 - poissons_ratio**2) * isotropic(poissons_ratio)
    return plane_stress(first, second, poissons_ratio, shear)


def heights(plies: Sequence[Ply]) -> NDArray[np.float64]:
    """Bounds (k + 1,) of plies above the middle of the sheet, m."""
    bounds = np.cumsum([0.0, *(ply.thickness for ply in plies)])
    return bounds - 0.5 * bounds[-1]


def stiffness(plies: Sequence[Ply], power: int) -> NDArray[np.float64]:
    """A (N/m), B (N) or D (N m), (3, 3), of plies, for the powers 1 to 3 of the height."""
    z, own = heights(plies), np.array([ply.elastic for ply in plies])
    return np.einsum("k,kab->ab", np.diff(z**power) / power, own)


def expansion(plies: Sequence[Ply]) -> NDArray[np.float64]:
    """Free strains per kelvin (3,) of a sheet of plies: xx, yy, and twice xy; nan if unknown."""
    push = np.zeros(3)
    for ply in plies:
        own = math.nan if ply.expansion is None else ply.expansion
        along = turned_strain(math.radians(ply.angle))
        push += ply.thickness * along.T @ (ply.fibers @ [*pair(own), 0.0])
    return np.linalg.inv(stiffness(plies, 1)) @ push


def constants(name: str, plies: Sequence[Ply]) -> dict[str, Any]:
    """Thickness, density and moduli in the plane of a sheet of plies.

    Raises
    ------
    InputError
        Plies that are not symmetric about the middle, so that stretching bends the sheet; plies
        with and without a density.
    """
    stretching, coupling = stiffness(plies, 1), stiffness(plies, 2)
    thickness = float(np.ptp(heights(plies)))
    if np.abs(coupling).max() > COUPLED * thickness * np.abs(stretching).max():
        raise InputError(
            f": stretching bends them (B is up to {np.abs(coupling).max():.3g} N), which no model "
            "here has; list plies that are symmetric about the middle",
            name,
        )
    dense = [ply for ply in plies if ply.density is not None]
    if dense and len(dense) < len(plies):
        raise InputError(": some have a density and some have none; give all of them one", name)
    mass = sum(ply.thickness * ply.density for ply in dense)  # type: ignore[operator]
    soft = thickness * np.linalg.inv(stretching)
    return {
        "youngs_modulus": (float(1.0 / soft[0, 0]), float(1.0 / soft[1, 1])),
        "poissons_ratio": float(-soft[0, 1] / soft[0, 0]),
        "shear_modulus": float(1.0 / soft[2, 2]),
        "thickness": thickness,
        "density": mass / thickness if dense else None,
    }
