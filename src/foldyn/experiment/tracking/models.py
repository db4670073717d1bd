"""What tracking needs to know of a model: its nodes, its panels and the states it may be in."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.errors import InputError

_MOST_STATES = 200


@dataclass(frozen=True, eq=False)
class Model:
    """A model as a camera may see it.

    Attributes
    ----------
    rest : ndarray, shape (n, 3)
        Positions of all nodes at rest (m), the vertices of the pattern first.
    states : ndarray, shape (k, n, 3)
        Positions (m) in the states in which it may be, a path in order.
    triangles : ndarray, shape (m, 3)
    vertices : int
        Number of the pattern's vertices: only they can be seen as corners.
    edges : ndarray, shape (e, 2)
        Creases and boundary, for pictures.
    """

    rest: NDArray[np.float64]
    states: NDArray[np.float64]
    triangles: NDArray[np.int64]
    vertices: int
    edges: NDArray[np.int64]

    @classmethod
    def of(cls, thing: Any) -> Model:
        """Take a case or structure, at rest, or a result of `trace`, with all its states."""
        if isinstance(thing, xr.Dataset):
            return cls._of_result(thing)
        structure = getattr(thing, "structure", thing)
        rest = np.asarray(structure.nodes, dtype=np.float64)
        triangles = np.asarray(structure.triangles, dtype=np.int64)
        edges = np.asarray(structure.pattern.edges, dtype=np.int64)
        count = len(structure.pattern.vertices)
        return cls(rest, rest[np.newaxis], triangles, count, edges)

    @classmethod
    def _of_result(cls, result: xr.Dataset) -> Model:
        from foldyn.results import case_of
        from foldyn.results.contents import check_variable

        if "displacement" not in result or "rest_position" not in result:
            raise InputError("--model: the result has no displacements; give a case or a path")
        at_rest = cls.of(case_of(result))
        if result["displacement"].ndim != 3:
            raise InputError("--model: give a path or a motion, not modes or responses")
        place, along = ("node", "axis"), str(result["displacement"].dims[0])
        rest = check_variable(result, "rest_position", place, place="--model: ").values
        moved = check_variable(result, "displacement", (along, *place), place="--model: ").values
        states = rest + moved
        if not states.size or not np.isfinite(states).all():
            raise InputError("--model: the result holds no finite displacements; compute it again")
        thin = np.unique(np.linspace(0, len(states) - 1, _MOST_STATES).round().astype(int))
        return replace(at_rest, rest=rest, states=states[thin])
