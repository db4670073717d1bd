# Public names and where they live; loaded when they are first used (facade.py)

from foldyn.cases.air import Air as Air
from foldyn.cases.case import Case as Case
from foldyn.cases.connectors import Dashpot as Dashpot
from foldyn.cases.contact import Contact as Contact, Plane as Plane
from foldyn.cases.damping import (
    CreaseDamping as CreaseDamping,
    ModalDamping as ModalDamping,
    Rayleigh as Rayleigh,
    StrainDamping as StrainDamping,
)
from foldyn.cases.histories import (
    HISTORIES as HISTORIES,
    Chirp as Chirp,
    HalfSine as HalfSine,
    Harmonic as Harmonic,
    Pulse as Pulse,
    Ramp as Ramp,
    Step as Step,
    Table as Table,
)
from foldyn.cases.history import (
    Constant as Constant,
    Function as Function,
    History as History,
    as_history as as_history,
)
from foldyn.cases.latches import Latch as Latch
from foldyn.cases.load import Load as Load
from foldyn.cases.loads import (
    LOADS as LOADS,
    Actuate as Actuate,
    Force as Force,
    Gravity as Gravity,
)
from foldyn.cases.masses import PointMass as PointMass
from foldyn.cases.region_loads import (
    CreaseMoment as CreaseMoment,
    LineLoad as LineLoad,
    Pressure as Pressure,
    Temperature as Temperature,
    TotalForce as TotalForce,
)
from foldyn.cases.selection import resolve_nodes as resolve_nodes
from foldyn.cases.springs import Bar as Bar, Cable as Cable, Spring as Spring
from foldyn.cases.state import Continuation as Continuation, Origin as Origin, State as State
from foldyn.cases.stops import Stop as Stop
from foldyn.cases.supports import (
    SUPPORTS as SUPPORTS,
    BaseMotion as BaseMotion,
    Fix as Fix,
    Impose as Impose,
    Link as Link,
)
from foldyn.patterns.selection import select as select

__all__: list[str]
