"""Point masses, which nodes carry in addition to the mass of the sheet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from foldyn.arguments import Check
from foldyn.cases.decode import Part, PartOf
from foldyn.cases.selection import Nodes, resolve_nodes
from foldyn.structures.discretized import Discretized
from foldyn.values import number


@dataclass(frozen=True)
class PointMass(Part):
    """The same point mass on each of some nodes.

    A point mass moves with its node along x, y and z. It counts in motions, modes, frequency
    responses, gravity and inertia relief.

    Parameters
    ----------
    nodes : int, sequence of int, or str
        Node numbers, or an expression that selects vertices ("xmin", "zmax and y>0").
    mass : float
        Mass (kg) on each of these nodes, above 0.
    """

    nodes: Nodes
    mass: Annotated[float, Check(number, above=0.0, unit="kg")]


def nodal_masses(masses: Sequence[PointMass], structure: Discretized) -> NDArray[np.float64]:
    """Sum (n,) of point masses on each node, kg."""
    total = np.zeros(len(structure.nodes))
    for i, part in enumerate(masses):
        total[resolve_nodes(structure, part.nodes, f"masses[{i}].nodes")] += part.mass
    return total


MASS = PartOf((PointMass,), "masses")
"""A point mass in a case file."""
