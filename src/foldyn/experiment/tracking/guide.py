"""Where nodes should be, by the nodes that are tracked and the states of the model."""

from __future__ import annotations

import numpy as np

from foldyn.experiment.tracking.follow import Guide
from foldyn.experiment.tracking.matching import Match, by_neighbors, hidden_nodes
from foldyn.experiment.tracking.models import Model
from foldyn.experiment.tracking.view import Array

_FEWEST = 6


def guide_of(match: Match, model: Model) -> Guide:
    """Guide for points of which the first ones are the vertices of the model, in order.

    In each frame the state is taken whose projection lies nearest to the tracked nodes; what it
    misses them by is carried over to each node from its neighbors. Lost nodes that a panel hides in
    that state are not to be looked for.
    """
    count = model.vertices
    view = match.view
    flat = np.array([view.project(state[:count]) for state in model.states])
    hidden = [hidden_nodes(state, model.triangles, view)[:count] for state in model.states]

    def guide(place: Array) -> Array:
        expected = np.full(place.shape, np.nan)
        known = np.isfinite(place[:count, 0])
        if known.sum() < _FEWEST:
            return expected
        misfit = place[:count][known] - flat[:, known]
        misfit -= np.median(misfit, axis=1, keepdims=True)
        nearest = int(np.argmin(np.abs(misfit).mean(axis=(1, 2))))
        expected[:count] = by_neighbors(place[:count], flat[nearest], np.arange(count))
        expected[:count][hidden[nearest] & ~known] = np.inf
        return expected

    return guide
