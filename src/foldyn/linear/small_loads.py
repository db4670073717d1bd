"""Displacements under small loads: the linear equilibrium about rest."""

from __future__ import annotations

import warnings
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.algebra.superlu import factorize
from foldyn.cases import Case
from foldyn.errors import FoldynWarning
from foldyn.linear.linearized import linearize
from foldyn.mechanics.following import following_force, joined


class SmallLoads(NamedTuple):
    """Forces in full, with the stiffness of the sheet at rest.

    Attributes
    ----------
    work : float
        Forces times displacements, J.
    load : float
        Sum of the magnitudes of the components of all forces, N.
    """

    work: float
    load: float

    @property
    def displacement(self) -> float:
        """Mean displacement (m) along the forces, weighted by them."""
        return self.work / self.load


def forces_alone(case: Case) -> tuple[Case, list[int]]:
    """The case with only the loads that are forces, and the numbers of the others.

    Nodal forces, gravity and pressure are kept; loads that turn or heat parts are not.
    """
    structure = case.structure
    others = []
    for i, load in enumerate(case.loads):
        place = f"loads[{i}]"
        part = load.following(structure, place)
        turns = part is not None and any(map(len, (part.moment, part.tension, part.push)))
        changes = load.rest_changes(structure, place) is not None
        if turns or changes or load.turns(structure, place) is not None:
            others.append(i)
    kept = [load for i, load in enumerate(case.loads) if i not in others]
    return case.altered(loads=kept), others


def rest_forces(case: Case) -> NDArray:
    """Forces (3n,), N, of a case's loads in full, in its rest state."""
    nodes = case.structure.nodes
    total = sum((force for force, _ in case.load_terms), np.zeros(nodes.shape)).ravel()
    following = joined((part, 0) for part, _ in case.following_terms)
    if not following.acts:
        return total
    at_rest = case.body.dofs(np.zeros_like(nodes))
    return total + following_force(following, at_rest, np.ones((1, 1)))[: total.size]


def small_loads(case: Case, secant: float | None = None) -> SmallLoads:
    """Work of a case's forces in the linear equilibrium about rest.

    Parameters
    ----------
    case : Case
        Its supports and hinges resist every motion.
    secant : float, optional
        As in `modes`.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)
        linear = linearize(case, secant=secant)
    force = rest_forces(case)
    free = linear.projected(force)
    work = float(free @ factorize(linear.stiffness).solve(free))
    return SmallLoads(work, float(np.abs(force).sum()))
