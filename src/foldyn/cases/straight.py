"""Clamped edges stay straight: supports of both ends support the points between them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


class Straight:
    """Points of a structure's mesh between the ends of its clamped edges.

    Parameters
    ----------
    structure : Structure or Shell
    stated : ndarray of bool, shape (n, 3)
        Dofs for which supports are given: these are not changed.
    """

    def __init__(self, structure: Any, stated: NDArray[np.bool_]) -> None:
        self._edges, self._stated = structure.clamped_nodes, stated

    def held(self) -> NDArray[np.bool_]:
        """Dofs (n, 3) that are supported in all."""
        held = self._stated.copy()
        for nodes in self._edges:
            held[nodes[1:-1]] |= held[nodes[0]] & held[nodes[-1]]
        return held

    def moved(self, imposed: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Those of a mask (n, 3), and points between ends of which one is among them."""
        both, moved = self.held(), imposed.copy()
        for nodes in self._edges:
            inner = nodes[1:-1]
            moved[inner] |= (
                both[inner] & ~self._stated[inner] & (moved[nodes[0]] | moved[nodes[-1]])
            )
        return moved

    def carried(self, vector: NDArray[np.float64]) -> NDArray[np.float64]:
        """Displacements (n, 3), linear between the ends."""
        out, both = vector.copy(), self.held()
        for nodes in self._edges:
            inner, share = nodes[1:-1], np.linspace(0.0, 1.0, len(nodes))[1:-1, None]
            between = (1.0 - share) * vector[nodes[0]] + share * vector[nodes[-1]]
            out[inner] = np.where(both[inner] & ~self._stated[inner], between, vector[inner])
        return out
