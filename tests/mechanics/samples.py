"""Structures that the tests of mechanics share, and their generic states."""

from __future__ import annotations

import numpy as np

import foldyn as fd
from named_models import named

SHEET = fd.Sheet(1e6, 0.25, 0.01, density=1000.0, length_scale_ratio=2.0)


def hexagon_and_friends() -> fd.Pattern:
    """A hexagon with a triangle and a quad on its sides, folded up."""
    angle = np.arange(6) * np.pi / 3
    ring = np.c_[np.cos(angle), 0.8 * np.sin(angle), np.zeros(6)]
    ring[1] += [0.15, 0.1, 0.0]
    wing = [[1.6, 1.0, 0.5], [-1.5, 0.1, 0.6], [-1.0, 1.2, 0.5]]
    vertices = np.vstack([ring, wing])
    vertices[7] = ring[3] + [-0.4, 0.5, 0.4]
    vertices[8] = ring[2] + [-0.4, 0.5, 0.4]
    return fd.Pattern(vertices, [[0, 1, 2, 3, 4, 5], [1, 0, 6], [3, 2, 8, 7]])


def l_shape() -> fd.Pattern:
    """A six-cornered panel with a reflex corner and a folded flap."""
    flat = [[0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0], [1, 2.2, 0], [0, 2.2, 0]]
    return fd.Pattern([*flat, [2.5, 0, 0.6], [2.6, 1, 0.6]], [[0, 1, 2, 3, 4, 5], [1, 6, 7, 2]])


CUBIC = fd.CustomHingeLaw(
    lambda t, r: 0.25 * (t - r) ** 4, lambda t, r: (t - r) ** 3, lambda t, r: 3.0 * (t - r) ** 2
)
ENHANCED = fd.EnhancedLinear(75, 285)
PUBLISHED = fd.EnhancedLinear(75, 285, rest="as_published")

MODELS = {
    "simple fold": (lambda: fd.patterns.simple_fold(1.0, 1.3, dihedral=60), {}),
    "miura n5b8": (lambda: fd.patterns.miura(dihedral=60), {"fold_law": ENHANCED}),
    "miura n5b8 merlin2": (
        lambda: fd.patterns.miura(a=1.0, b=1.4, dihedral=60),
        {"fold_law": PUBLISHED, "calibration": "merlin2"},
    ),
    "miura lopsided": (
        lambda: fd.patterns.miura(a=1.0, b=1.1, dihedral=120),
        {"fold_law": fd.EnhancedLinear(110, 200), "bend_law": fd.PlateSuperlinear(onset=30.0)},
    ),
    "miura n4b5": (
        lambda: fd.patterns.miura(a=1.0, b=1.2, dihedral=80),
        {"scheme": "n4b5", "bend_law": "linear", "bar_law": "linear"},
    ),
    "eggbox": (
        lambda: fd.patterns.eggbox(b=1.3),
        {"fold_law": "superlinear", "bend_law": ENHANCED, "bar_law": "linear"},
    ),
    "kresling": (fd.patterns.kresling, {"fold_law": "linear"}),
    "hexagon": (hexagon_and_friends, {"fold_law": ENHANCED}),
    "l shape": (l_shape, {"scheme": "n4b5"}),
    "miura, coupled": (lambda: fd.patterns.miura(dihedral=60), {"membrane": "panel"}),
    "hexagon, coupled": (hexagon_and_friends, {"membrane": "panel"}),
}
_made: dict[str, fd.Structure] = {}


def structure(name: str) -> fd.Structure:
    if name not in _made:
        make, options = MODELS[name]
        _made[name] = fd.discretize(make(), SHEET, **named({"membrane": "bars", **options}))
    return _made[name]


def state(s: fd.Structure, seed: int = 0, amplitude: float = 0.05) -> np.ndarray:
    """Displacements of the size of `amplitude` times the mean bar length."""
    generic = np.random.default_rng(seed).uniform(-1, 1, s.nodes.shape)
    return amplitude * s.bar_length.mean() * generic


def rotation(seed: int) -> np.ndarray:
    """A random proper rotation, usually a large one."""
    q, r = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))
    q = q * np.sign(np.diag(r))
    return q * np.sign(np.linalg.det(q))


def relative(a, b) -> float:
    """Norm of the difference over the norm of b."""
    return float(np.linalg.norm(np.asarray(a) - b) / np.linalg.norm(b))
