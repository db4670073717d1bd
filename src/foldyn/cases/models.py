"""The models of a sheet: bars and hinges, the shell, and superelements."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from inspect import signature
from typing import Any

from foldyn.condensation import Superelements, SuperelementsOptions, superelements
from foldyn.condensation.structure import MASSES as SUPERELEMENT_MASSES
from foldyn.shells import Shell, ShellOptions, shell
from foldyn.shells.shell import MASSES
from foldyn.structures import MASS_RULES, Structure, discretize
from foldyn.structures.presets import resolved

BARS_AND_HINGES, SHELL, SUPERELEMENTS = Structure.kind, Shell.kind, Superelements.kind


@dataclass(frozen=True)
class Model:
    """A way to make a structure from a pattern and a sheet.

    Attributes
    ----------
    make : callable
        ``make(pattern, sheet, **options)`` returns the structure.
    options : callable
        ``options(**given)`` returns all options of the model, with defaults for options that are
        not given.
    masses : iterable of str
        Mass rules that the model offers.
    name : str
        Name in messages.
    """

    make: Callable[..., Any]
    options: Callable[..., Any]
    masses: Iterable[str]
    name: str

    @property
    def keys(self) -> tuple[str, ...]:
        """Names of the arguments of `make` after pattern and sheet."""
        return tuple(signature(self.make).parameters)[2:]


MODELS: Mapping[str, Model] = {
    BARS_AND_HINGES: Model(discretize, resolved, MASS_RULES, "bars and hinges"),
    SHELL: Model(shell, ShellOptions, MASSES, "a shell"),
    SUPERELEMENTS: Model(superelements, SuperelementsOptions, SUPERELEMENT_MASSES, "superelements"),
}
