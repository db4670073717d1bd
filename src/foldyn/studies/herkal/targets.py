"""Values and claims of the paper, with computed values: the rows of `targets.toml`."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Literal


@dataclass(frozen=True)
class Target:
    """A value in the paper, or a bound that expresses one of its claims as a number.

    Attributes
    ----------
    key : str
    value : float
    unit : str
    source : str
        Section, table or figure.
    what : str
    tolerance : float or None
        Largest deviation, relative to the value, that counts as agreement; None if given and
        computed value are only shown side by side.
    bound : {"least", "most"} or None
        For a claim: it holds if the computed value is at least, or at most, `value`.
    group : str
        Part of the study that computes the value.
    """

    key: str
    value: float
    unit: str
    source: str
    what: str
    tolerance: float | None = None
    bound: Literal["least", "most"] | None = None
    group: str = ""


@dataclass(frozen=True)
class Verdict:
    """A target with the computed value (nan if missing)."""

    target: Target
    computed: float

    @property
    def deviation(self) -> float:
        """Computed value divided by given value, minus one."""
        return self.computed / self.target.value - 1.0

    @property
    def holds(self) -> bool | None:
        """Whether both values agree; None if neither tolerance nor bound is set."""
        if self.target.bound == "least":
            return self.computed >= self.target.value
        if self.target.bound == "most":
            return self.computed <= self.target.value
        if self.target.tolerance is None:
            return None
        return math.isfinite(self.computed) and abs(self.deviation) <= self.target.tolerance

    @property
    def word(self) -> str:
        """Agreement in a word."""
        return {True: "holds", False: "fails", None: "beside"}[self.holds]

    @property
    def asked(self) -> str:
        """Text of the target's value; for a claim, written as a bound."""
        before = {"least": "at least ", "most": "at most ", None: ""}[self.target.bound]
        return f"{before}{self.target.value:.4g}"


@cache
def read_targets(group: str) -> Mapping[str, Target]:
    """Targets of a group by key: "specimen", "table1" or "claims"."""
    tables = tomllib.loads(Path(__file__).with_name("targets.toml").read_text("utf-8"))
    targets = {key: Target(key=key, **table) for key, table in tables.items()}
    return {key: target for key, target in targets.items() if target.group == group}


def verdicts(group: str, computed: Mapping[str, float]) -> list[Verdict]:
    """Every target of a group with its computed value, in their order."""
    return [Verdict(t, computed.get(key, math.nan)) for key, t in read_targets(group).items()]
