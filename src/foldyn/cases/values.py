"""Checks of single values that the parts of a case share.

Every message begins with the field's name, so that a caller can put a place in front of it
("loads[0].history." + "duration = -1: must be greater than 0").
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError


def show(value: Any) -> str:
    """Write a value the way a message shows it: short, strings in double quotes."""
    if isinstance(value, str):
        text = f'"{value}"'
    elif isinstance(value, bool):
        text = "true" if value else "false"
    elif isinstance(value, np.generic | np.ndarray):
        return show(value.tolist())
    elif isinstance(value, list | tuple):
        shown = [show(item) for item in value[:6]]
        text = f"[{', '.join(shown)}{', ...' if len(value) > 6 else ''}]"
    elif isinstance(value, dict):
        text = f"{{ {', '.join(f'{key} = {show(item)}' for key, item in value.items())} }}"
    elif isinstance(value, float | int):
        text = repr(value)
    else:
        text = str(value)
    return text if len(text) <= 80 else text[:76] + " ..."


def shortened(text: str) -> str:
    """Text for a message, in one line, of a long one only the beginning."""
    text = " ".join(text.splitlines())
    return text if len(text) <= 60 else f"{text[:56]} ..."


def nearest(word: str, known: Iterable[str]) -> str | None:
    """Return the known word nearest to `word`, if any is near."""
    close = difflib.get_close_matches(word, list(known), n=1, cutoff=0.6)
    return close[0] if close else None


def suggest(word: str, known: Iterable[str]) -> str:
    """Text "did you mean 'thickness'? " for the known word nearest to `word`, or nothing."""
    close = nearest(word, known)
    return f"did you mean '{close}'? " if close else ""


def choice(name: str, value: Any, known: Iterable[str]) -> str:
    """Return `value` when it is one of the `known` words."""
    known = list(known)
    if isinstance(value, str) and value in known:
        return value
    hint = suggest(value, known) if isinstance(value, str) else ""
    raise InputError(f"{name} = {show(value)}: {hint}choose one of {', '.join(known)}")


def number(
    name: str, value: Any, *, above: float | None = None, least: float | None = None
) -> float:
    """Return `value` as a finite float; truth values and text are not numbers.

    Parameters
    ----------
    above, least : float, optional
        Open and closed lower bounds.
    """
    if isinstance(value, bool | np.bool_) or not isinstance(value, Real):
        raise InputError(f"{name} = {show(value)}: must be a number")
    try:
        result = float(value)
    except OverflowError:
        result = math.inf
    if not math.isfinite(result):
        raise InputError(f"{name} = {show(value)}: must be a finite number")
    if above is not None and not result > above:
        raise InputError(f"{name} = {show(value)}: must be greater than {above:g}")
    if least is not None and not result >= least:
        raise InputError(f"{name} = {show(value)}: must be at least {least:g}")
    return result


def numbers(name: str, value: Any) -> NDArray[np.float64]:
    """Return `value` as a new read-only float array of finite numbers of any shape."""
    try:
        array = np.asarray(value)
    except ValueError:
        raise InputError(f"{name} = {show(value)}: rows have different lengths") from None
    if array.dtype.kind not in "iuf" or _has_truth_values(value):
        raise InputError(f"{name} = {show(value)}: must be numbers")
    result = np.array(array, dtype=np.float64)
    bad = np.argwhere(~np.isfinite(result))
    if bad.size:
        place = "".join(f"[{i}]" for i in bad[0])
        raise InputError(f"{name}{place} = {result[tuple(bad[0])]}: must be a finite number")
    result.flags.writeable = False
    return result


def number_or_list(name: str, value: Any, what: str) -> float | tuple[float, ...]:
    """Return `value` as a finite float, or a list of them as a tuple.

    Parameters
    ----------
    what : str
        What the list has one number for, for messages: "node".
    """
    if not isinstance(value, list | tuple | np.ndarray):
        return number(name, value)
    array = numbers(name, value)
    if array.ndim == 0:
        return float(array)
    if array.ndim > 1 or not array.size:
        raise InputError(f"{name} = {show(value)}: must be a number, or a list of one per {what}")
    return tuple(array.tolist())


def indices(name: str, value: Any, what: str, alternative: str) -> tuple[int, ...]:
    """Return `value`, a whole number or a list of them, as a tuple of distinct whole numbers.

    Parameters
    ----------
    what : str
        What the numbers count, for messages: "node".
    alternative : str
        What may be given instead of numbers, for messages.
    """
    array = np.atleast_1d(np.asarray(value, dtype=object))
    if array.ndim != 1 or array.size == 0:
        raise InputError(
            f"{name} = {show(value)}: must be {what} numbers, as in [0, 1], {alternative}"
        )
    for item in array:
        if isinstance(item, bool | np.bool_) or not isinstance(item, int | np.integer):
            raise InputError(f"{name} = {show(value)}: {show(item)} is not a {what} number")
    chosen = tuple(int(item) for item in array)
    if len(set(chosen)) < len(chosen):
        twice = next(item for item in chosen if chosen.count(item) > 1)
        raise InputError(f"{name} = {show(value)}: {what} {twice} is listed twice")
    return chosen


def vector(name: str, value: Any, *, nonzero: bool = False) -> tuple[float, float, float]:
    """Return `value` as three finite floats, if asked not all of them zero."""
    array = numbers(name, value)
    if array.shape != (3,):
        raise InputError(f"{name} = {show(value)}: must be three numbers (x, y, z)")
    if nonzero and not array.any():
        raise InputError(f"{name} = {show(value)}: must not be zero")
    x, y, z = array.tolist()
    return x, y, z


def _has_truth_values(value: Any) -> bool:
    # numpy silently turns [1.0, True] into floats
    if isinstance(value, np.ndarray):
        return value.dtype.kind == "b"
    if isinstance(value, list | tuple):
        return any(_has_truth_values(item) for item in value)
    return isinstance(value, bool | np.bool_)
