"""Stiffness of flat triangles: constant in-plane strain, constant curvature."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def triangle_stiffness(
    corners: NDArray, poissons_ratio: float, stretching: float, bending: float
) -> tuple[NDArray, NDArray]:
    """Membrane and bending stiffness (nt, 3, 3) of triangles with corners (nt, 3, 3).

    They act on the side strains, and on the turns of the sheet at the sides relative to the plane
    of the corners (Morley). Side k runs from corner k to corner k + 1.

    Parameters
    ----------
    corners : (nt, 3, 3)
    poissons_ratio : float
    stretching, bending : float
        E t/(1 - nu^2), N/m, and E t^3/(12 (1 - nu^2)), N m.

    Returns
    -------
    membrane, bending : (nt, 3, 3)
        J per strain squared; N m per rad squared.
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
    nu = poissons_ratio
    # plane stress on (xx, yy, gamma xy), without E t / (1 - nu^2)
    elastic = np.array([[1.0, nu, 0.0], [nu, 1.0, 0.0], [0.0, 0.0, 0.5 * (1.0 - nu)]])
    strain = np.linalg.inv(along)
    membrane = np.einsum("tak,ab,tbl,t->tkl", strain, elastic, strain, area * stretching)
    curved = np.einsum("tak,ab,tbl,t->tkl", across, elastic, across, area * bending)
    return membrane, curved
