"""Scalar laws: stress of a bar, moment of a hinge, their slopes and energies."""

from __future__ import annotations

from collections.abc import Mapping

import foldyn.jit  # noqa: F401 - starts Numba, before anything is imported from it
from foldyn.errors import InputError
from foldyn.materials.custom import CustomBarLaw, CustomHingeLaw
from foldyn.materials.enhanced_linear import EnhancedLinear
from foldyn.materials.law import BarLaw, HingeLaw
from foldyn.materials.linear import LinearBar, LinearHinge
from foldyn.materials.ogden import Ogden
from foldyn.materials.superlinear import Superlinear

__all__ = [
    "BAR_LAWS",
    "HINGE_LAWS",
    "BarLaw",
    "CustomBarLaw",
    "CustomHingeLaw",
    "EnhancedLinear",
    "HingeLaw",
    "LinearBar",
    "LinearHinge",
    "Ogden",
    "Superlinear",
    "bar_law",
    "hinge_law",
]

BAR_LAWS: Mapping[str, type[BarLaw]] = {"ogden": Ogden, "linear": LinearBar}
HINGE_LAWS: Mapping[str, type[HingeLaw]] = {
    "linear": LinearHinge,
    "superlinear": Superlinear,
    "enhanced": EnhancedLinear,
}


def bar_law(spec: str | BarLaw) -> BarLaw:
    """Law of a bar from its name ("ogden", "linear") or a law object."""
    if isinstance(spec, str) and spec in BAR_LAWS:
        spec = BAR_LAWS[spec]()
    if not isinstance(spec, BarLaw):
        raise InputError(
            f" = {spec!r}: choose one of {', '.join(BAR_LAWS)} or give a BarLaw object", "bar_law"
        )
    spec.check("bar_law")
    return spec


def hinge_law(spec: str | HingeLaw, field: str = "hinge law") -> HingeLaw:
    """Law of a hinge from its name ("linear", "superlinear", "enhanced") or a law object."""
    if isinstance(spec, str) and spec in HINGE_LAWS:
        spec = HINGE_LAWS[spec]()
    if not isinstance(spec, HingeLaw):
        raise InputError(
            f" = {spec!r}: choose one of {', '.join(HINGE_LAWS)} or give a HingeLaw object", field
        )
    spec.check(field)
    return spec
