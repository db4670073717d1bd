"""Foldyn's exceptions and warnings.

Bad input raises `InputError` (the command line exits with 2, nothing written); a failed computation
raises `ComputationError` (exit status 1), which carries the results so far.
"""

from __future__ import annotations

import re
import sys
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib import import_module
from typing import Any

MOST_LINES, LONGEST_LINE, LONGEST = 20, 800, 4000
"""Limits of a message: number of lines, characters of a line, and characters in total."""


def shortened(message: str) -> str:
    """Shorten a message for readers: drop lines, and the middle of long lines."""
    if len(message) <= LONGEST_LINE and message.count("\n") < MOST_LINES:
        return message
    end = LONGEST_LINE // 3
    start = LONGEST_LINE - end - len(" ... ")
    lines = message.splitlines()
    kept: list[str] = []
    for line in lines[:MOST_LINES]:
        kept.append(line if len(line) <= LONGEST_LINE else f"{line[:start]} ... {line[-end:]}")
        if sum(map(len, kept)) > LONGEST - LONGEST_LINE:
            break
    if len(lines) > len(kept):
        kept[-1] = f"  ... and {len(lines) - len(kept) + 1} lines more"
    return "\n".join(kept)


ALSO = "\n  also "
"""Text between the lines of a message with several faults."""


class FoldynError(Exception):
    """Base of all exceptions that Foldyn raises on purpose."""

    def __init__(self, message: object = "") -> None:
        super().__init__(shortened(str(message)))


class InputError(FoldynError, ValueError):
    """The input cannot be used; the message names the field, the value and the remedy.

    Parameters
    ----------
    reason : str
        What is wrong and what to do. With a field, it continues the field's name: " = -1: must be
        ...", or ": missing; ...".
    field : str
        Path of the wrong value, such as "duration" or "loads[0].history".
    file : path, optional
        File that contains the wrong value.
    others : sequence of InputError
        Further errors, one line each in the message.
    """

    def __init__(
        self,
        reason: object = "",
        field: str = "",
        file: object = None,
        others: Sequence[InputError] = (),
    ) -> None:
        self.reason, self.field, self.file, self.others = str(reason), field, file, tuple(others)
        lines = dict.fromkeys(f"{one.field}{one.reason}" for one in (self, *self.others))
        super().__init__(f"{'' if file is None else f'{file}: '}{ALSO.join(lines)}")

    @property
    def key(self) -> str:
        """First part of the field: "loads" of "loads[0].history"."""
        return self.field.partition(".")[0].partition("[")[0]

    def within(self, field: str, file: object = None) -> InputError:
        """Copy of the error, with its field placed inside another field or in a file."""
        inner = self.field if self.file is None else f"{self.file}: {self.field}"
        others = [other.within(field) for other in self.others]
        return type(self)(self.reason, field + inner, file, others)


@contextmanager
def within(field: str, file: object = None) -> Iterator[None]:
    """Prefix the field of an `InputError` raised in the block with the place being checked."""
    try:
        yield
    except InputError as error:
        raise error.within(field, file) from None


@contextmanager
def renamed(names: Mapping[str, str]) -> Iterator[None]:
    """Name fields of an `InputError` raised in the block as the user knows them."""
    try:
        yield
    except InputError as error:
        field = names.get(error.key, error.field)
        raise InputError(error.reason, field, error.file, error.others) from None


def optional(module: str, need: str, install: str) -> Any:
    """Return a module of an optional library.

    Parameters
    ----------
    module : str
        Name by which the module is imported.
    need : str
        Feature and the library it needs, as in "camera tracking needs OpenCV".
    install : str
        Argument of "pip install".

    Raises
    ------
    InputError
        The module is not installed.
    """
    try:
        return import_module(module)
    except ImportError:
        raise InputError(f"{need}, which is not installed: pip install {install}") from None


class Faults:
    """Collects the errors of independent parts, to report them together."""

    def __init__(self) -> None:
        self.found: list[InputError] = []

    @contextmanager
    def collected(self) -> Iterator[None]:
        """Collect an `InputError` raised in the block."""
        try:
            yield
        except InputError as error:
            self.add(error)

    def add(self, error: InputError) -> None:
        """Add an error and its others."""
        self.found += [type(error)(error.reason, error.field, error.file), *error.others]

    def raise_all(self) -> None:
        """Raise all errors as one, if there are any."""
        if self.found:
            first, *others = self.found
            raise type(first)(first.reason, first.field, first.file, others)


class ComputationError(FoldynError, RuntimeError):
    """A computation failed.

    Attributes
    ----------
    partial : xarray.Dataset or None
        Results computed before the failure.
    """

    def __init__(self, message: str, partial: Any = None) -> None:
        super().__init__(message)
        self.partial = partial


class InstabilityError(ComputationError):
    """A motion grew without bound, became NaN, or left the range of its time step."""


class PenetrationError(ComputationError):
    """A hinge's dihedral jumped by more than pi: panel passed through panel."""


class MotionInterrupted(KeyboardInterrupt):
    """A motion was interrupted from the keyboard; `partial` has the results so far."""

    def __init__(self, message: str, partial: Any = None) -> None:
        super().__init__(message)
        self.partial = partial


class FoldynWarning(UserWarning):
    """A result may not be what was intended: one line, and the page that explains it.

    Parameters
    ----------
    message : str
        What is doubtful, with its value and the remedy.
    page : str
        Section of `docs` that explains the warning, such as "modes.md#choose-the-state".
    """

    def __init__(self, message: object = "", page: str = "") -> None:
        text = "; ".join(line.strip() for line in str(message).splitlines())
        super().__init__(shortened(f"{text} (docs/{page})" if page else text))


class CrossingWarning(FoldynWarning):
    """Panels pass through each other in a result; the message names them and the first time."""


class StretchWarning(FoldynWarning):
    """Stretched panels hold much of the strain energy, which the model predicts only roughly."""


class ModelRangeWarning(FoldynWarning):
    """Bars and hinges are used beyond their range, where a shell remains accurate."""


OF_MODELS = (StretchWarning, ModelRangeWarning)
"""Warnings about models. Studies and shipped cases use these models on purpose, and show the
warnings only on their pages."""


class UnitsWarning(FoldynWarning):
    """A number is probably in other units: degrees and SI units are expected."""


INSIDE = sys.stdlib_module_names | {"foldyn", "numba", "scipy", "xarray"}
"""Modules whose lines are skipped to find the user's line that caused a warning."""


def warn(message: str, page: str, category: type[FoldynWarning] = FoldynWarning) -> None:
    """Warn at the user's line; arguments as in `FoldynWarning`."""
    _issue(category(message, page))


def _issue(warning: Warning) -> None:
    frame = sys._getframe(1)
    while frame.f_back and frame.f_globals.get("__name__", "").partition(".")[0] in INSIDE:
        frame = frame.f_back
    place = frame.f_code.co_filename, frame.f_lineno
    known = frame.f_globals.setdefault("__warningregistry__", {})  # as `warnings.warn` does
    warnings.warn_explicit(warning, type(warning), *place, registry=known)


_NUMBER = r"[-+]?\d[\d.]*(?:e[-+]?\d+)?"
NUMBERS = re.compile(rf"(?<![\w\[]){_NUMBER}(?:, {_NUMBER})*")
"""Numbers in a text, except for numbers in names such as "loads[0]" and "node8"."""
NAMED = 6
"""Largest number of places that are listed."""


def listed(names: Sequence[object], most: int = NAMED) -> str:
    """Names on one line, truncated, as in "1, 2, 5 and 4 more"."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return f"{', '.join(map(str, names[:most]))}{more}"


class Told:
    """Collects warnings: texts that differ only in numbers count as one, with their origins.

    Attributes
    ----------
    where : str
        Origin of the warnings collected now, such as the name of a run; "" if the texts name it.
    """

    def __init__(self) -> None:
        self.where = ""
        self._found: dict[str, tuple[str, type[Warning], dict[str, bool]]] = {}

    def add(self, text: str, where: str = "", category: type[Warning] = FoldynWarning) -> bool:
        """Add a text; return whether it is the first of its kind."""
        key = NUMBERS.sub("#", text)
        new = key not in self._found
        self._found.setdefault(key, (text, category, {}))[2][where or text] = bool(where)
        return new

    def __iter__(self) -> Iterator[str]:
        """Yield each text once, with its origins, or with the number of similar texts."""
        return (text for text, _ in self._texts())

    def _texts(self) -> Iterator[tuple[str, type[Warning]]]:
        for text, category, places in self._found.values():
            named = [place for place, is_name in places.items() if is_name]
            others = f" (and {len(places) - 1} with other numbers)" if len(places) > 1 else ""
            yield text + (f" ({listed(named)})" if named else others), category

    @contextmanager
    def noting(self) -> Iterator[None]:
        """Collect the warnings of the block instead of showing them."""
        with warnings.catch_warnings():
            warnings.simplefilter("always")
            warnings.showwarning = lambda message, category, *_: self.add(  # type: ignore
                str(message), self.where, category
            )
            yield

    def kept(self) -> str:
        """Foldyn's own warnings as text, one line each, beginning with the class."""
        found = [(text, kind) for text, kind in self._texts() if issubclass(kind, FoldynWarning)]
        return "\n".join(f"{kind.__name__}: {text}" for text, kind in found)

    def add_kept(self, lines: str, where: str) -> None:
        """Add warnings from lines that `kept` returned."""
        for kind, _, text in (line.partition(": ") for line in lines.splitlines()):
            self.add(text, where, globals()[kind])

    def issue(self) -> None:
        """Issue all warnings, at the user's line."""
        for text, category in self._texts():
            _issue(category(text))  # type: ignore


def quietly() -> warnings.catch_warnings[None]:
    """Leave Foldyn's warnings of the block unsaid: others have told them, or they do not matter."""
    return warnings.catch_warnings(action="ignore", category=FoldynWarning)


@contextmanager
def told_once() -> Iterator[Told]:
    """Issue the warnings of the block at the end of the block, one of each kind."""
    told = Told()
    with told.noting():
        yield told
    told.issue()
