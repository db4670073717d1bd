"""Laws of the folds as users give them: one for all, one for each, or by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from foldyn.errors import InputError
from foldyn.materials import EnhancedLinear, HingeLaw, hinge_law
from foldyn.materials.by_hinge import LawByHinge
from foldyn.patterns.crease_data import crease_values

OTHERS = "others"  # the creases that are not named
FoldLaws = str | HingeLaw | Sequence[str | HingeLaw] | Mapping[str, str | HingeLaw]


def laws_given(given: Any, others: Any = EnhancedLinear()) -> tuple[Any, list[HingeLaw]]:
    """Check laws; return them, a mapping with the law of creases that are not named, and a list."""
    if isinstance(given, Mapping) and given:
        whole = {OTHERS: others, **given}
        return whole, [hinge_law(own, f"fold_law.{word}") for word, own in whole.items()]
    if isinstance(given, list | tuple) and given:
        each = [hinge_law(own, f"fold_law[{k}]") for k, own in enumerate(given)]
        return tuple(given), each
    one: Any = given
    return given, [hinge_law(one, "fold_law")]


def law_of_folds(given: Any, pattern: Any) -> HingeLaw:
    """Law of the creases of a pattern, from what `laws_given` returns."""
    _, laws = laws_given(given)
    if isinstance(given, Mapping):
        words = [*given]
        number = {word: float(k) for k, word in enumerate(words) if word != OTHERS}
        which, named = crease_values("fold_law", number, pattern)
        which = np.where(named, which, words.index(OTHERS)).astype(int)
    elif isinstance(given, tuple):
        if len(given) != len(pattern.creases):
            raise InputError(
                f": {len(given)} laws for {len(pattern.creases)} creases: give one for each",
                "fold_law",
            )
        which = np.arange(len(given))
    else:
        return laws[0]
    same = np.array([laws.index(law) for law in laws])
    return LawByHinge(tuple(laws), tuple(same[which].tolist())).at(slice(None))
