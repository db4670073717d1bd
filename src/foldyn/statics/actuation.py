"""Folds whose rest angles move with the load factor: the model at each factor."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from foldyn.mechanics import BarsHinges
from foldyn.structures import Structure


class Actuation:
    """The model of a structure whose folds' rest angles change by `change` (nf,) per unit factor.

    A rest angle that leaves 0..2 pi becomes nan, which no solver accepts.
    """

    def __init__(self, structure: Structure, change: NDArray, constant: NDArray) -> None:
        self._structure, self._change, self._constant = structure, change, constant
        self._rows = structure.hinge_of_fold
        self.acts = bool(change.any() or constant.any())
        self.model = lru_cache(maxsize=4)(self._model)

    def rest(self, factor: float) -> NDArray:
        """Rest angles (nf,), rad."""
        angle = self._structure.fold_rest + self._constant + factor * self._change
        return np.where((angle >= 0.0) & (angle <= 2.0 * math.pi), angle, np.nan)

    def _model(self, factor: float) -> BarsHinges:
        model = self._structure.model
        if not self.acts:
            return model
        rest, parameters = model.hinge_rest.copy(), model.hinge_parameters.copy()
        rest[self._rows] = self.rest(factor)
        parameters[self._rows] = self._structure.fold_law.parameters(rest[self._rows])
        return model._replace(hinge_rest=rest, hinge_parameters=parameters)
