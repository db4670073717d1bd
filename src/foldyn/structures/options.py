"""The choices that turn a pattern into a structure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from foldyn.errors import InputError
from foldyn.materials import BarLaw, EnhancedLinear, HingeLaw

SCHEMES = ("n5b8", "n4b5")
CALIBRATIONS = ("standard", "merlin2")


@dataclass(frozen=True)
class ModelOptions:
    """Arguments of `discretize` beside pattern and sheet; see there."""

    scheme: Literal["n5b8", "n4b5"] = "n5b8"
    mass: str = "mixed_voronoi"
    bar_law: str | BarLaw = "ogden"
    fold_law: str | HingeLaw = EnhancedLinear()
    bend_law: str | HingeLaw = "superlinear"
    calibration: Literal["standard", "merlin2"] = "standard"
    crease_stiffness: float | Sequence[float] | None = None
    crease_rest: float | Sequence[float] | None = None

    def __post_init__(self) -> None:
        for field in ("crease_stiffness", "crease_rest"):
            value = getattr(self, field)
            if isinstance(value, bool):
                raise InputError(f"{field} = {value}: give a number, or one for each crease")
            if isinstance(value, list) or (isinstance(value, np.ndarray) and value.ndim):
                object.__setattr__(self, field, tuple(value))  # a copy that stays as it is
        for field, known in (("scheme", SCHEMES), ("calibration", CALIBRATIONS)):
            value = getattr(self, field)
            if value not in known:
                raise InputError(f"{field} = {value!r}: choose one of {', '.join(known)}")
