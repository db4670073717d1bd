"""The models of a sheet that a case file may ask for, and a case file for another model."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields
from typing import Any

from foldyn.shells import ShellOptions, shell
from foldyn.shells.shell import MASSES
from foldyn.structures import MASS_RULES, ModelOptions, discretize
from foldyn.values import choice

BARS_AND_HINGES = "bars_and_hinges"
SHELL = "shell"
MASSLESS_METHODS = ("newmark", "generalized_alpha")
"""Integrators that take dofs without mass, as the rotations of a shell are."""


@dataclass(frozen=True)
class Model:
    """A way to make a structure of a pattern and a sheet.

    Attributes
    ----------
    make : callable
        ``make(pattern, sheet, **options)`` gives the structure.
    options : type
        Dataclass of its options.
    masses : iterable of str
        Its distributions of mass.
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
        """Distribution of mass that it has by default."""
        return self.options().mass


MODELS: Mapping[str, Model] = {
    BARS_AND_HINGES: Model(discretize, ModelOptions, MASS_RULES, "bars and hinges"),
    SHELL: Model(shell, ShellOptions, MASSES, "a shell"),
}


def remodeled(
    document: Mapping[str, Any], model: str | None, divisions: int | None
) -> dict[str, Any]:
    """Case file for another model, or a shell of other divisions.

    What means nothing to the other model is left out: keys of [model] that it does not have, the
    mass rules, and for a shell explicit methods with their steps, and secant amplitudes.

    Parameters
    ----------
    document : mapping
        What the file says; the sections that change are valid, or left for its check.
    model : {"bars_and_hinges", "shell"}, optional
    divisions : int, optional
        Pieces of every edge of a shell.
    """
    changed = dict(document)
    given = document.get("model", {})
    if not isinstance(given, Mapping):
        return changed
    now = given.get("kind", BARS_AND_HINGES)
    kind = now if model is None else choice("model", model, MODELS)
    if kind != now:
        shared = set(MODELS[kind].keys) - {"mass"}
        given = {key: value for key, value in given.items() if key in shared}
    if kind != now and kind == SHELL:
        changed["analysis"] = _of_a_shell(document["analysis"])
    told = {} if divisions is None else {"divisions": divisions}
    changed["model"] = {**given, "kind": kind, **told}
    return changed


def _of_a_shell(analysis: Mapping[str, Any]) -> dict[str, Any]:
    """The table [analysis] without what means nothing to a shell."""
    left = {"secant"}
    key = "method" if analysis["kind"] == "dynamics" else "integrator"
    if analysis.get(key, "rk4") not in ("auto", *MASSLESS_METHODS):
        left |= {key, "dt", "force"}
    return {key: value for key, value in analysis.items() if key not in left}
