"""The triangle: constant strains from its sides, constant curvatures from rotations about them.

With the unit tangents t_k and outward normals n_k of the sides (in the plane of the triangle),
their lengths L_k and the area A:

membrane   t_k . eps t_k = e_k,  e_k = (l_k^2 / L_k^2 - 1) / 2 the Green strain along side k,
bending    kappa = sum_k (L_k / A) beta_k n_k n_k^T,  beta_k the rotation, about side k, of the
           sheet at the middle of that side against the plane of the triangle

(Morley, Aeronaut. Quart. 19, 1968; for large rotations with hinges: Phaal and Calladine, Int. J.
Numer. Methods Eng. 35, 1992). Plane stress with E, nu, t gives energies e K_m e / 2 and
beta K_b beta / 2.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foldyn.structures import Sheet


def plane_stress(nu: float) -> NDArray:
    """Matrix (3, 3) on (xx, yy, gamma xy), without E t / (1 - nu^2)."""
    return np.array([[1.0, nu, 0.0], [nu, 1.0, 0.0], [0.0, 0.0, 0.5 * (1.0 - nu)]])


def side_stiffness(corners: NDArray, sheet: Sheet) -> tuple[NDArray, NDArray]:
    """Membrane and bending stiffness (nt, 3, 3) of triangles with corners (nt, 3, 3).

    Side k runs from corner k to corner k + 1. Units: J (per strain squared), N m (per rad squared).
    """
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(first, second)
    twice = np.linalg.norm(normal, axis=1)
    area = 0.5 * twice
    e1 = first / np.linalg.norm(first, axis=1)[:, None]
    e2 = np.cross(normal / twice[:, None], e1)
    side = np.roll(corners, -1, axis=1) - corners
    length = np.linalg.norm(side, axis=2)
    tx = np.einsum("tki,ti->tk", side, e1) / length
    ty = np.einsum("tki,ti->tk", side, e2) / length
    along = np.stack([tx * tx, ty * ty, tx * ty], axis=2)  # e = along eps
    across = np.stack([ty * ty, tx * tx, -2.0 * tx * ty], axis=1)  # kappa = across beta
    across = across * (length / area[:, None])[:, None, :]
    elastic = plane_stress(sheet.poissons_ratio)
    stretch = sheet.youngs_modulus * sheet.thickness / (1.0 - sheet.poissons_ratio**2)
    strain = np.linalg.inv(along)
    membrane = np.einsum("tak,ab,tbl,t->tkl", strain, elastic, strain, area * stretch)
    bending = np.einsum("tak,ab,tbl,t->tkl", across, elastic, across, area * sheet.bending_modulus)
    return membrane, bending


def without_free_sides(bending: NDArray, free: NDArray) -> NDArray:
    """Bending stiffness (nt, 3, 3) without moment about the sides `free` (nt, 3)."""
    out = bending.copy()
    for k in range(3):
        rows = np.flatnonzero(free[:, k])
        part = out[rows]
        column = part[:, :, k]
        pivot = np.where(column[:, k] > 0.0, column[:, k], 1.0)
        part = part - np.einsum("ti,tj->tij", column, column) / pivot[:, None, None]
        part[:, k, :] = part[:, :, k] = 0.0
        out[rows] = part
    return out
