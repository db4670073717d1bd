"""Laws by name, and what joins them with their compiled formulas."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING
from typing import Any

from foldyn.arguments import arguments
from foldyn.errors import InputError
from foldyn.materials import switch
from foldyn.materials.branch_switch import MEMORY_LAWS
from foldyn.materials.inelastic_law import MemoryLaw
from foldyn.materials.law import BarLaw, HingeLaw

BarLaw.compiled, BarLaw.known = staticmethod(switch.bar_table), switch.BARS
HingeLaw.compiled, HingeLaw.known = staticmethod(switch.hinge_table), switch.HINGES
HingeLaw.slopes = staticmethod(switch.hinge_slopes)

BAR_LAWS: Mapping[str, type[BarLaw]] = {law.name: law for law in switch.BAR_LAWS}
HINGE_LAWS: Mapping[str, type[HingeLaw]] = {
    law.name: law for law in (*switch.HINGE_LAWS, *MEMORY_LAWS)
}


def bar_law(spec: str | BarLaw, field: str = "bar_law") -> BarLaw:
    """Law of a bar from its name ("ogden", "linear") or a law object."""
    return _law(spec, BAR_LAWS, BarLaw, field)


def hinge_law(spec: str | HingeLaw, field: str = "hinge law") -> HingeLaw:
    """Law of a hinge from its name in `HINGE_LAWS`, or a law object."""
    return _law(spec, HINGE_LAWS, HingeLaw, field)


def _law(spec: Any, laws: Mapping[str, Any], base: type[BarLaw | HingeLaw], field: str) -> Any:
    if isinstance(spec, str) and spec in laws:
        kind = laws[spec]
        missing = [name for name, own in arguments(kind).items() if own.default is MISSING]
        if missing:
            raise InputError(
                f' = "{spec}": the law needs {" and ".join(missing)}; give a '
                f"{kind.__name__}({missing[0]}=...), or a table with kind and {missing[0]}",
                field,
            )
        spec = kind()
    if not isinstance(spec, base):
        raise InputError(
            f" = {spec!r}: choose one of {', '.join(laws)} or give a {base.__name__} object", field
        )
    spec.check(field)
    return spec


MemoryLaw.lookup = staticmethod(hinge_law)
