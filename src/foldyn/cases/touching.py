"""What contact asks of a case, and of the state in which it begins."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases.case import Case
from foldyn.errors import FoldynWarning, InputError


def check_contact(case: Case, u: NDArray, moved: NDArray) -> None:
    """Refuse a start at which something has passed another; warn where panels overlap.

    Parameters
    ----------
    case : Case
    u : (n, 3)
        Displacement (m) at the start.
    moved : (p, 3)
        That of the planes.

    Raises
    ------
    InputError
        The structure takes no contact; a node is behind a plane; panels meet.

    Warns
    -----
    FoldynWarning
        At rest panels are nearer to each other than the sheet is thick.
    """
    if case.contact is None:
        return
    _check_structure(case)
    x = case.structure.nodes + u
    surface = np.unique(case.structure.triangles)
    for i, plane in enumerate(case.contact.planes):
        point, normal = np.array(plane.point) + moved[i], np.array(plane.normal)
        height = (x[surface] - point) @ normal / np.linalg.norm(normal)
        free = ~case.fixed[surface].all(axis=1)
        if free.any() and height[free].min() <= 0.0:
            behind = int(np.argmin(np.where(free, height, np.inf)))
            raise InputError(
                f": node {surface[behind]} is {-height[behind]:.3g} m behind it at the start: move "
                "the plane, or turn its normal to the side of the sheet",
                f"contact.planes[{i}]",
            )
    body: Any = case.body
    energy = body.contact(body.dofs(u))[0]
    if not np.isfinite(energy):
        raise InputError(
            ": at the start panels meet, or fold onto themselves: start from a state in which "
            "they are apart, as with crease_rest above 0 and below 360 degrees",
            "contact",
        )
    if not u.any() and energy > 0.0 and not case.contact.planes:
        warnings.warn(
            "contact: at rest panels are nearer to each other than the sheet is thick; they will "
            f"be pushed apart with an energy of {energy:.3g} J",
            FoldynWarning,
            stacklevel=4,
        )


def _check_structure(case: Case) -> None:
    """Refuse structures whose surface is not that of their panels."""
    pattern = case.structure.pattern
    if pattern is not None and pattern.boards is not None:
        raise InputError(
            ": is between the middle surfaces of a sheet, beside which thick panels are hinged; "
            "leave out contact, or hinge_offset",
            "contact",
        )
