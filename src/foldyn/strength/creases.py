"""Moments of creases: what a crease itself transmits, without the turns of the panels beside it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foldyn.condensation import Superelements
from foldyn.materials.inelastic_law import memory_of
from foldyn.materials.series import in_series
from foldyn.mechanics import angles
from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.sheet_term import NO_DOF
from foldyn.structures.discretized import Discretized
from foldyn.structures.mesh import lengths


def crease_moments(structure: Discretized, body: Assembly, q: NDArray) -> NDArray[np.float64]:
    """Moments (nf,) of the creases per length, N, positive if the crease is too far open.

    The mean along each crease. Moments of laws with memory are those of their elastic part.

    q : (m,) dofs of `body`, whose folds may be actuated.
    """
    law = structure.fold_law
    memory = memory_of(law)
    law, length = law if memory is None else memory.elastic, crease_lengths(structure)
    sheet, hinges = body.sheet, body.sheet.fold_hinges()
    if isinstance(structure, Superelements):
        assert sheet.crease_turns is not None
        rest, change = structure.fold_rest, hinges.rest - structure.fold_rest
        at_rest = in_series(law, structure.pattern.dihedrals, rest, 1.0)[1]
        turned = -(sheet.crease_turns.mean @ q) - change
        return (structure.fold_stiffness * at_rest + structure.slope * turned) / length
    x = structure.nodes + q[: structure.nodes.size].reshape(-1, 3)
    corners = np.arange(hinges.corners.size // 3).reshape(-1, 4)
    theta = np.where(
        hinges.alone, angles(hinges.corners.reshape(-1, 3), corners), angles(x, hinges.nodes)
    )
    hidden = np.where(hinges.hidden == NO_DOF, 0, hinges.hidden)
    theta = theta - (hinges.hidden_turn * q[hidden]).sum(axis=1)
    if sheet.offsets:
        theta = theta + sheet.rest_angles[-sheet.offsets :][hinges.fold]
    share = structure.hinge_kinds[0].share[hinges.fold]
    moment = hinges.stiffness * in_series(law, theta, hinges.rest, share)[1]
    return np.bincount(hinges.fold, moment, len(length)) / length


def crease_lengths(structure: Discretized) -> NDArray[np.float64]:
    """Lengths (nf,) of the creases, m."""
    return lengths(structure.pattern.vertices, structure.pattern.creases)
