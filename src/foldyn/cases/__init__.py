"""Cases: supports, loads, histories, damping, states, and the case file."""

from __future__ import annotations

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
    from foldyn.cases.casefile import CaseFile, read_case

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


def __getattr__(name: str) -> Any:
    if name in ("CaseFile", "read_case"):  # they need pydantic, which is slow to import
        from foldyn.cases import casefile

        return getattr(casefile, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
