"""Bonded layers of isotropic materials, which bend when they get warm."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from foldyn.arguments import Check, Checked
from foldyn.errors import InputError
from foldyn.structures.sheet import Sheet
from foldyn.values import length, number, show, single


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
