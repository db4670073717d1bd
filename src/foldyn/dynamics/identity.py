"""All that decides what a motion is, by name: to go on with it only as it was begun."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from foldyn import __version__
from foldyn.cases import Case
from foldyn.cases.document import to_document
from foldyn.dynamics.course import StepPlan
from foldyn.program import program


def identity(
    case: Case, method: Any, plan: StepPlan, state: Iterable[Any], sampled: Iterable[str],
) -> dict[str, Any]:  # fmt: skip
    """Numbers and texts by name, of a case file's keys where it has them.

    Functions of the user's count by their places alone: their text is not known.

    Parameters
    ----------
    case : Case
    method : Integrator
    plan : StepPlan
    state : iterable
        What the motion starts from.
    sampled : iterable of str
        Names of what the user samples.
    """
    document = to_document(case)
    options = getattr(method.scheme, "keywords", {})
    return {
        **_flat(document.sections),
        **{name: _digest(array) for name, array in document.arrays.items()},
        "method": method.name,
        "spectral_radius": options.get("facts", {}).get("spectral_radius"),
        "start": plan.start,
        "duration": plan.end - plan.start,
        "every": plan.every or plan.interval,
        "dt": plan.dt,
        "tolerance": plan.tolerance,
        "initial": [one if isinstance(one, str) else _digest(one) for one in state],
        "sample": list(sampled),
        "the version of Foldyn": f"{__version__} ({program('results')})",
    }


def key_of(about: Mapping[str, Any]) -> str:
    """Digest of an identity, "1f0c6a2b9d3e4f58"."""
    text = json.dumps(about, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _flat(table: Mapping[str, Any], place: str = "") -> dict[str, Any]:
    """Values of tables within tables, by their keys with dots."""
    found: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, Mapping):
            found |= _flat(value, f"{place}{key}.")
        elif isinstance(value, list) and value and all(isinstance(one, Mapping) for one in value):
            for k, one in enumerate(value):
                found |= _flat(one, f"{place}{key}[{k}].")
        else:
            found[f"{place}{key}"] = value
    return found


def _digest(array: Any) -> str | None:
    """Digest of the numbers of an array; None of none."""
    if array is None:
        return None
    values = np.ascontiguousarray(array)
    text = f"{values.dtype}{values.shape}".encode()
    return hashlib.sha256(text + values.tobytes()).hexdigest()[:16]
