"""Measures: named functions of a result, and the arguments of these functions."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from inspect import signature
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.analyses import CaseFile
from foldyn.cases import Case
from foldyn.cases.directions import AXES
from foldyn.errors import FoldynError, InputError
from foldyn.values import choice, number, show, suggest

F = TypeVar("F", bound=Callable[..., Any])
NODE, AXIS, MODE, BAND = "node", "axis", "mode", "band"
WORDS = ("model", "point", "leg", "load", "strain", "pair", "plane", "bend")
"""Arguments of measures that are names in the result."""
REALS = {"time": "s", "displacement": "m", "frequency": "Hz"}
"""Arguments of measures that are numbers, with their units."""
_ASKED = re.compile(r"([A-Za-z_]\w*)(?:\[([^\[\]]*)\])?\Z")
_NAME = re.compile(r"[A-Za-z_]\w*\Z")
_OWN = re.compile(r"(?:([A-Za-z_]\w*)=)?(.+):([A-Za-z_]\w*)\Z")


@dataclass(frozen=True)
class Measure:
    """A named function of a result.

    Parameters
    ----------
    name : str
    kinds : tuple of str
        Kinds of analysis to which the measure applies; empty means all kinds.
    function : callable
        ``function(result, case)``, with the values of `takes` as further named arguments; returns a
        number or an array.
    units : str
        "1" if dimensionless, "" if unknown.
    doc : str
        Meaning of the measure; also the label in figures.
    dims : tuple of str
        Dimensions of an array; their lengths may differ from point to point.
    takes : tuple of str
        Arguments, in their order: "node", "axis", "mode", "band", "model", "point", "leg",
        "load", "strain", "time", "displacement", "frequency", "panel", "crease".
    needs : int
        How many of these arguments must be given.
    through : callable, optional
        ``through(result, case)`` runs first, once for all measures that share it; its return value
        replaces the result.
    whole : bool
        Whether the measure needs a whole path, and has no value for a path that stopped early: true
        for measures of the end, and for extremes.
    """

    name: str
    kinds: tuple[str, ...]
    function: Callable[..., Any]
    units: str = "1"
    doc: str = ""
    dims: tuple[str, ...] = ()
    takes: tuple[str, ...] = ()
    needs: int = 0
    through: Callable[[xr.Dataset, Case], Any] | None = None
    whole: bool = False

    @property
    def asked(self) -> str:
        """Notation of the measure with its arguments, such as "peak_frequency[node,axis]"."""
        shown = [*self.takes[: self.needs], *(f"{word}?" for word in self.takes[self.needs :])]
        return f"{self.name}[{','.join(shown)}]" if shown else self.name


def measure(known: dict[str, Measure], *kinds: str, **about: Any) -> Callable[[F], F]:
    """Register a function, under its name, as a measure for kinds of analysis; see `Measure`."""

    def registered(function: F) -> F:
        name = function.__name__.removeprefix("_")
        taken = [*signature(function).parameters.values()][2:]
        needs = sum(one.default is one.empty for one in taken)
        takes = tuple(one.name for one in taken)
        known[name] = Measure(name, kinds, function, takes=takes, needs=needs, **about)
        return function

    return registered


@dataclass(frozen=True)
class Asked:
    """A measure with its arguments.

    Attributes
    ----------
    name : str
        Name of the measure in the result of a sweep.
    measure : Measure
    arguments : dict
    text : str
        Text with which the measure was requested.
    """

    name: str
    measure: Measure
    arguments: Mapping[str, Any]
    text: str

    def of(self, result: xr.Dataset, case: Case, shared: dict[Any, Any]) -> NDArray:
        """Value of the measure.

        Parameters
        ----------
        result : xarray.Dataset
        case : Case
        shared : dict
            Return values of `through` for this result, by function; new ones are added.

        Raises
        ------
        FoldynError
            The measure does not apply to this result.
        """
        if self.measure.whole and result.attrs.get("status") == "stopped":
            raise InputError(f"{self.text}: needs a whole path, and this one stopped early")
        try:
            through, subject = self.measure.through, result
            if through is not None:
                if through not in shared:
                    shared[through] = through(result, case)
                subject = shared[through]
            found = self.measure.function(subject, case, **self.arguments)
        except FoldynError as error:
            raise type(error)(f"{self.text}: {error}") from None
        except MemoryError:  # more memory may be free next time
            raise
        except Exception as error:  # a user's function may raise anything
            raise InputError(f"{self.text}: {type(error).__name__}: {error}") from error
        if found is None:
            raise InputError(f"{self.text}: gave nothing; let it return a number or an array")
        if np.iscomplexobj(found):
            raise InputError(f"{self.text}: gave complex numbers; take their abs, real or imag")
        try:
            value = np.asarray(found, dtype=np.float64)
        except (TypeError, ValueError):
            raise InputError(f"{self.text}: gave {show(found)}, no number or array") from None
        if self.measure.dims and value.ndim != len(self.measure.dims):
            raise InputError(
                f"{self.text}: gave an array of shape {value.shape}, not one over "
                f"{', '.join(self.measure.dims)}"
            )
        return value

    def number(self, result: xr.Dataset, case: Case, shared: dict[Any, Any]) -> float:
        """Value of a measure that must be a number; see `of`."""
        value = self.of(result, case, shared)
        if value.ndim:
            raise InputError(f"{self.text}: is an array; ask for one of its numbers")
        return float(value)

    def check(self, case_file: CaseFile) -> None:
        """Refuse a measure that does not apply to results of a case file."""
        kind, kinds = case_file.analysis.kind, self.measure.kinds
        if kinds and kind not in kinds:
            raise InputError(
                f"{self.text}: is for analysis.kind = {' or '.join(show(one) for one in kinds)}, "
                f"but {case_file.path} is of kind {show(kind)}"
            )
        self.check_numbers(case_file.case())

    def check_numbers(self, case: Case) -> None:
        """Refuse numbers of nodes, panels and creases that a case does not have."""
        structure = case.structure
        own = {NODE: structure.nodes, "panel": structure.centers, "crease": structure.folds}
        for word, rows in own.items():
            if self.arguments.get(word, -1) >= len(rows):
                raise InputError(
                    f"{self.text}: there is no {word} {self.arguments[word]}; {word}s are 0 to "
                    f"{len(rows) - 1}"
                )


def asked(text: str, known: Mapping[str, Measure]) -> Asked:
    """Measure of the registry from its text, such as "peak_frequency[8,x]".

    Raises
    ------
    InputError
        There is no measure of this name, or its arguments are wrong.
    """
    found = _ASKED.match(text.strip()) if isinstance(text, str) else None
    if found is None:
        raise InputError(f" = {show(text)}: write a name like frequencies or peak_frequency[8]")
    name, inside = found[1], found[2]
    if name not in known:
        raise InputError(
            f" = {show(text)}: there is no measure {name}; {suggest(name, known)}choose one of "
            f"{', '.join(known)}"
        )
    measure = known[name]
    given = [word.strip() for word in inside.split(",")] if inside is not None else []
    if not measure.needs <= len(given) <= len(measure.takes):
        raise InputError(f" = {show(text)}: write {measure.asked} (? may be left out)")
    pairs = zip(measure.takes, given, strict=False)
    arguments = {what: _argument(text, what, word) for what, word in pairs}
    own = "_".join([name, *map(str, arguments.values())])
    return Asked(own, measure, arguments, text.strip())


def _argument(text: str, what: str, word: str) -> Any:
    if what == AXIS:
        return choice(f" = {show(text)}: axis", word, AXES)
    if what in WORDS:
        return word
    if what in REALS:
        try:
            return number("", float(word))
        except (ValueError, InputError):
            raise InputError(
                f" = {show(text)}: {what} = {show(word)}: give a number, {REALS[what]}"
            ) from None
    least = 1 if what in (MODE, BAND) else 0
    if not (word.isascii() and word.isdecimal()) or int(word) < least:
        raise InputError(f" = {show(text)}: {what} = {show(word)}: give a number from {least} on")
    return int(word)


def own_measure(text: str, folder: Path) -> Asked | None:
    """A user's function, from "module:function" or "file.py:function"; None for other text."""
    found = _OWN.match(text.strip())
    if found is None:
        return None
    name, place, function = found[1] or found[3], found[2], found[3]
    loaded = Loaded(str(folder / place) if place.endswith(".py") else place, function)
    loaded.load()
    return Asked(name, Measure(name, (), loaded), {}, text.strip())


def of_callable(name: str, function: Callable[..., Any]) -> Asked:
    """A user's function as a measure."""
    if not _NAME.match(name):
        raise InputError(
            f" = {show(name)}: is no name for a measure; give functions by name, as in "
            '{"tip": function}',
            "measures",
        )
    return Asked(name, Measure(name, (), function), {}, name)


@dataclass(frozen=True)
class Loaded:
    """A function identified by its location, so that it can be sent to other processes."""

    place: str
    function: str

    def load(self) -> Callable[..., Any]:
        """Import the function.

        Raises
        ------
        InputError
            The module cannot be imported, or has no such function.
        """
        try:
            module = _module(self.place)
        except Exception as error:  # a user's module may raise anything
            raise InputError(
                f" = {show(f'{self.place}:{self.function}')}: cannot be imported "
                f"({type(error).__name__}: {error}); write module:function or file.py:function"
            ) from None
        found = getattr(module, self.function, None)
        if not callable(found):
            raise InputError(
                f" = {show(f'{self.place}:{self.function}')}: {self.place} has no function "
                f"{self.function}"
            )
        return found

    def __call__(self, result: xr.Dataset, case: Case) -> Any:
        """Value of the function."""
        return self.load()(result, case)


_modules: dict[str, Any] = {}  # functions loaded from files, once per process


def _module(place: str) -> Any:
    if not place.endswith(".py"):
        return import_module(place)
    if place not in _modules:
        spec = spec_from_file_location(Path(place).stem, place)
        if spec is None or spec.loader is None:
            raise ImportError(place)
        module = module_from_spec(spec)
        spec.loader.exec_module(module)
        _modules[place] = module
    return _modules[place]
