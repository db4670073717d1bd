"""A panel as a thin plate whose mesh is solved as a whole, to compare condensed plates with."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from foldyn.mechanics.block_matrix import of_elements
from foldyn.structures.panel_plate import Outline, across_edges, meshed, plate_blocks, sides_of


class PanelPlate:
    """A panel as a plate of small triangles, n per edge; its bending modulus G is 1.

    The unknowns are heights of the points, then slopes across the sides. The attributes are linear
    functions of the unknowns, given by coefficients by index: `heights` of corners and center;
    `slopes`, the mean outward slopes of creased edges; `bows`; and `lines`, the deviations of
    points on straight edges from the line between the ends, and of slopes at clamped edges from the
    last slope.
    """

    def __init__(self, panel: Outline, poissons_ratio: float, n: int) -> None:
        x = np.array(panel.corners)
        self.points, self.triangles, at, edges = meshed(x, panel.center, n)
        side, sign, ends = sides_of(self.triangles)
        self.stiffness = _plate(self.points, self.triangles, side, sign, poissons_ratio)
        self._ends = ends
        self.heights = [{node: 1.0} for node in at.tolist()]
        sides = across_edges(edges, ends, len(self.points))
        self.slopes, self.bows, self.lines = _edge_functions(panel, edges, sides)

    def solved(self, held: list[dict[int, float]]) -> tuple[NDArray, NDArray]:
        """Unknowns (size, k) for each of k held functions equal to 1, others 0; stiffness (k, k).

        Heights come first among the held functions: holding them makes the rest positive definite.
        """
        size, count = len(self.stiffness.indptr) - 1, len(self.heights)
        first = np.array([next(iter(entries)) for entries in self.heights])
        others = np.setdiff1d(np.arange(size), first)
        inner = sparse.csc_array(self.stiffness[others][:, others])
        factor = splu(inner, "MMD_AT_PLUS_A", 0.0, options={"SymmetricMode": True})
        rows = _rows_of([*held[count:], *self.lines], size)
        both = self.stiffness[others][:, first].toarray()
        given, multipliers = rows[:, first].toarray(), rows[:, others]
        loose = factor.solve(np.column_stack([both, multipliers.T.toarray()]))
        # unknowns x = -loose_h h + loose_c m, where C x + C_h h = g
        moved, pulled = loose[:, :count], loose[:, count:]
        wanted = np.zeros((len(given), len(held)))
        wanted[:, :count] = multipliers @ moved - given
        wanted[: len(held) - count, count:] = np.eye(len(held) - count)
        force = np.linalg.solve(multipliers @ pulled, wanted)
        found = np.zeros((size, len(held)))
        found[first, :count] = np.eye(count)
        found[others] = pulled @ force
        found[others, :count] -= moved
        return found, found.T @ (self.stiffness @ found)

    @property
    def paraboloid(self) -> NDArray:
        """Unknowns for heights r^2 / 2, which triangles of constant curvature represent exactly."""
        one, other = np.moveaxis(self.points[self._ends], 1, 0)
        along = other - one
        across = np.column_stack([along[:, 1], -along[:, 0]])
        slopes = np.einsum("si,si->s", across, 0.5 * (one + other))
        slopes /= np.linalg.norm(along, axis=1)
        return np.concatenate([0.5 * (self.points**2).sum(axis=1), slopes])


def _edge_functions(
    panel: Outline, edges: Sequence[NDArray], sides: Sequence[tuple[NDArray, NDArray]]
) -> tuple[list[dict[int, float]], ...]:
    """Slopes, bows and lines of `PanelPlate`.

    edges : for each edge, the indices (n + 1,) of the heights of its points.
    sides : for each edge, the indices (n,) of the slopes across its sides, and their signs, 1 if
        outward.
    """
    slopes, bows, lines = [], [], []
    x = np.array(panel.corners)
    for k, (nodes, (across, sign)) in enumerate(zip(edges, sides, strict=True)):
        nodes, n = nodes.tolist(), len(sign)
        if panel.creased[k]:
            mean = dict(zip(across.tolist(), (sign / n).tolist(), strict=True))
            slopes.append(mean)
            *others, (last, share) = mean.items()
            for side, part in others if panel.clamped[k] else ():
                lines.append({side: n * part, last: -n * share})
        if panel.bowed[k]:
            share = 1.0 / (n * float(np.linalg.norm(x[k] - x[(k + 1) % len(x)])))
            ends = 0.5 * (1 - n) * share  # subtracts the line between the ends
            inner = {node: share for node in nodes[1:-1]}
            bows.append({nodes[0]: ends, nodes[-1]: ends, **inner})
        if panel.straight[k]:
            for step in range(1, n):
                part = step / n
                lines.append({nodes[step]: 1.0, nodes[0]: part - 1.0, nodes[-1]: -part})
    return slopes, bows, lines


def _rows_of(functions: list[dict[int, float]], size: int) -> sparse.csr_array:
    """Rows (k, size) of linear functions, given by their coefficients."""
    row = np.repeat(np.arange(len(functions)), [len(entries) for entries in functions])
    column = [place for entries in functions for place in entries]
    value = [factor for entries in functions for factor in entries.values()]
    return sparse.csr_array((value, (row, column)), shape=(len(functions), size))


def _plate(
    points: NDArray, triangles: NDArray, side: NDArray, sign: NDArray, poissons_ratio: float
) -> sparse.csr_array:
    """Stiffness for heights of the points and slopes across the sides, with G = 1."""
    block = plate_blocks(points[triangles], sign, poissons_ratio)
    dofs = np.concatenate([triangles, len(points) + side], axis=1)
    return of_elements(dofs, block, len(points) + int(side.max()) + 1)
