"""Parts of the strain energy in figures: those of bars and hinges, and those of a shell."""

from __future__ import annotations

from collections.abc import Mapping

import xarray as xr

from foldyn.plots import style
from foldyn.shells.body import GROUPS as OF_SHELLS
from foldyn.structures.body import GROUPS as OF_BARS_AND_HINGES

PARTS: Mapping[str, tuple[str, str]] = {
    "strain_bars": ("bars", style.VERMILLION),
    "strain_membrane": ("membrane", style.VERMILLION),
    "strain_bends": ("bends", style.PURPLE),
    "strain_bending": ("bending", style.PURPLE),
    "strain_folds": ("folds", style.GREEN),
}
"""Names and colors, in the order of a stack from its bottom up: what folds comes last."""


def parts_of(result: xr.Dataset) -> tuple[str, ...]:
    """Parts of the strain energy of a result, in the order of its structure."""
    return tuple(OF_SHELLS if set(OF_SHELLS) <= set(result.data_vars) else OF_BARS_AND_HINGES)


def stacked(result: xr.Dataset) -> list[str]:
    """The same in the order of a stack."""
    return [part for part in PARTS if part in parts_of(result)]
