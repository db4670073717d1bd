"""Cases: supports, links, loads, histories, damping, states."""

from foldyn.cases import histories, loads, waveforms
from foldyn.cases.air import Air
from foldyn.cases.case import Case
from foldyn.cases.connectors import Dashpot
from foldyn.cases.contact import Contact, Plane
from foldyn.cases.damping import CreaseDamping, ModalDamping, Rayleigh, StrainDamping
from foldyn.cases.histories import *  # noqa: F403 - its __all__
from foldyn.cases.history import Formula, Function, as_history
from foldyn.cases.latches import Latch
from foldyn.cases.loads import *  # noqa: F403
from foldyn.cases.masses import PointMass
from foldyn.cases.selection import resolve_nodes
from foldyn.cases.springs import Bar, Cable, Spring
from foldyn.cases.state import Continuation, Origin, State
from foldyn.cases.stops import Stop
from foldyn.cases.supports import SUPPORTS, BaseMotion, Fix, Impose, Link
from foldyn.patterns.selection import select

__all__ = [
    "SUPPORTS",
    "Air",
    "Bar",
    "BaseMotion",
    "Cable",
    "Case",
    "Contact",
    "Continuation",
    "CreaseDamping",
    "Dashpot",
    "Fix",
    "Function",
    "Impose",
    "Latch",
    "Link",
    "ModalDamping",
    "Origin",
    "Plane",
    "PointMass",
    "Rayleigh",
    "Spring",
    "State",
    "Stop",
    "StrainDamping",
    "as_history",
    "resolve_nodes",
    "select",
]
__all__ += histories.__all__
__all__ += loads.__all__

Formula.table = waveforms.table
