"""Results of the study as CSV tables, one row per mode, with summaries."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from foldyn.linear.reference import Reference
from foldyn.studies.fidelity.cases import FidelityCase
from foldyn.studies.fidelity.compare import MODELS, Row, compare

RESULTS = Path(__file__).parent / "results"
NEAR, ALIKE = 0.05, 0.95  # largest error and least MAC of a good mode


class Modes(NamedTuple):
    """Modes of a case by model; all models have the same modes in the same order."""

    case: str
    rows: Mapping[str, list[Row]]


class Summary(NamedTuple):
    """Errors of a model over a set, fractions. A mode without a partner has an infinite error."""

    modes: int
    median: float
    ninetieth: float
    near: float  # share of modes within 5 %
    alike: float  # share of modes with a MAC above 0.95
    lost: int  # modes without a partner


def modes_below(case: FidelityCase, true: Reference) -> Modes:
    """Modes of a case below the limit by every model, compared with the shell's."""
    return Modes(case.name, {model: compare(case, true, model) for model in MODELS})


def write(path: Path, results: Sequence[Modes]) -> None:
    """Write a table: case, mode, frequency (Hz), frequency relative to the plate's, errors, MAC."""
    heads = [f"{what}: {model}" for model in results[0].rows for what in ("error", "mac")]
    with path.open("w", encoding="utf-8", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["case", "mode", "shell [Hz]", "over plate", *heads])
        for modes in results:
            for every in zip(*modes.rows.values(), strict=True):
                own = [f"{value:.4f}" for row in every for value in (row.error, row.mac)]
                first = every[0]
                frequency = [f"{first.shell:.6g}", f"{first.over_plate:.4f}"]
                out.writerow([modes.case, first.mode, *frequency, *own])


def read(path: Path) -> list[Modes]:
    """Read a table that `write` wrote; cases without any mode are missing."""
    found: dict[str, Modes] = {}
    with path.open(encoding="utf-8", newline="") as file:
        lines = csv.DictReader(file)
        heads = [head.partition(": ") for head in lines.fieldnames or ()]
        models = [model for what, _, model in heads if what == "error"]
        for line in lines:
            modes = found.setdefault(line["case"], Modes(line["case"], {m: [] for m in models}))
            for model in models:
                error, mac = float(line[f"error: {model}"]), float(line[f"mac: {model}"])
                shell, over_plate = float(line["shell [Hz]"]), float(line["over plate"])
                modes.rows[model].append(Row(int(line["mode"]), shell, over_plate, error, mac))
    return list(found.values())


def summary(results: Iterable[Modes], model: str) -> Summary:
    """Errors of a model over a set."""
    return summary_of([row for modes in results for row in modes.rows[model]])


def summary_of(rows: list[Row]) -> Summary:
    """Summary of a model's errors in some modes."""
    error = np.array([np.inf if np.isnan(row.error) else abs(row.error) for row in rows])
    alike = np.array([row.mac > ALIKE for row in rows])
    median, ninetieth = np.percentile(error, [50, 90], method="higher")
    return Summary(
        len(rows), float(median), float(ninetieth), float((error < NEAR).mean()),
        float(alike.mean()), int(np.isinf(error).sum()),
    )  # fmt: skip


def table(results: list[Modes]) -> str:
    """The summaries of all models in Markdown."""
    lines = [
        "| calibration, mass | median | 90th percentile | within 5 % | MAC above 0.95 | lost |",
        "|---|---|---|---|---|---|",
    ]
    for model in MODELS:
        lines.append(f"| {model} | {columns(summary(results, model))} |")
    return "\n".join(lines)


def columns(s: Summary) -> str:
    """Median, 90th percentile, shares and lost modes as columns of a table."""
    errors = [_percent(s.median), _percent(s.ninetieth)]
    return " | ".join([*errors, f"{100 * s.near:.0f} %", f"{100 * s.alike:.0f} %", str(s.lost)])


def _percent(error: float) -> str:
    return "lost" if np.isinf(error) else f"{100 * error:.1f} %"
