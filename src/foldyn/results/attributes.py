"""Attributes of results: the common ones, and facts about the computation."""

from __future__ import annotations

from collections.abc import Mapping
from numbers import Integral, Real
from typing import Any

import numpy as np

from foldyn import __version__

FORMAT = 2
"""Version number of the layout of results. Files with another number are refused."""

OWN = ("foldyn_result", "foldyn_format", "foldyn_version", "rerunnable", "not_rerunnable_because")


def own_attributes(kind: str, obstacles: tuple[str, ...]) -> dict[str, Any]:
    """Attributes that every result has."""
    reason = {"not_rerunnable_because": "; ".join(obstacles)} if obstacles else {}
    return {
        "foldyn_result": kind,
        "foldyn_format": FORMAT,
        "foldyn_version": __version__,
        "rerunnable": 0 if obstacles else 1,
        **reason,
    }


def facts(statistics: Mapping[str, Any]) -> dict[str, Any]:
    """Convert statistics to NetCDF attributes, which are numbers, text and lists of numbers."""
    attributes: dict[str, Any] = {}
    for name, value in statistics.items():
        if name in OWN:
            raise ValueError(f"statistics: {name} is an attribute of every result")
        if value is None:
            continue
        if isinstance(value, bool | np.bool_ | Integral):
            attributes[name] = int(value)
        elif isinstance(value, Real):
            attributes[name] = float(value)
        elif isinstance(value, list | tuple | np.ndarray):
            attributes[name] = np.asarray(value)
        else:
            attributes[name] = str(value)
    return attributes
