"""Foldyn: statics and dynamics of origami structures.

From a crease pattern to a validated motion: bars and hinges with the stiffness of MERLIN2, the
mass by one of several rules, and the integration of M x'' + C x' + F_int(x) = p(t).

>>> import foldyn as fd
>>> pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=60)
>>> len(pattern.vertices), len(pattern.faces)
(9, 4)
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

# Public names and where they live; loaded when first used, so that `import foldyn` is quick.
_HOME = {
    "Pattern": "patterns",
    "read_pattern": "formats",
    "write_pattern": "formats",
    "BarLaw": "materials",
    "CustomBarLaw": "materials",
    "CustomHingeLaw": "materials",
    "EnhancedLinear": "materials",
    "HingeLaw": "materials",
    "Sheet": "structures",
    "Structure": "structures",
    "discretize": "structures",
    "shell": "shells",
    "Shell": "shells",
    "Case": "cases",
    "Fix": "cases",
    "Impose": "cases",
    "BaseMotion": "cases",
    "Force": "cases",
    "Function": "cases",
    "Gravity": "cases",
    "Actuate": "cases",
    "Rayleigh": "cases",
    "State": "cases",
    "Constant": "cases",
    "Pulse": "cases",
    "HalfSine": "cases",
    "Ramp": "cases",
    "Step": "cases",
    "Harmonic": "cases",
    "Chirp": "cases",
    "Table": "cases",
    "read_case": "analyses",
    "save": "results",
    "load": "results",
    "case_of": "results",
    "Quantity": "results",
    "trace": "statics",
    "switch_branch": "statics",
    "modes": "linear",
    "mac": "linear",
    "frf": "linear",
    "landscape": "statics",
    "simulate": "dynamics",
    "critical_step": "dynamics",
    "initial_state": "dynamics",
    "fit": "experiment",
}
_MODULES = (
    "analyses", "cases", "checks", "dynamics", "errors", "experiment", "formats", "linear",
    "materials", "mechanics", "patterns", "plots", "report", "results", "shells", "signals",
    "statics", "structures", "studies",
)  # fmt: skip

if TYPE_CHECKING:
    from foldyn.analyses import read_case
    from foldyn.cases import (
        Actuate,
        BaseMotion,
        Case,
        Chirp,
        Constant,
        Fix,
        Force,
        Function,
        Gravity,
        HalfSine,
        Harmonic,
        Impose,
        Pulse,
        Ramp,
        Rayleigh,
        State,
        Step,
        Table,
    )
    from foldyn.dynamics import critical_step, initial_state, simulate
    from foldyn.experiment import fit
    from foldyn.formats import read_pattern, write_pattern
    from foldyn.linear import frf, mac, modes
    from foldyn.materials import BarLaw, CustomBarLaw, CustomHingeLaw, EnhancedLinear, HingeLaw
    from foldyn.patterns import Pattern
    from foldyn.results import Quantity, case_of, load, save
    from foldyn.shells import Shell, shell
    from foldyn.statics import landscape, switch_branch, trace
    from foldyn.structures import Sheet, Structure, discretize

__all__ = sorted((*_HOME, *_MODULES, "__version__"))  # pyright: ignore


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(f"foldyn.{_HOME[name]}"), name)
    if name in _MODULES:
        return import_module(f"foldyn.{name}")
    raise AttributeError(f"module 'foldyn' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
