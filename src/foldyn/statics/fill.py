"""Memory of the factors of a tangent, which most analyses need: an estimate from the dofs."""

from __future__ import annotations

import math
from typing import Any

from foldyn.memory import check_memory
from foldyn.shells import Shell
from foldyn.statics.backends import factorizer

BARS, SHELL = (2700.0, 340), (5900.0, 1450)
"""Bytes a dof for each doubling of their number, and the number from which it grows.

Measured with SuperLU as the largest memory of `modes` and `trace` on flat lattices: bars and hinges
13, 20 and 26 kB a dof with 9,843, 60,603 and 241,203 dofs; shells 23 and 35 kB with 21,963 and
87,123.
"""
PARDISO = 0.3
"""What PARDISO takes of that: 1.4 GiB instead of 3.5 for the modes of 240,600 dofs."""


def check_fill(structure: Any) -> None:
    """Refuse a structure whose factors memory cannot hold."""
    shell = isinstance(structure, Shell)
    dofs = structure.nodes.size + (structure.rotations if shell else 0)
    slope, least = SHELL if shell else BARS
    needed = slope * dofs * max(math.log2(max(dofs, 1) / least), 1.0)
    if factorizer("auto", dofs)[0] == "pardiso":
        needed *= PARDISO
    if shell:
        field, remedy = f"divisions = {structure.options.divisions}", "take fewer"
    else:
        field, remedy = "pattern", "take fewer panels, or an explicit method of motion"
    check_memory(field, f"solving for {dofs} dofs", needed, remedy)
