"""Values of a paper beside what was computed: the rows of a study's `targets.toml`."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Target:
    """A value that a paper gives.

    Attributes
    ----------
    key : str
    value : float
    unit : str
    source : str
        Section, table or figure.
    what : str
    tolerance : float or None
        Largest deviation, as a fraction of the value, with which the computed value agrees; None
        where the two are only shown beside each other.
    """

    key: str
    value: float
    unit: str
    source: str
    what: str
    tolerance: float | None = None


@dataclass(frozen=True)
class Verdict:
    """A target with the computed value (nan where there is none)."""

    target: Target
    computed: float

    @property
    def deviation(self) -> float:
        """Computed over given, less one."""
        return self.computed / self.target.value - 1.0

    @property
    def holds(self) -> bool | None:
        """Whether they agree; None where no tolerance is set."""
        if self.target.tolerance is None:
            return None
        return math.isfinite(self.computed) and abs(self.deviation) <= self.target.tolerance

    def line(self) -> str:
        """One line for people."""
        told = {True: "holds", False: "fails", None: "beside"}[self.holds]
        return (
            f"{self.target.what}: {self.computed:.4g} {self.target.unit} beside "
            f"{self.target.value:.4g} ({self.target.source}), {self.deviation:+.1%}: {told}"
        )


def read_targets(path: Path) -> Mapping[str, Target]:
    """Targets of a file by their keys, one table each."""
    tables = tomllib.loads(path.read_text())
    return {key: Target(key=key, **table) for key, table in tables.items()}


def verdicts(targets: Mapping[str, Target], computed: Mapping[str, float]) -> list[Verdict]:
    """Every target with its computed value, in the order of the targets."""
    return [Verdict(t, computed.get(key, math.nan)) for key, t in targets.items()]
