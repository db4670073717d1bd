"""What `foldyn run` needs to know of a computation, whatever its kind."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    import xarray

# where the case file has what the functions that it calls complain about
KEYS = {
    "model": ("fold_law",),
    "analysis": (
        "duration", "method", "dt", "tolerance", "spectral_radius", "load_factors", "steps",
        "first_step", "constant", "inertia_relief", "count", "secant", "frequencies", "amplitude",
    ),
    "output": ("every",),
}  # fmt: skip


class Run(Protocol):
    """One computation of a case file, checked as far as that is possible before it starts.

    Attributes
    ----------
    file : str
        Name of its result file.
    place : str
        Beginning of messages about it.
    """

    file: str
    place: str

    def compute(self, progress: bool, begun: Callable[[], None]) -> xarray.Dataset:
        """Compute it; `begun` is called when nothing is left to be refused."""
        ...

    def line(self, result: xarray.Dataset) -> str:
        """What is said of it when it is done."""
        ...


class Task(Protocol):
    """All computations of a case file.

    Attributes
    ----------
    runs : mapping of str to Run
        By the name that the report has for them.
    """

    runs: Mapping[str, Run]

    def compiles(self) -> bool:
        """Whether kernels have to be compiled first."""
        ...

    def write(self, results: Mapping[str, xarray.Dataset], folder: Path) -> Path:
        """Draw the figures and write the page; returns its path."""
        ...


def with_key(message: str) -> str:
    """Put the section's name before a message that begins with the name of a key."""
    found = re.match(r"\w+", message)
    for section, keys in KEYS.items():
        if found and found[0] in keys:
            return f"{section}.{message}"
    return message
