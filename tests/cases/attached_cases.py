"""Small structures of all models for tests of springs, clamps and point masses."""

from __future__ import annotations

import numpy as np

import foldyn as fd

SHEET = fd.Sheet(youngs_modulus=1e6, poissons_ratio=0.3, thickness=0.01)
SQUARE = fd.Pattern([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]])
FOLD = fd.patterns.simple_fold(a=1.0, b=1.3, dihedral=100)
MODELS = {
    "bars and hinges": lambda pattern, sheet, **options: fd.discretize(
        pattern, sheet, **{"bend_law": "linear", "fold_law": "linear", **options}
    ),
    "n5b8e": lambda pattern, sheet, **options: fd.discretize(
        pattern, sheet, **{"preset": "n5b8e", "fold_law": "linear", **options}
    ),
    "shell": lambda pattern, sheet, **options: fd.shell(
        pattern, sheet, **{"divisions": 1, "fold_law": "linear", **options}
    ),
}


def structure(model: str, pattern: fd.Pattern = SQUARE, sheet: fd.Sheet = SHEET, **options):
    return MODELS[model](pattern, sheet, **options)


def everywhere(s) -> list[int]:
    return list(range(len(s.nodes)))


def moved(s, size: float, seed: int = 3) -> np.ndarray:
    """A state of all dofs of its body, displacements of this size (m)."""
    return size * np.random.default_rng(seed).standard_normal(s.body.size)


def derivative_errors(body, q: np.ndarray) -> tuple[float, float]:
    """Relative errors of the forces and the tangent of a body against central differences."""
    h, force, matrix = 1e-6, body.internal(q), body.tangent(q).toarray()
    steps = [(q + h * e, q - h * e) for e in np.eye(body.size)]
    slope = np.array([body.energies(a).sum() - body.energies(b).sum() for a, b in steps]) / (2 * h)
    rows = np.array([body.internal(a) - body.internal(b) for a, b in steps]) / (2 * h)
    assert np.abs(matrix - matrix.T).max() <= 1e-12 * np.abs(matrix).max()
    return (
        float(np.abs(slope - force).max() / np.abs(force).max()),
        float(np.abs(rows - matrix).max() / np.abs(matrix).max()),
    )
