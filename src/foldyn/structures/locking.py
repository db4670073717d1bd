"""What keeps the panels at a hinge apart as they meet: its law, if it locks."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from foldyn.materials import HingeLaw
from foldyn.structures.discretized import Discretized

NEARLY = 1e-9  # rad from closed
BOUND = 1e3  # moment / k that only an unbounded law has there


def locks(law: HingeLaw) -> bool:
    """Whether the moment of a law grows without bound as panels meet."""
    nearly = np.array([NEARLY, 2.0 * math.pi - NEARLY])
    return bool((np.abs(law.moment(nearly, math.pi)) > BOUND).all())


def kept_apart(structure: Discretized, one: int, other: int) -> str:
    """How to keep the panels at the hinge between two nodes apart, in words.

    The energies of locking laws grow slowly, EnhancedLinear's with the logarithm of the angle:
    panels that are pushed hard pass through, however small the steps.
    """
    ends = {one, other}
    creases = structure.edge_nodes[: len(structure.fold_rest)].tolist()
    fold = any(ends == {*pair} for row in creases for pair in pairwise(row) if ends & {*row})
    kind = "fold" if fold else "bend"
    law = structure.fold_law if fold else getattr(structure, "bend_law", None)
    if law is None:
        return "push the panel less, or more slowly: nothing but its stiffness resists"
    if locks(law):
        return (
            f"the law of this {kind} ({law.name}) locks, but is overcome, and would be with any "
            "step: push less, or more slowly, end before panels meet, or give the case contact: "
            "fd.Contact()"
        )
    return (
        f"a law that locks ({kind}_law = 'enhanced', EnhancedLinear) keeps panels apart, unless "
        "they are pushed hard; contact, fd.Contact(), does however hard"
    )
