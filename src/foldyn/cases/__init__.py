"""Cases: supports, loads, histories, damping, states, and the case file."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from foldyn.cases.actuation import Actuate
from foldyn.cases.case import Case
from foldyn.cases.damping import Rayleigh
from foldyn.cases.function import Function, as_history
from foldyn.cases.histories import (
    HISTORIES,
    Chirp,
    Constant,
    HalfSine,
    Harmonic,
    History,
    Pulse,
    Ramp,
    Step,
    Table,
)
from foldyn.cases.loads import Force, Gravity
from foldyn.cases.selection import resolve_nodes, select
from foldyn.cases.state import State
from foldyn.cases.supports import BaseMotion, Fix, Impose

if TYPE_CHECKING:
    from foldyn.cases.casefile import CaseFile
    from foldyn.cases.reading import read_case

__all__ = [
    "HISTORIES",
    "Actuate",
    "BaseMotion",
    "Case",
    "CaseFile",
    "Chirp",
    "Constant",
    "Fix",
    "Force",
    "Function",
    "Gravity",
    "HalfSine",
    "Harmonic",
    "History",
    "Impose",
    "Pulse",
    "Ramp",
    "Rayleigh",
    "State",
    "Step",
    "Table",
    "as_history",
    "read_case",
    "resolve_nodes",
    "select",
]


_HOMES = {"CaseFile": "casefile", "read_case": "reading"}
"""What needs pydantic, which is slow to import, and is loaded when first used."""


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
