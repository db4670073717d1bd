"""A term that lacks a part is refused by name: solvers would take the part for zero."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import foldyn as fd
from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.springs import SpringsTerm
from foldyn.mechanics.term import FORCES, CompiledTerm, Term

NONE = np.zeros(0, np.int64), np.zeros(0, np.int64)


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        ({}, "Loose has no entries and no places, for its stiffness"),
        ({"places": property(lambda self: NONE)}, "Loose has no entries, for its stiffness"),
        ({"damps": True}, "no damping_entries and no damping_places, for its damping"),
        ({"without": ("stiffness",), "arrays": lambda self: None}, "no pulled, for its gradients"),
    ],
)
def test_a_kind_that_lacks_a_part_is_refused_when_it_is_defined(parts, said):
    with pytest.raises(TypeError, match=said):
        type("Loose", (Term,), {"compiled": lambda *given: None, **parts})


class Silent(SpringsTerm):
    """Springs that have an energy, and no kernel for it."""

    def compiled(self, part: Any, kept: Any, group: int) -> CompiledTerm:
        found = super().compiled(part, kept, group)
        return CompiledTerm(found.context, {FORCES: found.kernels[FORCES]})


def test_an_energy_without_a_kernel_is_refused():
    sheet = fd.Sheet(1e6, 0.25, 0.01, 1.0)
    structure = fd.discretize(fd.patterns.simple_fold(), sheet, preset="plate")
    body = fd.Case(structure, [fd.Fix([0, 1]), fd.Spring(1.0, nodes=[4])]).body
    springs = body.term(SpringsTerm).springs
    assert Assembly(body.sheet, SpringsTerm(springs)).energies(np.zeros(body.size)).sum() == 0.0
    with pytest.raises(TypeError, match="Silent has no kernel for its forces or energies"):
        Assembly(body.sheet, Silent(springs)).energies(np.zeros(body.size))
