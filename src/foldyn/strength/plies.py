"""Factors by which stresses may grow until a ply of a laminate fails.

Stresses of plies follow from forces N and moments M by classical lamination theory: the strain at a
height z is A^-1 N + z D^-1 M. With the strengths of a ply along its fibers (X) and across (Y), in
tension (t) and in compression (c), and in shear (S), a ply fails

- by maximum stress, where a component reaches its strength;
- by Tsai and Wu (J. Compos. Mater. 5, 1971), where

      s1^2/(Xt Xc) + s2^2/(Yt Yc) + s12^2/S^2 - s1 s2/sqrt(Xt Xc Yt Yc)
          + s1 (1/Xt - 1/Xc) + s2 (1/Yt - 1/Yc) = 1.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from foldyn.mechanics.triangle import turned_axes, turned_strain
from foldyn.structures.ply import heights
from foldyn.structures.sheet import Sheet

MAXIMUM_STRESS, TSAI_WU = "maximum_stress", "tsai_wu"
CRITERIA = (TSAI_WU, MAXIMUM_STRESS)


def ply_factors(
    sheet: Sheet, force: NDArray, moment: NDArray, angle: NDArray, criterion: str
) -> NDArray[np.float64]:
    """Least factors (..., p) of all plies with a strength; inf without stress.

    Parameters
    ----------
    sheet : Sheet
        With plies.
    force, moment : (..., p, 3)
        N/m and N, along axes of the panels.
    angle : (p,)
        Of direction 1 of the sheet from the first axis, rad.
    criterion : {"tsai_wu", "maximum_stress"}
    """
    soft = np.linalg.inv(turned_axes(sheet.stretching, angle))
    bent = np.linalg.inv(turned_axes(sheet.bending, angle))
    strain = np.einsum("pab,...pb->...pa", soft, force)
    curvature = np.einsum("pab,...pb->...pa", bent, moment)
    plies = sheet.plies or ()
    bounds, least = heights(plies), np.full(force.shape[:-1], np.inf)
    for ply, low, high in zip(plies, bounds[:-1], bounds[1:], strict=True):
        if ply.strength is None:
            continue
        along = turned_strain(angle + np.radians(ply.angle))
        for z in (low, high):
            stress = np.einsum("ab,bcp,...pc->...pa", ply.fibers, along, strain + z * curvature)
            own = (_tsai_wu if criterion == TSAI_WU else _maximum_stress)(stress, ply.strength)
            least = np.minimum(least, own)
    return least


def _maximum_stress(stress: NDArray, strength: Sequence[float]) -> NDArray[np.float64]:
    xt, xc, yt, yc, shear = strength
    first, second, mixed = np.moveaxis(stress, -1, 0)
    used = [first / xt, -first / xc, second / yt, -second / yc, np.abs(mixed) / shear]
    with np.errstate(divide="ignore"):
        return 1.0 / np.max(used, axis=0)


def _tsai_wu(stress: NDArray, strength: Sequence[float]) -> NDArray[np.float64]:
    """The positive root of a f^2 + b f = 1."""
    xt, xc, yt, yc, shear = strength
    first, second, mixed = np.moveaxis(stress, -1, 0)
    a = first**2 / (xt * xc) + second**2 / (yt * yc) + (mixed / shear) ** 2
    a -= first * second / np.sqrt(xt * xc * yt * yc)
    b = first * (1.0 / xt - 1.0 / xc) + second * (1.0 / yt - 1.0 / yc)
    with np.errstate(divide="ignore"):
        return 2.0 / (b + np.sqrt(b * b + 4.0 * a))
