"""Gradients of effective properties, which are differenced: each changed cell is computed anew."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import xarray

from foldyn.analyses import CaseFile
from foldyn.errors import InputError, quietly
from foldyn.gradients.parameters import Differentiated
from foldyn.linear import UnitCell, effective
from foldyn.mechanics.pullback import Arrays


class CellGradient(Differentiated):
    """Effective properties of a cell, or of that of a case file.

    Parameters
    ----------
    cell : UnitCell or CaseFile
    arguments : mapping
        Arguments of `fd.effective`; a file has its own. Models are not compared.
    """

    def __init__(self, cell: UnitCell | CaseFile, arguments: Mapping[str, Any]) -> None:
        if arguments.get("state") is not None:
            raise InputError(
                ": would stay as it is while the cell changes; give a case file with stretch or "
                "turn, which finds the equilibrium of each cell",
                "state",
            )
        self._arguments = {**arguments, "check_model": False}
        self.result = self._computed(cell)

    def numbers(self, case: Any) -> Arrays:
        """Nothing: no measure has an adjoint."""
        return Arrays({}, {})

    def beside(self, case: Any) -> xarray.Dataset:
        """Properties of a slightly different cell."""
        with quietly():
            return self._computed(case)

    def _computed(self, cell: UnitCell | CaseFile) -> xarray.Dataset:
        if isinstance(cell, CaseFile):
            return cell.computation(check_model=False).result()
        return effective(cell, **self._arguments)
