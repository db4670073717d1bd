"""The built-in laws by name, and how a name or an object becomes a law."""

from __future__ import annotations

from collections.abc import Mapping

from foldyn.errors import InputError
from foldyn.materials.enhanced_linear import EnhancedLinear
from foldyn.materials.law import BarLaw, HingeLaw
from foldyn.materials.linear import LinearBar, LinearHinge
from foldyn.materials.ogden import Ogden
from foldyn.materials.superlinear import Superlinear

BAR_LAWS: Mapping[str, type[BarLaw]] = {"ogden": Ogden, "linear": LinearBar}
HINGE_LAWS: Mapping[str, type[HingeLaw]] = {
    "linear": LinearHinge,
    "superlinear": Superlinear,
    "enhanced": EnhancedLinear,
}


def bar_law(spec: str | BarLaw) -> BarLaw:
    """Law of a bar from its name ("ogden", "linear") or a law object."""
    if isinstance(spec, BarLaw):
        return spec
    if isinstance(spec, str) and spec in BAR_LAWS:
        return BAR_LAWS[spec]()
    raise InputError(
        f"bar_law = {spec!r}: choose one of {', '.join(BAR_LAWS)} or give a BarLaw object"
    )


def hinge_law(spec: str | HingeLaw, field: str = "hinge law") -> HingeLaw:
    """Law of a hinge from its name ("linear", "superlinear", "enhanced") or a law object."""
    if isinstance(spec, HingeLaw):
        return spec
    if isinstance(spec, str) and spec in HINGE_LAWS:
        return HINGE_LAWS[spec]()
    raise InputError(
        f"{field} = {spec!r}: choose one of {', '.join(HINGE_LAWS)} or give a HingeLaw object"
    )
