"""Panels that are alike: found together what each has alone."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError
from foldyn.structures.panel_membrane import Kind, grading_of, membrane_stiffness
from foldyn.structures.panel_plate import Outline, shared

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
NONE = (False,) * 4


def quads(count: int) -> list[Outline]:
    """Some with straight edges."""
    rng = np.random.default_rng(4)
    found = []
    for k in range(count):
        x = SQUARE + 0.1 * rng.standard_normal((4, 2))
        straight = tuple(bool(k >> j & 1) for j in range(4))
        corners = tuple(map(tuple, x.tolist()))
        found.append(Outline(corners, tuple(x.mean(axis=0).tolist()), NONE, straight, NONE, NONE))
    return found


def test_values_are_found_by_eights_and_kept():
    asked = []

    @shared(lambda a, b: b)
    def summed(many):
        asked.append(list(many))
        return [a + b for a, b in many]

    many = [(k % 10, k % 2) for k in range(40)]
    assert summed.each(many) == [a + b for a, b in many]
    assert [len(some) for some in asked] == [5, 5]  # each once, with what is alike
    assert summed(4, 0) == 4
    assert len(asked) == 2
    summed.each([(k, 0) for k in range(10, 30)])
    assert [len(some) for some in asked[2:]] == [8, 8, 4]


@pytest.mark.parametrize("gives", [False, True])
def test_panels_of_one_kind_do_not_mix(gives):
    kinds = [
        Kind(
            panel,
            0.1 + 0.02 * k,
            (0.0, 0.01, 0.0, 0.02),
            grading_of(panel, 0.02) if gives else None,
        )
        for k, panel in enumerate(quads(11))
    ]
    together = membrane_stiffness.each(kinds)
    for k in (0, 3, 7, 10):
        moved = kinds[k]._replace(poissons_ratio=kinds[k].poissons_ratio + 1e-14)  # not kept yet
        alone = membrane_stiffness(*moved)
        np.testing.assert_allclose(together[k], alone, atol=1e-10 * np.abs(alone).max())


def test_a_panel_whose_stiffness_rounding_hides_is_refused():
    x = np.array([[0, 0, 0], [1, 0, 0], [0.4, 1, 0], [0.6, -1e-6, 0]])
    pattern = fd.Pattern(x, [(0, 1, 2), (0, 3, 1)])
    with pytest.raises(InputError, match="panel 1: is so narrow that rounding hides its stiff"):
        fd.discretize(pattern, fd.Sheet(1e9, 0.3, 1e-7, 700.0), preset="n5b8e")
