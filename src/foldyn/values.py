"""Checks of single values at the interface: checked values cannot overflow later.

Every message begins with the field's name, so that a caller can put a place in front of it
("loads[0].history." + "duration = -1: must be greater than 0").
"""

from __future__ import annotations

import difflib
import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from numbers import Integral, Real
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.errors import InputError, UnitsWarning, warn

LARGEST, SMALLEST = 1e50, 1e-50
"""Smallest and largest size of numbers except 0, in SI units: fourth powers and quotients of such
numbers stay in range."""
LONGEST, SHORTEST = 1e30, 1e-30
"""Smallest and largest length (m): eighth powers of lengths occur. The range goes from less than
Planck's length to a thousand universes."""
MOST = 2**63 - 1
"""Largest whole number that arrays of whole numbers hold."""
ROUND, DIGITS = 7.0, 1e-4
"""Largest angle that may be meant in radians, and its tolerance to a simple part of pi."""
PARTS = np.array([*range(1, 13), 18])
"""Simple parts of pi; they include multiples of 10 and of 15 degrees."""
LARGE = ("panel_angle", "dihedral", "crease_rest", "angle")
"""Names of angles that in degrees are rarely as small as an angle in radians."""
SMALL, TURN, ROUNDED = 0.35, 2.0 * np.pi, 1e-6
"""Smallest such angle in radians (20 degrees), and the tolerance to whole tenths of degrees."""
SHOWN = 60
"""Largest number of characters of a value in a message."""
T = TypeVar("T")
N = TypeVar("N", int, float)


def show(value: Any) -> str:
    """Value as shown in a message: short, with strings in double quotes."""
    text = _written(value, 3)
    return text if len(text) <= SHOWN else text[: SHOWN - 4] + " ..."


def _written(value: Any, depth: int) -> str:
    """Text of a value and its items, down to `depth` levels."""
    if isinstance(value, str):
        return f'"{value[:SHOWN]}"'
    if isinstance(value, np.generic | np.ndarray):
        return _written(value.tolist() if value.ndim == 0 else list(value[:7]), depth)
    if isinstance(value, list | tuple | dict) and depth == 0:
        return "..."
    if isinstance(value, dict):
        shown = [f"{key} = {_written(value[key], depth - 1)}" for key in list(value)[:6]]
        return f"{{ {', '.join(shown)}{', ...' if len(value) > 6 else ''} }}"
    if isinstance(value, list | tuple):
        shown = [_written(item, depth - 1) for item in value[:6]]
        return f"[{', '.join(shown)}{', ...' if len(value) > 6 else ''}]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):  # Python refuses to write the digits of very large integers
        digits = int(value.bit_length() * math.log10(2.0)) + 1
        return repr(value) if digits < SHOWN else f"a number of about {digits} digits"
    return repr(value) if isinstance(value, float) else str(value)


def plain(value: Any) -> Any:
    """Plain Python value: lists instead of tuples, no NumPy numbers."""
    if isinstance(value, tuple):
        return [plain(item) for item in value]
    return value.item() if isinstance(value, np.generic) else value


def single(value: Any) -> Any:
    """The number in a zero-dimensional array, as optimizers and xarray pass it."""
    return value[()] if isinstance(value, np.ndarray) and value.ndim == 0 else value


def shortened(text: str) -> str:
    """Text for a message, on one line and truncated."""
    text = " ".join(text.splitlines())
    return text if len(text) <= SHOWN else f"{text[: SHOWN - 4]} ..."


def nearest(word: str, known: Iterable[str]) -> str | None:
    """The known word closest to `word`, if any is close."""
    close = difflib.get_close_matches(str(word)[:SHOWN], list(known), n=1, cutoff=0.6)
    return close[0] if close else None


def suggest(word: str, known: Iterable[str]) -> str:
    """Text "did you mean 'thickness'? " for the known word nearest to `word`, or nothing."""
    close = nearest(word, known)
    return f"did you mean '{close}'? " if close else ""


def choice(name: str, value: Any, known: Iterable[str]) -> str:
    """Return `value` if it is one of the `known` words."""
    known = list(known)
    if isinstance(value, str) and value in known:
        return str(value)
    hint = suggest(value, known) if isinstance(value, str) else ""
    raise InputError(f" = {show(value)}: {hint}choose one of {', '.join(known)}", name)


def parsed(text: str, kind: Callable[[str], N] = float) -> N:
    """Number in the text of a file or command line.

    Raises
    ------
    ValueError
        It is not a number, or only Python accepts it: 1_0, or digits of other scripts.
    """
    if "_" in text or not text.isascii():
        raise ValueError(text)
    return kind(text)


def of_kind(name: str, value: Any, *kinds: type[T]) -> T:
    """Return `value` when it is an object of one of some classes."""
    if isinstance(value, kinds):
        return value
    known = " or ".join(kind.__name__ for kind in kinds)
    raise InputError(f": got {type(value).__name__}, give a {known}", name)


def objects(name: str, value: Any, kinds: tuple[type[T], ...]) -> tuple[T, ...]:
    """Return a list or tuple of objects of some classes as a tuple."""
    what = " or ".join(kind.__name__ for kind in kinds)
    if isinstance(value, str) or not isinstance(value, Sequence):
        raise InputError(f" = {show(value)}: must be a list of {what}", name)
    for i, item in enumerate(value):
        if not isinstance(item, kinds):
            raise InputError(f" = {show(item)}: must be a {what}", f"{name}[{i}]")
    return tuple(value)


def function(name: str, value: Any) -> Any:
    """Return `value` when it is a function, or None."""
    if value is None or callable(value):
        return value
    raise InputError(f" = {show(value)}: give a function, or leave it out", name)


def listed(name: str, value: Any, what: str) -> list[Any]:
    """Return the items of a list, tuple, array or other collection.

    Parameters
    ----------
    what : str
        Items of the list, for messages, such as "pairs of vertices".
    """
    try:
        if isinstance(value, str | bytes):
            raise TypeError
        return list(value)
    except TypeError:
        raise InputError(f" = {show(value)}: give a list of {what}", name) from None


def flag(name: str, value: Any) -> bool:
    """Return a truth value as bool."""
    value = single(value)
    if not isinstance(value, bool | np.bool_):
        raise InputError(f" = {show(value)}: must be True or False (true or false in TOML)", name)
    return bool(value)


def number(
    name: str,
    value: Any,
    *,
    above: float | None = None,
    least: float | None = None,
    below: float | None = None,
    most: float | None = None,
    unit: str = "",
    smallest: float = SMALLEST,
    largest: float = LARGEST,
) -> float:
    """Return `value` as a float of a size that can be computed with.

    Truth values and text are not numbers.

    Parameters
    ----------
    above, least, below, most : float, optional
        Open and closed bounds.
    unit : str
        Unit for messages, such as "degrees".
    smallest, largest : float
        Smallest and largest size of numbers except 0.
    """
    value = single(value)
    if isinstance(value, bool | np.bool_) or not isinstance(value, Real):
        kind = f" ({unit})" if unit else ""
        raise InputError(f" = {show(value)}: must be a number{kind}", name)
    try:
        result = float(value)
    except OverflowError:
        result = math.inf
    if not math.isfinite(result):
        raise InputError(f" = {show(value)}: must be a finite number", name)
    unit = f" {unit}" if unit else ""
    small = "0 or in size at least" if above is None else "in size at least"
    for fits, words, bound in (
        (above is None or result > above, "greater than", above),
        (least is None or result >= least, "at least", least),
        (below is None or result < below, "less than", below),
        (most is None or result <= most, "at most", most),
        (abs(result) <= largest, "in size at most", largest),
        (result == 0.0 or abs(result) >= smallest, small, smallest),
    ):
        if not fits:
            raise InputError(f" = {show(value)}: must be {words} {bound:g}{unit}", name)
    if unit == " degrees":
        doubt_degrees(name, result)
    return result


def doubt_degrees(name: str, value: Any) -> None:
    """Warn if an angle (degrees), or all of several, look like radians.

    An angle is doubted if it is below 7 and a simple part of pi to four digits, such as np.pi / 3
    or 1.0472. Angles between panels and of panels are rarely that small; they are doubted if they
    are from 0.35 to 2 pi with two decimals or more.
    """
    angles = np.abs(np.ravel(np.asarray(value, float)))
    angles = angles[angles > 0.0]
    if not angles.size or angles.max() > ROUND:
        return
    parts = angles[:, None] * PARTS / np.pi
    whole_parts = np.rint(parts)
    near = (whole_parts > 0.0) & (np.abs(parts - whole_parts) <= DIGITS * parts)
    meant = ""
    if near.any(axis=1).all():
        part = int(PARTS[near[0].argmax()])
        times = int(whole_parts[0, near[0].argmax()])
        pi = f"{'' if times == 1 else f'{times} '}pi{'' if part == 1 else f'/{part}'}"
        meant = f"is {pi}, but angles are in degrees: give {180.0 * times / part:g}"
    elif name.rpartition(".")[2] in LARGE and (angles >= SMALL).all() and (angles <= TURN).all():
        tenths = 10.0 * angles
        if (np.abs(tenths - np.rint(tenths)) > ROUNDED).all():
            meant = f"is small for an angle in degrees: give {np.degrees(angles[0]):.4g}"
    if meant:
        text = f"{name.removeprefix('.')} = {angles[0]:.5g} {meant} if that is meant in radians"
        warn(text, "sheets.md#units", UnitsWarning)


def length(name: str, value: Any) -> float:
    """Return a positive length (m)."""
    return number(name, value, above=0.0, unit="m", smallest=SHORTEST, largest=LONGEST)


def whole(
    name: str, value: Any, *, least: int | None = None, most: int = MOST, what: str = ""
) -> int:
    """Return `value` as an int; booleans and floats are refused.

    Parameters
    ----------
    least, most : int, optional
        Closed bounds.
    what : str
        Counted items or unit, for messages.
    """
    value, what = single(value), f" ({what})" if what else ""
    counts = not isinstance(value, bool | np.bool_) and isinstance(value, Integral)
    result = int(value) if counts else 0
    if not counts or (least is not None and result < least):
        bound = "" if least is None else f", at least {least}"
        raise InputError(f" = {show(value)}: must be a whole number{bound}{what}", name)
    if not -MOST - 1 <= result <= most:
        end = f"at most {most}" if result > 0 else f"at least {-MOST - 1}"
        raise InputError(f" = {show(result)}: must be {end}{what}", name)
    return result


def numbers(name: str, value: Any) -> NDArray[np.float64]:
    """Return `value` as a new read-only float array of any shape.

    The numbers are finite and at most `LARGEST` in size; at least one of them reaches `SMALLEST`,
    unless all are 0.
    """
    try:
        array = np.asarray(value)
    except ValueError:
        raise InputError(f" = {show(value)}: rows have different lengths", name) from None
    if array.dtype == object:  # integers beyond 64 bits are numbers, but too large
        array = _as_floats(array)
    if array.dtype.kind not in "iuf" or _has_truth_values(value):
        raise InputError(f" = {show(value)}: must be numbers", name)
    result = np.array(array, dtype=np.float64)
    for usable, words in (
        (np.isfinite(result), "a finite number"),
        (np.abs(result) <= LARGEST, f"in size at most {LARGEST:g}"),
    ):
        bad = np.argwhere(~usable)
        if len(bad):
            place = "".join(f"[{i}]" for i in bad[0])
            raise InputError(f" = {result[tuple(bad[0])]}: must be {words}", f"{name}{place}")
    size = float(np.abs(result).max(initial=0.0))
    if 0.0 < size < SMALLEST:
        raise InputError(
            f": the largest in size is {size:g}; must be 0 or at least {SMALLEST:g}", name
        )
    result.flags.writeable = False
    return result


def increasing(name: str, value: Any, **limits: Any) -> NDArray[np.float64]:
    """Return `value`, one number or a list of them that increase, as a read-only array (k,).

    limits : bounds of the first one, as in `number`.
    """
    array = np.atleast_1d(numbers(name, value))
    if array.ndim != 1 or not array.size:
        raise InputError(f" = {show(value)}: must be a list of numbers that increase", name)
    number(f"{name}[0]", np.ravel(value)[0], **limits)
    back = np.flatnonzero(np.diff(array) <= 0.0)
    if back.size:
        before, now = array[back[0] : back[0] + 2]
        raise InputError(
            f" = {show(now)}: must increase, and the one before it is {show(before)}; sort them "
            "and drop doubles",
            f"{name}[{back[0] + 1}]",
        )
    return array


def writable(array: ArrayLike) -> NDArray[np.float64]:
    """Contiguous writable floats; other arrays would cause kernels to be compiled again."""
    floats = np.ascontiguousarray(array, float)
    return floats if floats.flags.writeable else floats.copy()


def _as_floats(array: NDArray) -> NDArray:
    """Floats from integers of any size; other arrays are returned unchanged."""
    if not all(isinstance(item, int | float) for item in array.ravel()):
        return array
    large = {True: math.inf, False: -math.inf}
    found = [item if abs(item) <= MOST else large[item > 0] for item in array.ravel()]
    return np.array(found, dtype=np.float64).reshape(array.shape)


def number_or_list(name: str, value: Any, what: str, **limits: Any) -> float | tuple[float, ...]:
    """Return `value` as a finite float, or a list of them as a tuple.

    Parameters
    ----------
    what : str
        Name of the items that have one number each, for messages, such as "node".
    **limits
        Bounds of each number, as in `number`.
    """
    value = single(value)
    if not isinstance(value, list | tuple | np.ndarray):
        return number(name, value, **limits)
    array = numbers(name, value)
    if array.ndim > 1 or not array.size:
        raise InputError(f" = {show(value)}: must be a number, or a list of one per {what}", name)
    return tuple(number(f"{name}[{i}]", each, **limits) for i, each in enumerate(array.tolist()))


def one_or_each(name: str, value: Any, count: int, what: str) -> NDArray[np.float64]:
    """Array (count,) from `number_or_list`: one number for all, or one for each.

    what : name of the counted items in messages, such as "nodes".
    """
    array = np.array(value)
    if array.ndim and len(array) != count:
        raise InputError(
            f" = {show(value)}: {len(array)} value{'s' * (len(array) != 1)} for {count} {what}; "
            "give one, or one for each",
            name,
        )
    return np.broadcast_to(array, (count,))


def indices(name: str, value: Any, what: str, alternative: str) -> tuple[int, ...]:
    """Return `value`, a whole number or a list of them, as a tuple of distinct whole numbers.

    Parameters
    ----------
    what : str
        Name of the numbered items in messages, such as "node".
    alternative : str
        Alternative to numbers, for messages.
    """
    array = np.atleast_1d(np.asarray(value, dtype=object))
    if array.ndim != 1 or array.size == 0:
        raise InputError(
            f" = {show(value)}: must be {what} numbers, as in [0, 1], {alternative}", name
        )
    items = [single(item) for item in array]
    for item in items:
        if isinstance(item, bool | np.bool_) or not isinstance(item, int | np.integer):
            raise InputError(f" = {show(value)}: {show(item)} is not a {what} number", name)
        if abs(int(item)) > MOST:
            raise InputError(f": {show(item)}: is too large for a {what} number", name)
    chosen = tuple(int(item) for item in items)
    if len(set(chosen)) < len(chosen):
        twice = next(item for item, times in Counter(chosen).items() if times > 1)
        raise InputError(f" = {show(value)}: {what} {twice} is listed twice", name)
    return chosen


def vector(name: str, value: Any, *, nonzero: bool = False) -> tuple[float, float, float]:
    """Return `value` as three finite floats; with `nonzero`, not all of them zero."""
    array = numbers(name, value)
    if array.shape != (3,):
        raise InputError(f" = {show(value)}: must be three numbers (x, y, z)", name)
    if nonzero and not array.any():
        raise InputError(f" = {show(value)}: must not be zero", name)
    x, y, z = array.tolist()
    return x, y, z


def _has_truth_values(value: Any) -> bool:
    # NumPy silently turns [1.0, True] into floats
    if isinstance(value, np.ndarray):
        return value.dtype.kind == "b"
    if isinstance(value, list | tuple):
        return any(_has_truth_values(item) for item in value)
    return isinstance(value, bool | np.bool_)
