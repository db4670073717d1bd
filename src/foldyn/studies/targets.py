"""Values and claims of a paper, with computed values: the rows of a study's `targets.toml`."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from foldyn.errors import InputError


@dataclass(frozen=True)
class Target:
    """A value in a paper, or a bound that expresses one of its claims as a number.

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

    def __post_init__(self) -> None:
        """Check that the target is either a value or a bound."""
        if self.bound not in (None, "least", "most"):
            raise InputError(f'{self.key}: bound = {self.bound!r}: give "least" or "most"')
        if self.bound is not None and self.tolerance is not None:
            raise InputError(f"{self.key}: a bound has no tolerance; leave out one of the two")


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

    def line(self) -> str:
        """One line of text."""
        return (
            f"{self.target.what}: {self.computed:.4g} {self.target.unit} beside "
            f"{self.asked} ({self.target.source}), {self.deviation:+.1%}: {self.word}"
        )

    @property
    def word(self) -> str:
        """Agreement in a word."""
        return {True: "holds", False: "fails", None: "beside"}[self.holds]

    @property
    def asked(self) -> str:
        """Text of the target's value; for a claim, written as a bound."""
        before = {"least": "at least ", "most": "at most ", None: ""}[self.target.bound]
        return f"{before}{self.target.value:.4g}"


def read_targets(path: Path, group: str | None = None) -> Mapping[str, Target]:
    """Targets of a file by key, one for each table; only those of a group if it is given."""
    tables = tomllib.loads(path.read_text("utf-8"))
    targets = {key: Target(key=key, **table) for key, table in tables.items()}
    return {k: t for k, t in targets.items() if group is None or t.group == group}


def verdicts(targets: Mapping[str, Target], computed: Mapping[str, float]) -> list[Verdict]:
    """Every target with its computed value, in the order of the targets."""
    return [Verdict(t, computed.get(key, math.nan)) for key, t in targets.items()]
