"""Computations of the study of waves, each kept in its own file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np
import xarray

from foldyn.input_files import file_digest
from foldyn.results.netcdf import read, write
from foldyn.store import program
from foldyn.studies.pool import Done, Task, datasets, run
from verification.waves import kresling, sheets

RESULTS = "runs"
COMPUTING = tuple(Path(__file__).with_name(f"{name}.py") for name in ("kresling", "sheets"))


@dataclass(frozen=True)
class Plan:
    """Resolution of the computations.

    Attributes
    ----------
    dihedrals : int
        Fold states of each sheet, from 20 to 170 degrees.
    phases : int
        Number of phases along the edge of the zone of a sheet, and of the chain.
    cells : int
        Number of cells of the chain.
    velocity : float
        Initial velocity of the first plate (m/s).
    """

    dihedrals: int = 31
    phases: int = 81
    cells: int = 80
    velocity: float = 0.8
    unit: kresling.Unit = field(default_factory=kresling.Unit)

    @property
    def duration(self) -> float:
        """Duration of a motion (s): until slow waves have nearly reached the end."""
        slow = kresling.long_waves(self.unit.cell).speeds[0]
        return float(round(0.9 * self.cells / slow, 2))


FULL = Plan()
QUICK = Plan(dihedrals=7, phases=31, cells=60)


@dataclass(frozen=True)
class Part(Task):
    """One computation: bands of a sheet or of the chain, or the chain's impact."""

    kind: Literal["miura", "eggbox", "dispersion", "impact", "small_impact"]
    plan: Plan
    store = datasets(partial(read, unreadable="the study"), write)

    @property
    def name(self) -> str:
        """Name of the computation."""
        return self.kind

    def settings(self) -> dict[str, Any]:
        """Everything that its result depends on."""
        sources = [program(), *map(file_digest, COMPUTING)]
        return {"kind": self.kind, "program": sources, **asdict(self.plan)}

    def compute(self, folder: Path) -> xarray.Dataset:
        """Compute its result."""
        plan = self.plan
        if self.kind in sheets.PATTERNS:
            return sheets.fold_states(
                self.kind, np.linspace(20.0, 170.0, plan.dihedrals).tolist(), plan.phases
            )
        if self.kind == "dispersion":
            return kresling.dispersion(plan.unit, plan.phases)
        velocity = plan.velocity * (1.0 if self.kind == "impact" else 1e-3)
        return kresling.impact(plan.unit, plan.cells, velocity, plan.duration)


KINDS = ("impact", "small_impact", "miura", "eggbox", "dispersion")


@dataclass(frozen=True)
class Study:
    """Results of a plan in a folder.

    Attributes
    ----------
    plan : Plan
    folder : Path
        Folder of the study; results are in its folder `runs`.
    """

    plan: Plan
    folder: Path

    @property
    def count(self) -> int:
        """Number of computations."""
        return len(KINDS)

    def compute(
        self, tell: Callable[[Done], None] = lambda done: None, processes: int = 2
    ) -> list[Done]:
        """Compute missing results; see `foldyn.studies.pool.run`."""
        results = self.folder / RESULTS
        results.mkdir(parents=True, exist_ok=True)
        return run([Part(kind, self.plan) for kind in KINDS], results, tell, processes)

    def result(self, kind: Any) -> xarray.Dataset | None:
        """Result of a computation, or None if missing."""
        return Part(kind, self.plan).result(self.folder / RESULTS)
