"""What contact asks of a case, and of the state in which it begins."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases.case import Case
from foldyn.errors import FoldynWarning, InputError
from foldyn.mechanics.crossings import crossing_panels, pairs_text

NEAREST = 0.01  # of the distance at which contact begins: no motion brings anything nearer
APART = (
    "start from a state in which they are apart, as with crease_rest above 0 and below 360 degrees"
)


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
        The structure takes no contact; a node is behind a plane, or in it; panels cross or meet.

    Warns
    -----
    FoldynWarning
        At rest panels are nearer to each other than the sheet is thick.
    """
    if case.contact is None:
        return
    _check_structure(case)
    _check_planes(case, u, moved)
    if case.contact.panels:
        _check_panels(case, u)


def _check_planes(case: Case, u: NDArray, moved: NDArray) -> None:
    """Refuse nodes that are behind a plane, or in it."""
    assert case.contact is not None
    surface = np.unique(case.structure.triangles)
    surface = surface[~case.fixed[surface].all(axis=1)]  # what is held is left alone
    if not len(surface):
        return
    body: Any = case.body
    x, half = case.structure.nodes[surface] + u[surface], 0.5 * body.tables.node_thickness[surface]
    for i, plane in enumerate(case.contact.planes):
        point, normal = np.array(plane.point) + moved[i], np.array(plane.normal)
        height = (x - point) @ normal / np.linalg.norm(normal)
        if (height > NEAREST * half).all():
            continue
        worst = int(np.argmin(height / half))
        behind = f"{abs(height[worst]):.3g} m behind it"
        if height[worst] > 0.0:
            behind = f"{height[worst]:.3g} m from it, with {half[worst]:.3g} m of the sheet between"
        raise InputError(
            f": node {surface[worst]} is {behind} at the start: move the plane, or turn its normal "
            "to the side of the sheet",
            f"contact.planes[{i}]",
        )


def _check_panels(case: Case, u: NDArray) -> None:
    """Refuse panels that cross or meet; warn where they overlap at rest."""
    structure = case.structure
    pairs = crossing_panels(structure.nodes + u, structure.triangles, structure.triangle_panel)
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]  # what a panel does to itself is no contact
    if len(pairs):
        raise InputError(
            f": at the start panels pass through each other: {pairs_text(pairs)}; {APART}",
            "contact",
        )
    body: Any = case.body
    energy, share, panels = body.nearest(body.dofs(u))
    most = f" ({pairs_text(panels)})" if len(panels) else ""
    if not (np.isfinite(energy) and share > NEAREST):
        raise InputError(
            f": at the start panels meet, or fold onto themselves{most}; {APART}", "contact"
        )
    if not u.any() and energy > 0.0:
        warnings.warn(
            f"contact: at rest panels are nearer to each other than the sheet is thick{most}; "
            f"they will be pushed apart with an energy of {energy:.3g} J",
            FoldynWarning,
            stacklevel=5,
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
