"""What nodes carry in addition to the mass of the sheet: point masses and struts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from scipy import sparse

from foldyn.arguments import Check
from foldyn.cases.decode import Part, PartOf
from foldyn.cases.selection import Nodes, resolve_nodes
from foldyn.cases.springs import Bar
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


def carried_mass(
    masses: Sequence[PointMass], supports: Sequence[Any], structure: Discretized
) -> sparse.csr_array:
    """Mass matrix (n, n), kg, of point masses, and of bars, which stay straight."""
    ends, entries, size = [np.zeros((2, 0), np.int64)], [np.zeros(0)], len(structure.nodes)
    for i, part in enumerate(masses):
        nodes = resolve_nodes(structure, part.nodes, f"masses[{i}].nodes")
        ends.append(np.stack([nodes, nodes]))
        entries.append(np.full(len(nodes), part.mass))
    for i, part in enumerate(supports):
        for k, pair in enumerate(part.between if isinstance(part, Bar) and part.mass else ()):
            a, b = resolve_nodes(structure, pair, f"supports[{i}].between[{k}]").tolist()
            ends.append(np.array([[a, a, b, b], [a, b, a, b]]))
            entries.append(part.mass / 6.0 * np.array([2.0, 1.0, 1.0, 2.0]))
    places = np.concatenate(ends, axis=1)
    return sparse.csr_array((np.concatenate(entries), places), (size, size))


MASS = PartOf((PointMass,), "masses")
"""A point mass in a case file."""
