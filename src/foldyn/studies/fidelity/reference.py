"""The shell's modes of a case, extrapolated in the size of its mesh."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from foldyn.errors import FoldynWarning
from foldyn.linear import modes
from foldyn.patterns import Pattern
from foldyn.shells import shell
from foldyn.structures import Sheet
from foldyn.structures.discretized import Discretized
from foldyn.structures.mesh import n5b8
from foldyn.studies.fidelity.cases import FidelityCase

COARSE, FINE = 6, 12  # divisions of the two meshes
MODES = 10  # elastic ones, the lowest
FIRST_OF_A_SQUARE = 13.47  # omega L^2 sqrt(rho t/G) of a free square plate, nu = 0.3 (Leissa 1973)
BELOW = 0.6  # of that frequency: modes that are compared


@dataclass(frozen=True, eq=False)
class Reference:
    """Modes of the shell.

    Attributes
    ----------
    frequency, coarse, fine : (k,)
        Elastic frequencies extrapolated from two meshes, and those of the meshes, Hz.
    shape : (k, n, 3)
        Shapes of the fine mesh at the nodes of bars and hinges: the vertices, and the centers of
        panels of more than three corners where the mesh has a node there.
    seen : (n,)
        Whether the mesh has a node there.
    """

    frequency: NDArray
    coarse: NDArray
    fine: NDArray
    shape: NDArray
    seen: NDArray


def plate_frequency(pattern: Pattern, sheet: Sheet) -> float:
    """First frequency (Hz) of a free square plate, as large as the largest panel.

    Its side is the longest edge, or the root of the largest area where that is longer: in panels
    of five corners and more.
    """
    ends = pattern.vertices[pattern.edges]
    longest = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).max()
    longest = float(max(longest, np.sqrt(pattern.face_areas.max())))
    assert sheet.density is not None
    speed = (sheet.bending_modulus / (sheet.density * sheet.thickness)) ** 0.5
    return FIRST_OF_A_SQUARE / (2.0 * np.pi) * speed / longest**2


def elastic(case: FidelityCase, structure: Discretized, count: int) -> tuple[NDArray, NDArray]:
    """The lowest elastic frequencies (k,), Hz, and shapes (k, n, 3) of a structure."""
    held = case.case(structure)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)
        found = modes(held, min(count + 6, len(held.free_dofs)))
    kept = found["eigenvalue"].values > 0.0
    return found["frequency"].values[kept][:count], found["shape"].values[kept][:count]


def reference(case: FidelityCase) -> Reference:
    """Modes of a case by the shell, frequencies extrapolated with the square of the mesh size."""
    pattern = case.pattern()
    nodes = n5b8(pattern).nodes
    meshes = [shell(pattern, case.sheet, divisions=n, mass="consistent") for n in (COARSE, FINE)]
    (coarse, _), (fine, shape) = (elastic(case, mesh, MODES) for mesh in meshes)
    apart, place = cKDTree(meshes[1].nodes).query(nodes)
    ratio = (FINE / COARSE) ** 2
    frequency = fine + (fine - coarse) / (ratio - 1.0)
    return Reference(frequency, coarse, fine, shape[:, place], apart < 1e-6 * pattern.size)
