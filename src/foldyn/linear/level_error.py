"""Errors of the frequencies of superelements, from other levels and coarser meshes.

Each level contains the lower ones, so that frequencies fall with the level, toward those of the
shell. The next level alone is no measure of the error: some numbers of shapes do not rise from one
level to the next. So each level is compared with the highest one, and that with level 3, and the
differences are multiplied by `SHARES`, found to be large enough in 97 % of modes of 28 sheets
(docs/superelements.md). The error of the mesh is the difference between extrapolations from two
pairs of meshes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from foldyn.condensation import Superelements
from foldyn.condensation.shapes import LEVELS
from foldyn.condensation.term import SuperelementsTerm
from foldyn.linear.linearized import Linearized

LOWER = 3  # level with which the highest one is compared
SHARES = (2.0, 2.0, 2.0, 3.0, 1.0)  # error of each level / difference to the other one
LEAST = 1e-3  # error of every frequency, relative to it, that no comparison shows
TURN = 2.0 * np.pi


def other_level(structure: Superelements) -> Superelements:
    """The structure with the level to compare with."""
    highest = structure.options.level == len(LEVELS)
    return structure.at_level(LOWER if highest else len(LEVELS))


def frequency_errors(
    linear: Linearized, values: NDArray, shapes: NDArray, other: NDArray
) -> NDArray[np.float64]:
    """Bounds (k,), Hz, of the errors of frequencies relative to a shell on a fine mesh.

    values, shapes : (k,), (nf, k) the lowest modes of the linearized case.
    other : (k,) eigenvalues with the structure of `other_level`.
    """
    structure = linear.case.structure
    assert isinstance(structure, Superelements)
    own, level, mesh = (
        np.sqrt(each.clip(min=0.0)) / TURN
        for each in (values, other, _on_coarse_meshes(linear, values, shapes))
    )
    share = SHARES[structure.options.level - 1]
    return share * np.abs(level - own) + np.abs(mesh - own) + LEAST * own


def _on_coarse_meshes(linear: Linearized, values: NDArray, shapes: NDArray) -> NDArray:
    """Eigenvalues (k,) with panels from coarser meshes, in the space of these modes."""
    case, own = linear.case, linear.case.elastic_body.sheet
    assert isinstance(case.structure, Superelements)
    assert isinstance(own, SuperelementsTerm)
    other = case.structure.term(case.held_edges, compared=True)
    motion = linear.whole(shapes)
    change = other.tangent(motion[:, 0]) - own.tangent(motion[:, 0])
    stiffness = np.diag(values) + motion.T @ (change @ motion)
    mass = np.eye(len(values)) + motion.T @ ((other.mass - own.mass) @ motion)
    return eigh(0.5 * (stiffness + stiffness.T), 0.5 * (mass + mass.T), eigvals_only=True)
