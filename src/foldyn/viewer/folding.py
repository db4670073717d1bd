"""What draws a folding, which is of a pattern alone and has no case."""

from __future__ import annotations

import warnings

import xarray as xr

from foldyn.cases import Case
from foldyn.errors import FoldynWarning
from foldyn.results.contents import pattern_of
from foldyn.structures import Sheet, discretize

THIN = 1e-3  # thickness of the sheet over the size of the pattern; it does not show


def folding_case(result: xr.Dataset) -> Case:
    """Case of the pattern of a folding, with the panels cut at their diagonals.

    Its nodes are the vertices. Its sheet is made up, so that only its geometry counts; creases are
    taken to rest when flat, as they may be closed.
    """
    pattern = pattern_of(result)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)
        sheet = Sheet(1.0, 0.0, THIN * pattern.size)
        return Case(discretize(pattern, sheet, scheme="n4b5", crease_rest=180.0))
