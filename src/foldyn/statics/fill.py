"""Memory of the factors of a tangent, which most analyses need: an estimate from the dofs."""

from __future__ import annotations

import math
from typing import Any

from foldyn.memory import check_memory
from foldyn.statics.backends import factorizer

PARDISO = 0.3
"""What PARDISO takes of that: 1.4 GiB instead of 3.5 for the modes of 240,600 dofs."""


def check_fill(structure: Any) -> None:
    """Refuse a structure whose factors memory cannot hold."""
    fill, dofs = structure.fill, structure.body.size
    needed = fill.per_doubling * dofs * max(math.log2(max(dofs, 1) / fill.least), 1.0)
    if factorizer("auto", dofs)[0] == "pardiso":
        needed *= PARDISO
    check_memory(fill.field, f"solving for {dofs} dofs", needed, fill.remedy)
