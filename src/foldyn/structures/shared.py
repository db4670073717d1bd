"""Cache of functions of panels: equal arguments share values, computed for several at once."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from typing import Generic, TypeVar

from foldyn.jit.eights import COUNT

Value = TypeVar("Value")
Find = Callable[[Sequence[tuple]], list[Value]]
ROOM = 4096  # cached values of each kind; older ones are dropped


class Shared(Generic[Value]):
    """A function with cached values; see `shared`."""

    def __init__(self, find: Find[Value], alike: Callable[..., Hashable]) -> None:
        self._find, self._alike = find, alike
        self._kept: dict[tuple, Value] = {}

    def __call__(self, *given: Hashable) -> Value:
        """The value for these arguments."""
        return self.each([given])[0]

    def each(self, many: Sequence[tuple]) -> list[Value]:
        """The values for the arguments of many calls."""
        found = {given: self._kept[given] for given in many if given in self._kept}
        groups: dict[Hashable, list[tuple]] = {}
        for given in dict.fromkeys(many):
            if given not in found:
                groups.setdefault(self._alike(*given), []).append(given)
        for group in groups.values():
            for first in range(0, len(group), COUNT):
                some = group[first : first + COUNT]
                found |= zip(some, self._find(some), strict=True)
        if groups:
            self._kept = dict([*{**self._kept, **found}.items()][-ROOM:])
        return [found[given] for given in many]


def shared(alike: Callable[..., Hashable]) -> Callable[[Find[Value]], Shared[Value]]:
    """Decorator of functions from the arguments of at most `COUNT` calls to their values.

    alike : callable
        Maps the arguments of a call to a key; calls with equal keys are computed together.
    """
    return lambda find: Shared(find, alike)
