"""Thin plates by other means: Ritz's method, Navier's series; published values with sources."""

from __future__ import annotations

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy.linalg import eigh

# Timoshenko and Woinowsky-Krieger, Theory of Plates and Shells, 2nd edition, 1959: deflection of
# the middle of square plates over q a^4 / D (tables 8 and 35) and over P a^2 / D (tables 23 and 37)
DEFLECTION = {
    ("clamped", "uniform"): 0.00126,
    ("clamped", "center"): 0.00560,
    ("supported", "uniform"): 0.00406,
    ("supported", "center"): 0.01160,
}

# J. B. Kosmatka, Int. J. Numer. Methods Eng. 37, 431-455, 1994: a cantilever of graphite and epoxy,
# 9 x 3 x 0.1 in, of plies from one face to the middle; Hz, measured at NASA Lewis by holography,
# and by his element, which shears
KOSMATKA = {
    "plies": (22.5, -22.5, 0.0, 0.0, -22.5, 0.0, 0.0, 22.5, 0.0, 0.0),
    "moduli": (22.43e6, 1.45e6, 0.917e6),  # psi
    "measured": np.array([69.0, 270.0, 427.0, 890.0, 1155.0, 1426.0]),
    "element": np.array([70.0, 271.0, 433.8, 888.3, 1196.5, 1370.9]),
}


def ritz_frequencies(
    bending: NDArray, clamped: bool, sides: tuple[float, float] = (1.0, 1.0), terms: int = 12
) -> NDArray:
    """Omega sqrt(rho t) of a plate, free or clamped where x is 0, ascending.

    Legendre polynomials, times x^2 for the clamped edge: exact to 1e-4 with 12 terms.

    bending : (3, 3) of curvatures xx, yy and twice xy.
    """
    point, weight = legendre.leggauss(terms + 8)
    x, weight = 0.5 * (point + 1.0), 0.5 * weight

    def functions(held: bool) -> NDArray:
        """Functions, slopes and curvatures (3, terms, points)."""
        rows = []
        for k in range(terms):
            p = legendre.Legendre.basis(k, [0, 1])
            f = [p(x), p.deriv()(x), p.deriv(2)(x)]
            if held:
                f = [x**2 * f[0], 2 * x * f[0] + x**2 * f[1], 2 * f[0] + 4 * x * f[1] + x**2 * f[2]]
            rows.append(f)
        return np.array(rows).transpose(1, 0, 2)

    along, across = functions(clamped), functions(False)
    a, b = sides
    curvatures = (2, 0, 1.0 / a**2), (0, 2, 1.0 / b**2), (1, 1, 2.0 / (a * b))

    def both(i: int, j: int, k: int, m: int) -> NDArray:
        return np.kron((along[i] * weight) @ along[j].T, (across[k] * weight) @ across[m].T)

    stiffness = sum(
        bending[r, s] * p * q * both(i, j, k, m)
        for r, (i, k, p) in enumerate(curvatures)
        for s, (j, m, q) in enumerate(curvatures)
    )
    found = np.sqrt(np.abs(eigh(stiffness, both(0, 0, 0, 0), eigvals_only=True)))
    return found if clamped else found[3:]  # without the rigid motions


def navier_deflection(load: str) -> float:
    """Deflection of the middle of a simply supported square plate, as in `DEFLECTION`."""
    m = np.arange(1.0, 400.0, 2.0)
    square = (m[:, None] ** 2 + m**2) ** 2
    if load == "center":
        return float(4.0 / np.pi**4 * (1.0 / square).sum())
    signs = (-1.0) ** ((m - 1.0) / 2.0)
    return float(16.0 / np.pi**6 * (signs[:, None] * signs / (m[:, None] * m * square)).sum())
