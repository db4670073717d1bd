"""Cases: supports, loads, histories, damping, states."""

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

__all__ = [
    "HISTORIES",
    "Actuate",
    "BaseMotion",
    "Case",
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
    "resolve_nodes",
    "select",
]
