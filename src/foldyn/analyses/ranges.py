"""Varied keys of a case file, each with its values or a range to sample from.

A range A:B:N has N values from A to B with equal differences, A:B:N:log with equal ratios. A range
to sample from is A:B or A:B:log. Single values are written 1,2,5.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.analyses.keys import parts
from foldyn.errors import InputError, within
from foldyn.values import number, parsed, plain, show, single, whole

MOST_VALUES = 1_000_000
"""Largest number of values of a key; a larger one must be a typing error."""
LOG = "log"
SAMPLINGS = ("latin_hypercube", "sobol", "saltelli")
"""Sampling methods."""
_REMEDY = "write A:B:N (N values from A to B), A:B:N:log, or values as in 1,2,5"
_SAMPLED = "with samples, write A:B (from A to B), A:B:log, or values as in 1,2,5"

Value = float | int | str | bool


@dataclass(frozen=True)
class Varied:
    """A key of a case file with its values in a sweep.

    Attributes
    ----------
    key : str
    values : tuple
        Values of the key; empty if it is sampled from a range.
    lower, upper : float
        Ends of the range.
    log : bool
        Whether the range is sampled evenly in the logarithm.
    """

    key: str
    values: tuple[Value, ...] = ()
    lower: float = math.nan
    upper: float = math.nan
    log: bool = False

    @property
    def numeric(self) -> bool:
        """Whether all its values are numbers."""
        return all(isinstance(v, int | float) and not isinstance(v, bool) for v in self.values)

    def at(self, share: NDArray[np.float64]) -> list[Value]:
        """Values at the given shares, from 0 to below 1, of the range or list."""
        if self.values:
            return [self.values[int(part * len(self.values))] for part in share]
        return _between(self.lower, self.upper, share, self.log).tolist()

    def tried(self) -> tuple[Value, ...]:
        """Values to try out, to check that the case file accepts the whole range or list."""
        if self.values:
            return self.values
        middle = _between(self.lower, self.upper, np.array([0.3819660112501051]), self.log)
        return (self.lower, self.upper, float(middle[0]))


def varied(given: Any, sampled: bool) -> tuple[Varied, ...]:
    """Varied keys of a sweep, from its table.

    Parameters
    ----------
    given : mapping of str to str, number or list
        Range or values of each key.
    sampled : bool
        Whether points are sampled, so that ranges have no count.

    Raises
    ------
    InputError
        The field begins with the key.
    """
    if not isinstance(given, Mapping):
        raise InputError(f" = {show(given)}: must be a table of keys, each with a range or values")
    if not given:
        raise InputError(": names nothing; give at least one key of the case file")
    found = []
    for key, spec in given.items():
        parts(key)
        with within(f'["{key}"]'):
            found.append(_varied(key, spec, sampled))
    return tuple(found)


def _varied(key: str, spec: Any, sampled: bool) -> Varied:
    if isinstance(spec, str) and ":" in spec:
        return _range(key, spec, sampled)
    if isinstance(spec, str):
        return Varied(key, _values([_word(word) for word in spec.split(",")]))
    if isinstance(spec, np.ndarray):
        spec = spec.tolist()
    return Varied(key, _values(spec if isinstance(spec, list | tuple | range) else [spec]))


def _range(key: str, text: str, sampled: bool) -> Varied:
    """A range A:B:N or A:B, with or without :log."""
    words = [word.strip() for word in text.split(":")]
    log = words[-1] == LOG
    if len(words) - log != (2 if sampled else 3):
        raise InputError(f" = {show(text)}: {_SAMPLED if sampled else _REMEDY}")
    ends = [_word(word) for word in words[:2]]
    with within(f" = {show(text)}: "):
        lower, upper = (number(name, end) for name, end in zip("AB", ends, strict=True))
        if lower == upper:
            raise InputError(": both ends are the same", "A, B")
        if log and (lower <= 0.0 or upper <= 0.0):
            raise InputError(": a logarithmic range needs ends above 0", "A, B")
        if sampled:
            return Varied(key, (), lower, upper, log)
        steps = whole("N", _word(words[2]), least=2, most=MOST_VALUES)
    values = (np.geomspace if log else np.linspace)(lower, upper, steps)
    if all(isinstance(end, int) for end in ends) and not np.any(values % 1.0):
        return Varied(key, tuple(map(int, values)))
    return Varied(key, tuple(values.tolist()))


def _between(lower: float, upper: float, share: NDArray, log: bool) -> NDArray[np.float64]:
    """Values between two ends, at the given shares (0 to 1) of the way."""
    return lower * (upper / lower) ** share if log else lower + share * (upper - lower)


def _word(word: str) -> Value:
    """A number, true or false, or otherwise the text itself."""
    word = word.strip()
    for kind in (int, float):
        try:
            return parsed(word, kind)
        except ValueError:
            continue
    return {"true": True, "false": False}.get(word, word)


def _values(listed: Iterable[Any]) -> tuple[Value, ...]:
    values = [plain(single(value)) for value in listed]
    if not values:
        raise InputError(" = []: names no values; give at least one")
    if len(values) > MOST_VALUES:
        raise InputError(f": {len(values)} values; give at most {MOST_VALUES}")
    for k, value in enumerate(values):
        if isinstance(value, str | bool):
            if value == "":
                raise InputError(f": value {k + 1} is empty; {_REMEDY}")
        else:
            number(f"[{k}]", value)
    kinds = {str if isinstance(v, str) else bool if isinstance(v, bool) else float for v in values}
    if len(kinds) > 1:
        raise InputError(f" = {show(values)}: must be all numbers, all texts, or true and false")
    if len(set(values)) < len(values):
        twice = next(value for value, count in Counter(values).items() if count > 1)
        raise InputError(f": {show(twice)} is listed twice")
    return tuple(values)
