"""Folds whose rest angles move with the load factor: the body at each factor."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from foldyn.mechanics.body import Body


class Actuation:
    """A body whose folds' rest angles change by `change` (nf,) per unit of the factor.

    A rest angle that leaves 0..2 pi becomes nan, which no solver accepts.
    """

    def __init__(self, body: Body, change: NDArray, constant: NDArray) -> None:
        self._body, self._change, self._constant = body, change, constant
        self.acts = bool(change.any() or constant.any())
        self.body = lru_cache(maxsize=4)(self._folded)

    def rest(self, factor: float) -> NDArray:
        """Rest angles (nf,), rad."""
        angle = self._body.fold_rest + self._constant + factor * self._change
        return np.where((angle >= 0.0) & (angle <= 2.0 * math.pi), angle, np.nan)

    def _folded(self, factor: float) -> Body:
        return self._body.folded(self.rest(factor)) if self.acts else self._body
