"""The kernels of the usual motions, compiled before they are needed: motions of a few steps."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from typing import Any

from foldyn.cases import Case, Fix, Force, HalfSine, Rayleigh
from foldyn.dynamics.driver import simulate
from foldyn.dynamics.methods import METHODS, critical_step, suited
from foldyn.errors import FoldynWarning, InputError
from foldyn.jit.counting import counted
from foldyn.patterns import simple_fold
from foldyn.shells import Shell, shell
from foldyn.structures import PRESETS, Sheet, discretize

MODELS: tuple[str, ...] = (*PRESETS, Shell.kind)
"""Presets of bars and hinges, and the shell."""
USUAL: Mapping[str, tuple[str, ...]] = {
    "methods": ("rk4", "generalized_alpha"),
    "models": (next(iter(PRESETS)), "herkal"),
}
"""What is compiled unless something else is asked for."""
STEPS = 4
STEP = 1e-3  # s, of implicit methods


def together(methods: Iterable[str], models: Iterable[str]) -> list[tuple[str, str]]:
    """Methods and models that go together, one after the other.

    Raises
    ------
    InputError
        None do.
    """
    methods, models = list(methods), list(models)
    pairs = [(method, model) for model in models for method in methods if _go(method, model)]
    if not pairs:
        raise InputError(f"{', '.join(methods)}: do not take {', '.join(models)}")
    return pairs


def warm_up(method: str, model: str) -> int:
    """Compile what a motion of a model needs and is not kept on disk yet.

    Parameters
    ----------
    method : str
        One of `METHODS`.
    model : str
        One of `MODELS`.

    Returns
    -------
    int
        How many functions had to be compiled.

    Notes
    -----
    Functions are compiled for types of arguments: those of bars and hinges, of panels as plates, of
    dofs without mass and of shells. Contact, laws with memory and loads that follow the sheet have
    types of their own, and are compiled when they are first used.
    """
    case, chosen = _case(model), METHODS[method]
    step = STEP if chosen.implicit else 0.5 * critical_step(case, method)
    given: dict[str, Any] = {"tolerance": 1e-3} if chosen.adaptive else {"dt": step}
    with counted() as compiled, warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)
        simulate(case, STEPS * step, method, **given)
        return compiled()


def _go(method: str, model: str) -> bool:
    try:
        suited(method, _case(model))
    except InputError:
        return False
    return True


def _case(model: str) -> Case:
    """A small sheet of a model that is clamped, pushed and damped."""
    pattern = simple_fold(a=1.0, b=1.0, dihedral=60.0)
    sheet = Sheet(1e6, 0.25, 0.01, 1.0)
    if model == Shell.kind:
        structure: Any = shell(pattern, sheet, 2)
    else:
        options: dict[str, Any] = {"preset": model}
        structure = discretize(pattern, sheet, **options)
    push = Force([4, 5], (0.0, 0.0, 1e-3), HalfSine(0.1))
    return Case(structure, [Fix([0, 1], "xyz")], [push], Rayleigh(0.1))
