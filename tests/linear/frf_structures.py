"""Structures whose frequency response is known."""

from __future__ import annotations

import numpy as np

import foldyn as fd
from foldyn.structures import ModelOptions

STIFFNESS = (100.0, 60.0)  # N/m
MASSES = (0.5, 0.4)  # kg


def chain(stiffness=STIFFNESS, masses=MASSES, **damping) -> fd.Case:
    """Masses on bars in a row along x, node 0 held; linear for motions small against 2 m."""
    n, length, area = len(masses) + 1, 2.0, 1e-4
    nodes = np.zeros((n, 3))
    nodes[:, 0] = length * np.arange(n)
    structure = fd.Structure(
        nodes=nodes,
        bars=np.array([[i, i + 1] for i in range(n - 1)]),
        bar_area=area * np.array(stiffness) / stiffness[0],
        sheet=fd.Sheet(stiffness[0] * length / area, 0.3, 0.01),
        options=ModelOptions(bar_law="linear"),
        node_mass=np.array([1.0, *masses]),
    )
    supports = [fd.Fix([0], "xyz"), fd.Fix(list(range(1, n)), "yz")]
    return fd.Case(structure, supports, damping=fd.Rayleigh(**damping))


def chain_matrices(stiffness=STIFFNESS, masses=MASSES) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and mass of `chain`, written down by hand."""
    k = np.diag(np.array(stiffness) + np.array([*stiffness[1:], 0.0]))
    for i, value in enumerate(stiffness[1:]):
        k[i, i + 1] = k[i + 1, i] = -value
    return k, np.diag(masses)


def chain_response(f, alpha=0.0, beta=0.0, rate=0.0, **given) -> np.ndarray:
    """Receptance matrix (m, n, n) of `chain` at s = 2 pi i f + rate, by dense inversion."""
    k, m = chain_matrices(**given)
    s = (2j * np.pi * np.asarray(f, float) + rate)[:, None, None]
    return np.linalg.inv(s**2 * m + s * (alpha * m + beta * k) + k)


def chain_modes(alpha=0.0, beta=0.0, **given) -> tuple[np.ndarray, np.ndarray]:
    """Natural frequencies (Hz) and damping ratios of `chain`."""
    k, m = chain_matrices(**given)
    omega = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(m, k)).real))
    return omega / (2 * np.pi), alpha / (2 * omega) + beta * omega / 2


def flap(alpha=0.0, beta=0.0, law="superlinear") -> fd.Case:
    """Two triangles with one fold, one of them held: node 3 swings about the crease."""
    vertices = [[0, 0, 0], [0, 1, 0], [-0.8, 0.5, 0.0], [0.8, 0.5, 0.0]]
    pattern = fd.Pattern(vertices, ((0, 1, 2), (0, 3, 1)))
    sheet = fd.Sheet(1e4, 0.25, 0.01, density=1.0)
    s = fd.discretize(
        pattern, sheet, scheme="n4b5", fold_law=law, crease_stiffness=0.05, preset="herkal"
    )
    return fd.Case(s, [fd.Fix([0, 1, 2], "xyz")], damping=fd.Rayleigh(alpha, beta))


def smooth_miura(mass="circumcenter", **model) -> fd.Structure:
    """A Miura unit cell of linear laws: 39 dofs."""
    pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=60)
    linear = dict.fromkeys(("bar_law", "fold_law", "bend_law"), "linear")
    sheet = fd.Sheet(1e6, 0.25, 0.01, density=1.0)
    return fd.discretize(pattern, sheet, preset="herkal", mass=mass, **(linear | model))


def miura_case(loads=(), mass="circumcenter", alpha=0.5, beta=0.0, **model) -> fd.Case:
    """The supports of the paper's case 2 on a smooth Miura unit cell."""
    supports = [fd.Fix([0, 1, 2], "x"), fd.Fix([0, 2, 6, 8], "z"), fd.Fix([1], "y")]
    return fd.Case(smooth_miura(mass, **model), supports, loads, fd.Rayleigh(alpha, beta))


def largest_error(found, exact) -> float:
    """Largest difference of two responses as a fraction of the largest response."""
    return float(np.abs(np.asarray(found) - exact).max() / np.abs(exact).max())
