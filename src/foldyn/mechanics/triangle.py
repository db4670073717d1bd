"""Stiffness of flat triangles: constant strain and curvature, and quadratic displacements.

Quadratic triangles, in plane stress, have corners and side midpoints. They are computed for eight
models of one topology at once, as in `mechanics.lanes`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import inner_scalar, kernel
from foldyn.jit.eights import COUNT, eight, put


def normals_of(corners: NDArray) -> tuple[NDArray, NDArray]:
    """Unit normals (t, 3) and areas (t,) of triangles (t, 3, 3)."""
    twice = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(twice, axis=1)
    return twice / size[:, None], 0.5 * size


def triangle_stiffness(
    corners: NDArray, stretching: NDArray, bending: NDArray, first: NDArray | None = None
) -> tuple[NDArray, NDArray]:
    """Membrane and bending stiffness (nt, 3, 3) of triangles with corners (nt, 3, 3).

    The matrices act on the side strains, and on the turns of the sheet at the sides relative to the
    plane of the corners (Morley). Side k runs from corner k to corner k + 1.

    Parameters
    ----------
    corners : (nt, 3, 3)
    stretching, bending : (3, 3)
        Of the sheet, see `plane_stress`: N/m and N m per unit of xx, yy, and twice xy.
    first : (nt, 3), optional
        Unit vectors along x in the triangles' planes; by default along the first sides, as the axes
        of an isotropic sheet do not matter.

    Returns
    -------
    membrane, bending : (nt, 3, 3)
        J per strain squared; N m per rad squared.
    """
    side = np.roll(corners, -1, axis=1) - corners
    normal = np.cross(side[:, 0], side[:, 1])
    twice = np.linalg.norm(normal, axis=1)
    area = 0.5 * twice
    length = np.linalg.norm(side, axis=2)
    e1 = side[:, 0] / length[:, :1] if first is None else first
    e2 = np.cross(normal / twice[:, None], e1)
    tx = np.einsum("tki,ti->tk", side, e1) / length
    ty = np.einsum("tki,ti->tk", side, e2) / length
    along = np.stack([tx * tx, ty * ty, tx * ty], axis=2)  # e = along eps
    across = np.stack([ty * ty, tx * tx, -2.0 * tx * ty], axis=1)  # kappa = across beta
    across = across * (length / area[:, None])[:, None, :]
    strain = np.linalg.inv(along)
    membrane = np.einsum("tak,ab,tbl,t->tkl", strain, stretching, strain, area)
    curved = np.einsum("tak,ab,tbl,t->tkl", across, bending, across, area)
    return membrane, curved


def plane_stress(
    first: float, second: float, poissons_ratio: float, shear: float
) -> NDArray[np.float64]:
    """Stiffness (3, 3) in plane stress on strains xx, yy, and twice xy, along the material's axes.

    Parameters
    ----------
    first, second : float
        Moduli along x and y.
    poissons_ratio : float
        Contraction along y over the strain along x, under a stress along x.
    shear : float
    """
    across = poissons_ratio * second
    rest = 1.0 - poissons_ratio * across / first
    return np.array(
        [[first / rest, across / rest, 0.0], [across / rest, second / rest, 0.0], [0.0, 0.0, shear]]
    )


def isotropic(poissons_ratio: float) -> NDArray[np.float64]:
    """`plane_stress` of an isotropic sheet, divided by E/(1 - nu^2)."""
    nu = poissons_ratio
    return np.array([[1.0, nu, 0.0], [nu, 1.0, 0.0], [0.0, 0.0, 0.5 * (1.0 - nu)]])


def turned_strain(angle: NDArray | float) -> NDArray[np.float64]:
    """Strains (3, 3, ...) along axes turned by an angle (rad), of unit xx, yy, and twice xy."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array(
        [[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2 * c * s, 2 * c * s, c * c - s * s]]
    )


def turned_axes(stiffness: NDArray, angle: NDArray | float) -> NDArray[np.float64]:
    """Stiffness (..., 3, 3) along axes from which the material's are turned by an angle, rad."""
    strain = turned_strain(angle)
    return np.einsum("ba...,...bc,cd...->...ad", strain, stiffness, strain)


MIDDLES = 0.5 * (np.ones((3, 3)) - np.eye(3))  # side midpoints, an exact quadrature


def products() -> NDArray:
    """Integrals (6, 2, 6, 2) of products of shape function slopes, divided by twice the area.

    Slopes are derivatives with respect to the two coordinates that are 1 at the second and at the
    third corner.
    """
    out, linear = np.zeros((6, 2, 6, 2)), np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])
    for place in MIDDLES:
        after = np.roll(np.eye(3), -1, axis=0)
        corners = (4 * place - 1)[:, None] * np.eye(3)
        middles = 4 * (np.roll(place, -1)[:, None] * np.eye(3) + place[:, None] * after)
        shapes = np.concatenate([corners, middles]) @ linear
        out += np.einsum("ar,bs->arbs", shapes, shapes) / 6.0
    return out


PRODUCTS = products()


def squares(corners: NDArray, stiffness: NDArray) -> NDArray:
    """Products (nt, 4, 4, 8) of two slopes, times stiffness and twice the area.

    Slopes are gradients of the two coordinates of `products`, two numbers each.
    corners : (nt, 3, 2, 8), counter-clockwise.
    stiffness : (nt, 8) E t/(1 - nu^2).
    """
    (a, b), (c, d) = np.moveaxis(corners[:, 1:] - corners[:, :1], (1, 2), (0, 1))
    twice = a * d - b * c
    slopes = np.stack([d, -b, -c, a], axis=1)
    return (stiffness / twice)[:, None, None] * slopes[:, :, None] * slopes[:, None]


@inner_scalar
def turned(products, a, b, numbers, at):
    """Sum of four slope products at two points of a triangle."""
    return (
        products[a, 0, b, 0] * eight(numbers, at)
        + products[a, 0, b, 1] * eight(numbers, at + COUNT)
        + products[a, 1, b, 0] * eight(numbers, at + 4 * COUNT)
        + products[a, 1, b, 1] * eight(numbers, at + 5 * COUNT)
    )


@kernel
def add_triangles(elements, starts, places, shapes, squares, products, ratio, numbers):
    """Add the stiffness of triangles to `numbers`.

    elements : (nt, 6) points of the triangles.
    starts : (n + 1,) start of each point's unknowns; each has two eights in `shapes`.
    places : positions in `numbers` of the entries of all triangles in turn, for ordered pairs of
    points and of their unknowns; negative for entries to skip, such as half of a symmetric matrix.
    squares, ratio : see `squares`; (8,) Poisson's ratio.
    """
    nu, k = eight(ratio, 0), 0
    shear = 0.5 - 0.5 * nu
    for e in range(elements.shape[0]):
        for a in range(6):
            one = elements[e, a]
            for b in range(6):
                other, at = elements[e, b], 16 * COUNT * e
                xx = turned(products, a, b, squares, at)
                xy = turned(products, a, b, squares, at + 2 * COUNT)
                yx = turned(products, a, b, squares, at + 8 * COUNT)
                yy = turned(products, a, b, squares, at + 10 * COUNT)
                first, last = xx + shear * yy, yy + shear * xx
                across, back = nu * xy + shear * yx, nu * yx + shear * xy
                for i in range(starts[one], starts[one + 1]):
                    at = 2 * COUNT * i
                    x, y = eight(shapes, at), eight(shapes, at + COUNT)
                    left, right = x * first + y * back, x * across + y * last
                    for j in range(starts[other], starts[other + 1]):
                        at = np.int64(places[k])
                        k += 1
                        if at >= 0:
                            x, y = (
                                eight(shapes, 2 * COUNT * j),
                                eight(shapes, 2 * COUNT * j + COUNT),
                            )
                            put(numbers, at, eight(numbers, at) + left * x + right * y)
