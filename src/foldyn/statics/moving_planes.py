"""Contact planes that move along a path: one more dof, held like a moving support.

Its value is the travel (m) of the plane that moves farthest; at the load factor f each plane has
moved by f times its motion. So a Newton step moves the planes together with the sheet, and is cut
where they would cross it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.cases import Case
from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.contact.term import ContactTerm


class Plates:
    """The moving planes of a case as one more dof of its states, if there are any.

    Parameters
    ----------
    case : Case

    Attributes
    ----------
    length : float
        Travel of this dof per unit of the load factor, m.
    """

    def __init__(self, case: Case) -> None:
        planes = () if case.contact is None else case.contact.planes
        motion = np.array([plane.motion or (0.0, 0.0, 0.0) for plane in planes], float)
        motion = motion.reshape(-1, 3)
        self.length = float(np.linalg.norm(motion, axis=1).max(initial=0.0))
        self._motion = motion / self.length if self.length else motion

    def __bool__(self) -> bool:
        """Whether any plane moves."""
        return self.length > 0.0

    @property
    def held(self) -> NDArray[np.bool_]:
        """One True for the dof; empty if no plane moves."""
        return np.ones(int(bool(self)), bool)

    def joined(self, values: NDArray, own: float = 0.0) -> NDArray:
        """Values (m,) of the other dofs, with the value of this one appended."""
        return np.append(values, own) if self else values

    def others(self, values: NDArray) -> NDArray:
        """Values (m, ...) of the other dofs, without this one."""
        return values[:-1] if self else values

    def moved(self, values: NDArray) -> NDArray:
        """Displacements (p, 3) of the planes, m, from the values of all dofs."""
        return float(values[-1]) * self._motion if self else np.zeros_like(self._motion)

    def placed(self, body: Assembly, values: NDArray) -> Assembly:
        """A body with its planes at their places in a state."""
        return body.displaced(self.moved(values)) if self else body

    def force(self, contact: ContactTerm, q: NDArray) -> float:
        """Force that moves the planes along their motion, N; q (m,) of the body."""
        pushed = contact.plane_forces(q) + contact.plane_friction(q)
        return float((pushed * self._motion).sum())

    def bordered(
        self, matrix: sparse.csr_array, contact: ContactTerm, q: NDArray, project: Any
    ) -> sparse.csr_array:
        """A tangent of the other dofs, bordered by the row and column of this one, N/m.

        project : maps forces on the body's dofs to forces on states.
        """
        column, row, own = contact.plane_borders(q, self._motion)
        right, below = project(column)[:, None], project(row)[None, :]
        return sparse.csr_array(sparse.block_array([[matrix, right], [below, [[own]]]]))
