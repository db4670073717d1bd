"""Results of the large motions as a CSV table, one row per run and model, with summaries."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from verification.fidelity.cases import documented
from verification.fidelity.compare import ALIKE, NEAR, RESULTS, markdown

STORED = RESULTS / "motions.csv"
SHELL = "shell"
PLATE, FINER = "plate, linear", "n5b8e, linear"
RECOMMENDED = "n5b8e, linear; of triangles plate, linear"  # n5b8e has no inner node in triangles
PULSE = "pulse"
SHARE = 0.5  # least share of the shell's variance in its fundamental for a period to be reported
SCATTER = 0.1  # largest standard deviation of the shell's periods, relative to their mean
FEWEST = 3  # cycles
SIZES = {5.0: "to 5 degrees", 20.0: "to 20 degrees", 50.0: "to 50 degrees"}
HEADS = ("case", "start", "model", "mesh", "share", "periods [s]", "mac", "note")


class Run(NamedTuple):
    """A motion by a model.

    Attributes
    ----------
    case, start, model : str
        The start is an amplitude in degrees, or "pulse".
    mesh : float
        Frequency of the shell's mesh over the extrapolated one, for small vibrations.
    share : float
        The fundamental's share of the coordinate's variance.
    period : tuple of float
        Period of each cycle, s.
    alike : tuple of float
        MAC with the shell at the extremes of the fundamental, two in a cycle.
    note : str
        Reason if there are no cycles.
    """

    case: str
    start: str
    model: str
    mesh: float
    share: float = float("nan")
    period: tuple[float, ...] = ()
    alike: tuple[float, ...] = ()
    note: str = ""


class Beside(NamedTuple):
    """A model's motion compared with the shell's.

    Attributes
    ----------
    case, start : str
    error : float
        Error of the mean period over the common cycles; infinite without any.
    largest : float
        The largest magnitude of the error of a single cycle's period.
    mac : float
        Median over the extremes; 0 without any.
    """

    case: str
    start: str
    error: float
    largest: float
    mac: float


def write(found: Iterable[Run], path: Path) -> None:
    """Write a table."""
    with path.open("w", encoding="utf-8", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(HEADS)
        for run in found:
            periods = " ".join(f"{value:.5g}" for value in run.period)
            alike = " ".join(f"{value:.3f}" for value in run.alike)
            numbers = [f"{run.mesh:.4f}", f"{run.share:.3f}", periods, alike]
            out.writerow([run.case, run.start, run.model, *numbers, run.note])


def read(path: Path = STORED) -> list[Run]:
    """A table that `write` wrote."""
    with path.open(encoding="utf-8", newline="") as file:
        lines = list(csv.DictReader(file))
    return [
        Run(
            line["case"], line["start"], line["model"], float(line["mesh"]), float(line["share"]),
            _numbers(line["periods [s]"]), _numbers(line["mac"]), line["note"],
        )
        for line in lines
    ]  # fmt: skip


def _numbers(text: str) -> tuple[float, ...]:
    return tuple(float(word) for word in text.split())


def told(run: Run) -> bool:
    """Whether a run of the shell has a period to report."""
    period = np.array(run.period)
    if len(period) < FEWEST:
        return False
    return run.share >= SHARE and bool(period.std() <= SCATTER * period.mean())


def grouped(found: Iterable[Run]) -> dict[tuple[str, str], dict[str, Run]]:
    """Runs of each start, by model."""
    starts: dict[tuple[str, str], dict[str, Run]] = {}
    for run in found:
        starts.setdefault((run.case, run.start), {})[run.model] = run
    return starts


def beside(true: Run, own: Run) -> Beside:
    """Compare a model's run with the shell's periods, corrected for the error of the mesh."""
    count = min(len(true.period), len(own.period))
    if not count:
        return Beside(true.case, true.start, np.inf, np.inf, 0.0)
    right = np.array(true.period[:count]) * true.mesh
    now = np.array(own.period[:count])
    return Beside(
        true.case, true.start, float(now.sum() / right.sum() - 1.0),
        float(np.abs(now / right - 1.0).max()), float(np.median(own.alike)),
    )  # fmt: skip


def compared(found: Iterable[Run]) -> dict[str, list[Beside]]:
    """Every model, and `RECOMMENDED`, compared with runs of the shell that have a period."""
    models: dict[str, list[Beside]] = {}
    triangles = _of_triangles()
    for (case, _), every in grouped(found).items():
        if told(every[SHELL]):
            rows = {m: beside(every[SHELL], own) for m, own in every.items() if m != SHELL}
            if {FINER, PLATE} <= rows.keys():
                rows[RECOMMENDED] = rows[PLATE if case in triangles else FINER]
            for model, row in rows.items():
                models.setdefault(model, []).append(row)
    return models


def _of_triangles() -> set[str]:
    """Names of documented cases with triangular panels."""
    faces = {case.name: case.pattern().faces for case in documented()}
    return {name for name, panels in faces.items() if all(len(panel) == 3 for panel in panels)}


def untold(found: Iterable[Run]) -> list[Run]:
    """Runs of the shell without a period to report."""
    return [every[SHELL] for every in grouped(found).values() if not told(every[SHELL])]


def size(start: str) -> str:
    """Rows of the table by amplitude that a start belongs to."""
    if start == PULSE:
        return "the paper's pulses"
    return next(name for bound, name in SIZES.items() if float(start) <= bound)


def summaries(found: list[Run]) -> str:
    """Errors by model and amplitude, in Markdown."""
    models = compared(found)
    starts = dict.fromkeys(size(b.start) for b in next(iter(models.values()), []))
    rows = []
    for chosen in [*starts, "all"]:
        for model, every in models.items():
            kept = [b for b in every if chosen in (size(b.start), "all")]
            rows.append([chosen, model, *_summary(kept)])
    heads = ["start", "model", "runs", "period within 5 %", "median error", "90th percentile"]
    return markdown([*heads, "median MAC", "MAC above 0.95"], rows)


def _summary(rows: list[Beside]) -> list[str]:
    error = np.abs([b.error for b in rows])
    alike = np.array([b.mac for b in rows])
    median, ninetieth = np.percentile(error, [50, 90], method="higher")
    shares = [100 * (error < NEAR).mean(), 100 * median, 100 * ninetieth]
    near, middle, most = (f"{value:.3g} %" for value in shares)
    good = f"{100 * (alike > ALIKE).mean():.0f} %"
    return [str(len(rows)), near, middle, most, f"{np.median(alike):.3f}", good]
