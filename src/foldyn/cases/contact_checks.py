"""Checks of cases with contact, and of the state in which they begin."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.cases.case import Case
from foldyn.cases.constraints import AGREES
from foldyn.errors import InputError, warn
from foldyn.mechanics.contact.candidates import NORMAL, POINT
from foldyn.mechanics.contact.term import ContactTerm
from foldyn.mechanics.crossings import crossing_panels, pairs_text

STRIDE = 5  # crossing panels are looked for in every fifth state
NEAREST = 0.01  # least distance in a motion, relative to the distance at which contact begins
APART = (
    "start from a state in which they are apart, as with crease_rest above 0 and below 360 degrees"
)


def check_contact(case: Case, u: NDArray, moved: NDArray) -> None:
    """Refuse a start in which nodes are behind planes or panels cross; warn if panels overlap.

    Parameters
    ----------
    case : Case
    u : (n, 3)
        Displacement (m) at the start.
    moved : (p, 3)
        Displacement (m) of the planes.

    Raises
    ------
    InputError
        A node is behind a plane, or in it; panels cross or meet.

    Warns
    -----
    FoldynWarning
        At rest panels are closer to each other than the thickness of the sheet.
    """
    if case.contact is None:
        return
    x = case.contact_term.tables.rest + case.contact_term.points(u)
    _check_planes(case.contact_term, x, moved)
    if case.contact.panels:
        _check_panels(case, u, x)


def _check_planes(contact: ContactTerm, x: NDArray, moved: NDArray) -> None:
    """Refuse nodes behind a plane or in it."""
    tables, met = contact.tables, contact.tables.meeting
    if not len(met):
        return
    surface, half = contact.nodes[met], 0.5 * tables.node_thickness[met]
    for i, plane in enumerate(tables.planes):
        height = (x[met] - plane[POINT : POINT + 3] - moved[i]) @ plane[NORMAL : NORMAL + 3]
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


def _check_panels(case: Case, u: NDArray, x: NDArray) -> None:
    """Refuse panels that cross or meet; warn if they overlap at rest."""
    contact = case.contact_term
    pairs = crossing_panels(x, contact.tables.triangles, contact.tables.panel)
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]  # a panel has no contact with itself
    if len(pairs):
        raise InputError(
            f": at the start panels pass through each other: {pairs_text(pairs)}; {APART}",
            "contact",
        )
    energy, share, panels = contact.nearest(case.body.dofs(u))
    most = f" ({pairs_text(panels)})" if len(panels) else ""
    if not (np.isfinite(energy) and share > NEAREST):
        raise InputError(
            f": at the start panels meet, or fold onto themselves{most}; {APART}", "contact"
        )
    if not u.any() and energy > 0.0:
        warn(
            f"contact: at rest panels are nearer to each other than the sheet is thick{most}; "
            f"they will be pushed apart with an energy of {energy:.3g} J",
            "contact.md#limits",
        )


def check_driven(case: Case, states: Iterable[tuple[str, NDArray, NDArray]]) -> None:
    """Refuse supports and planes that inevitably pass through each other.

    Parameters
    ----------
    case : Case
        A case with contact.
    states : iterable of (str, ndarray of shape (n, 3), ndarray of shape (p, 3))
        The moment, such as "t = 0.1 s"; displacements (m) of the nodes, as far as supports
        determine them; displacements (m) of the planes. The first state is the start.

    Raises
    ------
    InputError
        A node gets behind a plane, and its distance from the plane is determined by supports; or
        panels cross, and supports move all their nodes.
    """
    assert case.contact is not None
    contact, tables = case.contact_term, case.contact_term.tables
    decided = np.all([_decided(case, axis) for axis in np.eye(3)], axis=0)
    centers, mean = _followers(case, decided)
    decided[centers] = True
    held = decided[case.structure.triangles].all(axis=1)
    triangles, panels = tables.triangles[held], tables.panel[held]
    look = case.contact.panels and bool(case.imposed_terms) and len(np.unique(panels)) > 1
    planes = []
    for plane in tables.planes:
        point, normal = plane[POINT : POINT + 3], plane[NORMAL : NORMAL + 3]
        nodes = tables.meeting[contact.carried(_decided(case, normal))[tables.meeting]]
        planes.append((point, normal, nodes))
    before, crossed = [], np.zeros((0, 2), np.int64)
    for k, (when, u, moved) in enumerate(states):
        x = tables.rest + contact.points(u)
        for i, (point, normal, nodes) in enumerate(planes):
            height = (x[nodes] - point - moved[i]) @ normal
            before += [height > 0.0] if k == 0 else []
            behind = np.flatnonzero(before[i] & (height <= 0.0))
            if behind.size:
                node = contact.nodes[nodes[behind[0]]]
                raise InputError(
                    f": at {when} it has reached node {node}, and neither can give way, because "
                    "supports hold the node along the plane's normal. Stop the plane or the "
                    "support before, or let the node move along the normal",
                    f"contact.planes[{i}]",
                )
        if look and k % STRIDE == 0:
            followed = u.copy()
            followed[centers] = mean @ u
            pairs = crossing_panels(tables.rest + contact.points(followed), triangles, panels)
            crossed = pairs if k == 0 else crossed
            new = [pair for pair in pairs.tolist() if pair not in crossed.tolist()]
            if new:
                raise InputError(
                    f"supports: at {when} panels {new[0][0]} and {new[0][1]}, all of whose nodes "
                    "supports hold or move, have passed through each other: neither gives way. "
                    "Stop before, or free some of their nodes"
                )


def _decided(case: Case, direction: NDArray) -> NDArray:
    """Whether supports alone determine each node's motion (n,) along a unit vector."""
    ties, nodes = case.constraints, len(case.structure.nodes)
    along = sparse.csr_array(sparse.kron(sparse.eye_array(nodes), direction[None]))
    if ties:
        along = sparse.csr_array(along @ ties.basis)
    return np.asarray(abs(along[:, ties.free]).sum(axis=1)).ravel() <= AGREES


def _followers(case: Case, decided: NDArray) -> tuple[NDArray, sparse.csr_array]:
    """Centers (c,) of panels whose corners supports determine, and the matrix of their motion.

    decided : (n,) whether supports determine the motion of each node.
    """
    structure = case.structure
    tri, size = structure.triangles, len(structure.nodes)
    ends = np.concatenate([tri[:, [0, 1]], tri[:, [1, 2]], tri[:, [2, 0]]])
    ends = np.unique(np.concatenate([ends, ends[:, ::-1]]), axis=0)
    beside = sparse.csr_array((np.ones(len(ends)), ends.T), (size, size))
    centers = np.asarray(getattr(structure, "centers", ()), np.int64)
    centers = centers[centers >= 0]  # other panels have no center
    centers = centers[~decided[centers] & (beside[centers] @ ~decided == 0)]
    return centers, sparse.csr_array(beside[centers] / beside[centers].sum(axis=1)[:, None])
