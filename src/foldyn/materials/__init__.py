"""Scalar laws: stress of a bar, moment of a hinge, their slopes and energies."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import foldyn.jit
import foldyn.materials.switch  # noqa: F401 - gives laws their functions
from foldyn.errors import InputError
from foldyn.materials.custom import CustomBarLaw, CustomHingeLaw
from foldyn.materials.enhanced_linear import EnhancedLinear
from foldyn.materials.law import BarLaw, HingeLaw
from foldyn.materials.linear import LinearBar, LinearHinge
from foldyn.materials.ogden import Ogden
from foldyn.materials.plate_superlinear import PlateSuperlinear
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
    "PlateSuperlinear",
    "Superlinear",
    "bar_law",
    "hinge_law",
]

BAR_LAWS: Mapping[str, type[BarLaw]] = {"ogden": Ogden, "linear": LinearBar}
HINGE_LAWS: Mapping[str, type[HingeLaw]] = {
    "linear": LinearHinge,
    "superlinear": Superlinear,
    "enhanced": EnhancedLinear,
    "plate_superlinear": PlateSuperlinear,
}


def bar_law(spec: str | BarLaw) -> BarLaw:
    """Law of a bar from its name ("ogden", "linear") or a law object."""
    return _law(spec, BAR_LAWS, BarLaw, "bar_law")


def hinge_law(spec: str | HingeLaw, field: str = "hinge law") -> HingeLaw:
    """Law of a hinge from its name, one of `HINGE_LAWS`, or a law object."""
    return _law(spec, HINGE_LAWS, HingeLaw, field)


def _law(spec: Any, laws: Mapping[str, Any], base: type[BarLaw | HingeLaw], field: str) -> Any:
    if isinstance(spec, str) and spec in laws:
        spec = laws[spec]()
    if not isinstance(spec, base):
        raise InputError(
            f" = {spec!r}: choose one of {', '.join(laws)} or give a {base.__name__} object", field
        )
    spec.check(field)
    return spec
