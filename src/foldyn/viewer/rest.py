"""What a page shows of sheets that are not computed: the sheet at rest."""

from __future__ import annotations

import numpy as np

from foldyn import __version__
from foldyn.cases import Case
from foldyn.patterns import Pattern
from foldyn.viewer.arrays import Arrays
from foldyn.viewer.sheet import bare_sheet, sheet
from foldyn.viewer.stage import Stage


def rest_stage(shown: Pattern | Case, title: str) -> Stage:
    """Show a pattern, or a case with its supports and loads, at rest."""
    arrays = Arrays()
    bare = isinstance(shown, Pattern)
    drawn = bare_sheet(arrays, "s0", shown) if bare else sheet(arrays, "s0", shown)
    count = len(shown.vertices if bare else shown.structure.nodes)
    result = {
        "name": title,
        "sheet": "s0",
        "displacement": arrays.changing("u", np.zeros((1, count, 3)), 1.0),
        "moments": arrays.exact("t", [0.0], "f4"),
    }
    about = {
        "title": title, "kind": "shape", "version": __version__, "node": None, "axis": 0,
        "sheets": {"s0": drawn}, "results": [result],
    }  # fmt: skip
    return Stage(about, arrays)
