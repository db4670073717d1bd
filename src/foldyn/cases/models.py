"""The models of a sheet."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields
from typing import Any

from foldyn.shells import Shell, ShellOptions, shell
from foldyn.shells.shell import MASSES
from foldyn.structures import MASS_RULES, ModelOptions, Structure, discretize

BARS_AND_HINGES, SHELL = Structure.kind, Shell.kind


@dataclass(frozen=True)
class Model:
    """A way to make a structure from a pattern and a sheet.

    Attributes
    ----------
    make : callable
        ``make(pattern, sheet, **options)`` gives the structure.
    options : type
        Dataclass of its options.
    masses : iterable of str
        Distributions of mass that it offers.
    name : str
        In messages.
    """

    make: Callable[..., Any]
    options: type
    masses: Iterable[str]
    name: str

    @property
    def keys(self) -> tuple[str, ...]:
        """Names of its options."""
        return tuple(item.name for item in fields(self.options))

    @property
    def mass(self) -> str:
        """Its default distribution of mass."""
        return self.options().mass


MODELS: Mapping[str, Model] = {
    BARS_AND_HINGES: Model(discretize, ModelOptions, MASS_RULES, "bars and hinges"),
    SHELL: Model(shell, ShellOptions, MASSES, "a shell"),
}
