"""Shells as solvers see them: plates and membranes of triangles."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.materials import HingeLaw
from foldyn.mechanics.plates import BarsPlates
from foldyn.mechanics.sheet_term import FoldHinges
from foldyn.structures.bars_plates import BarsPlatesTerm

GROUPS: Mapping[str, str] = {
    "strain_membrane": "strain energy of stretching",
    "strain_bending": "strain energy of bending",
    "strain_folds": "strain energy of the folds",
}


class ShellTerm(BarsPlatesTerm):
    """Triangles as plates, and creases in pieces; see `mechanics.sheet_term.SheetTerm`.

    Parameters
    ----------
    model : BarsPlates
        The arrays of the shell. Bars are the sides of the triangles; they have no stiffness.
    laws : tuple of HingeLaw
    crease : ndarray, shape (c,)
        The fold that each piece of a crease belongs to.
    scale : ndarray, shape (m,)
        See `SheetTerm.scale`.
    like : ShellTerm, optional
        A term with the same mesh.
    """

    energy_groups = GROUPS
    _groups = (0, 2, 1)
    _no_slope = "the folds of a shell have no slope at rest; modes of shells and their"

    def __init__(
        self, model: BarsPlates, laws: tuple[HingeLaw, HingeLaw], crease: NDArray, scale: NDArray,
        like: ShellTerm | None = None,
    ) -> None:  # fmt: skip
        super().__init__(model, laws, like)
        self._crease, self._scale = crease, scale

    def _with(self, **arrays: Any) -> ShellTerm:
        """The sheet with other arrays on the same mesh."""
        model = self.model._replace(**arrays)
        return ShellTerm(model, self.laws, self._crease, self._scale, self)

    def scale(self) -> NDArray:
        """See `SheetTerm`."""
        return self._scale.copy()

    def unstrained(self, q: NDArray) -> None:
        """See `SheetTerm`: None, as only rigid motions keep a shell without strain."""

    @property
    def rest_angles(self) -> NDArray:
        """See `SheetTerm`: rest angles of the folds, each the mean along its crease."""
        return np.bincount(self._crease, self.model.fold_rest) / np.bincount(self._crease)

    def rest_law(self, number: int) -> HingeLaw:
        """See `SheetTerm`."""
        return self.laws[0].at([int(np.argmax(self._crease == number))])

    def fold_hinges(self) -> FoldHinges:
        """See `SheetTerm`: the pieces of the creases."""
        return super().fold_hinges()._replace(fold=self._crease)

    def folded(self, rest: NDArray) -> ShellTerm:
        """See `SheetTerm`."""
        pieces = self.model.fold_rest + (rest - self.rest_angles)[self._crease]
        return super().folded(np.append(pieces, self.model.bend_rest))

    def actuated(self, numbers: NDArray) -> tuple[ShellTerm, NDArray, NDArray]:
        """See `SheetTerm`."""
        pieces = [np.flatnonzero(self._crease == fold) for fold in numbers]
        place = np.repeat(np.arange(len(numbers)), [len(each) for each in pieces])
        rows = np.concatenate([np.zeros(0, np.int64), *pieces])
        return super().actuated(rows)[0], rows, place
