"""Membrane forces and moments of superelements at points of their panels."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.condensation.assembly import Whole
from foldyn.condensation.library import Group
from foldyn.condensation.panel import INNER
from foldyn.mechanics.triangle import turned_strain
from foldyn.patterns import Pattern
from foldyn.structures.discretized import Distributed


def resultants(whole: Whole) -> sparse.csr_array:
    """Membrane forces and moments (6 p, m) at the p points of all panels in turn, per unknown.

    Rows of a point: forces xx, yy, xy, N/m, then moments, N, in the panel's own axes.
    """
    blocks: list[Any] = [None] * whole.unknowns.panels
    for group, (kept, placed) in zip(whole.groups, whole.amplitudes, strict=True):
        shapes, count = group.panel.resultants[..., kept], len(kept)
        for k, (number, turned) in enumerate(in_own_axes(whole.pattern, group, shapes)):
            own = placed[k * count : (k + 1) * count]
            blocks[number] = sparse.csr_array(turned.reshape(-1, count) @ own)
    return sparse.csr_array(sparse.vstack(blocks))


def held_resultants(whole: Whole, load: Distributed) -> NDArray[np.float64]:
    """What a load adds to `resultants` (6 p,) beside the motions of the unknowns."""
    parts: list[Any] = [None] * whole.unknowns.panels
    for group, (kept, _) in zip(whole.groups, whole.amplitudes, strict=True):
        panel, inner = group.panel, kept[group.panel.kind[kept, 0] == INNER]
        held = panel.held_resultants.copy()
        if len(inner):  # vibrations count as unknowns
            push = whole.per_area(group, kept)[-len(inner) :]
            moved = np.linalg.solve(panel.stiffness[np.ix_(inner, inner)], push)
            held[..., :3] -= panel.resultants[..., inner] @ moved
        amount = np.zeros((len(group.number), 7))
        if load.panels is not None:
            amount[:, :3] = np.einsum("pad,pd->pa", group.frames, load.panels[group.number])
        if load.strain is not None and load.curvature is not None:
            amount[:, 3:] = group.swollen(load.strain, load.curvature)
        for k, (number, turned) in enumerate(in_own_axes(whole.pattern, group, held)):
            parts[number] = (turned @ amount[k]).ravel()
    return np.concatenate(parts)


def in_own_axes(
    pattern: Pattern, group: Group, local: NDArray
) -> Iterator[tuple[int, NDArray[np.float64]]]:
    """Numbers of a group's panels, and tensors (2, p, 3, c) of its frame in the panels' own axes.

    The first axis of a panel is along its first edge. The result is (p, 2, 3, c).
    """
    for number, face, frame in zip(group.number, group.faces, group.frames, strict=True):
        own = pattern.faces[number]
        first, corners = own.index(int(face[0])), len(own)
        along = frame[:2] @ (pattern.vertices[own[1]] - pattern.vertices[own[0]])
        turn = turned_strain(-np.arctan2(along[1], along[0])).T  # forces, which work with strains
        order = np.roll(np.arange(corners), first)
        points = np.concatenate([[0], 1 + order, 1 + corners + order])
        yield int(number), np.einsum("ab,kpbc->pkac", turn, local[:, points])
