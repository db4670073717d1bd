"""Memory of the factors of a tangent, which most analyses need: an estimate from the dofs."""

from __future__ import annotations

import math
from typing import NamedTuple

from foldyn.algebra.choice import factorizer
from foldyn.memory import check_memory

PARDISO = 0.3
"""What PARDISO takes of SuperLU's: 1.4 GiB instead of 3.5 for the modes of 240,600 dofs."""


class Fill(NamedTuple):
    """Memory that SuperLU's factors take, by experience with a model, and what makes it less."""

    per_doubling: float  # bytes a dof for each doubling of the number of dofs,
    least: int  # from so many dofs on
    field: str
    remedy: str


def check_fill(fill: Fill, dofs: int) -> None:
    """Refuse a structure whose factors memory cannot hold."""
    needed = fill.per_doubling * dofs * max(math.log2(max(dofs, 1) / fill.least), 1.0)
    if factorizer("auto", dofs)[0] == "pardiso":
        needed *= PARDISO
    check_memory(fill.field, f"solving for {dofs} dofs", needed, fill.remedy)
