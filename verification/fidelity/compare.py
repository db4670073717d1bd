"""Frequencies and shapes of bars and hinges compared with the shell, and stored as CSV tables."""

from __future__ import annotations

import csv
import warnings
from collections.abc import Iterable, Mapping, Sequence
from math import nan
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from foldyn.condensation import superelements
from foldyn.errors import FoldynWarning
from foldyn.linear.reference import SPARE, Reference, Shown, matched, modes_at_rest, reference_modes
from foldyn.linear.shell_of import DIVISIONS
from foldyn.shells import shell
from foldyn.structures import discretize
from foldyn.structures.beyond_range import BELOW, plate_frequency
from foldyn.structures.discretized import Discretized
from foldyn.structures.presets import resolved
from verification.fidelity.cases import FidelityCase

# Options of `discretize`; all bends are linear. `circumcenter` is refused on many panels, and is
# `mixed_voronoi` on all others.
MODELS: Mapping[str, Mapping[str, Any]] = {
    "standard, mixed_voronoi": {"calibration": "standard", "mass": "mixed_voronoi"},
    "standard, consistent": {"calibration": "standard", "mass": "consistent"},
    "plate, consistent": {"calibration": "plate", "mass": "consistent"},
    "plate, bubble": {"calibration": "plate", "mass": "bubble"},
    "plate, mixed_voronoi": {"calibration": "plate", "mass": "mixed_voronoi"},
    "plate, inertia_exact": {"calibration": "plate", "mass": "inertia_exact"},
    "plate, consistent, n4b5": {"calibration": "plate", "mass": "consistent", "scheme": "n4b5"},
    "n5b8e, condensed": {"calibration": "plate", "mass": "condensed", "scheme": "n5b8e"},
    "n5b8e, bubble": {"calibration": "plate", "mass": "bubble", "scheme": "n5b8e"},
    "n5b8e, consistent": {"calibration": "plate", "mass": "consistent", "scheme": "n5b8e"},
    "plate, consistent, bars": {"preset": "plate", "membrane": "bars"},
    "n5b8e, condensed, bars": {"preset": "n5b8e", "membrane": "bars"},
}
SUPERELEMENTS = "superelements"
COMPARED = 8  # most compared modes of the shell
FIRST = 5  # that are compared at any frequency
REFERENCE = 10  # computed modes of the shell


class Row(NamedTuple):
    """A mode of the shell and its partner in a model.

    Attributes
    ----------
    mode : int
        Number of the elastic mode of the shell, from 1.
    shell : float
        Its frequency, Hz.
    over_plate : float
        The same, relative to a free square plate with the longest edge as its side.
    error : float
        Relative error of the model's frequency; nan if no mode has a MAC of 0.5 or more.
    mac : float
    """

    mode: int
    shell: float
    over_plate: float
    error: float
    mac: float


def reference(case: FidelityCase) -> Reference:
    """Shell modes of a case, with frequencies extrapolated quadratically in the mesh size."""
    pattern, sheet = case.pattern(), case.sheet
    cases = [
        case.case(shell(pattern, sheet, divisions=n, mass="consistent"))
        for n in (DIVISIONS[0] // 2, *DIVISIONS)
    ]
    return reference_modes(cases, REFERENCE)


def structure_of(case: FidelityCase, model: str) -> Discretized:
    """Superelements, or bars and hinges, whose held edges stay straight even if edges may bow."""
    if model == SUPERELEMENTS:
        return superelements(case.pattern(), case.sheet, **case.options)
    options = {"bend_law": "linear", **case.options, **MODELS[model]}
    if resolved(**options).bowed:
        options["straight"] = case.held.edges
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)
        return discretize(case.pattern(), case.sheet, **options)


def compare(case: FidelityCase, true: Reference, model: str) -> list[Row]:
    """Compare a model's modes below the limit with the shell's."""
    rows = all_rows(case, true, model)
    return [row for row in rows if row.over_plate < BELOW]


def all_rows(case: FidelityCase, true: Shown, model: str, count: int = COMPARED) -> list[Row]:
    """Compare the first modes by a model with the shell's."""
    held = case.case(structure_of(case, model))
    limit = plate_frequency(case.pattern(), case.sheet)
    if model != SUPERELEMENTS and not len(held.free_dofs):  # triangles between held edges
        return [Row(k, f, f / limit, nan, 0.0) for k, f in enumerate(true.frequency[:count], 1)]
    found = matched(true, count, held, modes_at_rest(held, count + SPARE))
    rows = zip(true.frequency, found.error, found.mac, strict=False)
    return [
        Row(k, float(shell), float(shell / limit), float(error), float(mac))
        for k, (shell, error, mac) in enumerate(rows, 1)
    ]


RESULTS = Path(__file__).parent / "results"
NEAR, ALIKE = 0.05, 0.95  # largest error and least MAC of a good mode
ERRORS = ("median", "90th percentile", "within 5 %", "MAC above 0.95", "lost")  # heads of `columns`


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


def write(results: Sequence[Modes], path: Path) -> None:
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
    rows = [[model, columns(summary(results, model))] for model in MODELS]
    return markdown(["calibration, mass", *ERRORS], rows)


def markdown(head: Sequence[str], rows: Iterable[Iterable[Any]]) -> str:
    """A table in Markdown."""
    lines = [f"| {' | '.join(map(str, row))} |" for row in (head, *rows)]
    lines.insert(1, "|---" * len(head) + "|")
    return "\n".join(lines)


def columns(s: Summary) -> str:
    """Median, 90th percentile, shares and lost modes as columns of a table."""
    errors = [_percent(s.median), _percent(s.ninetieth)]
    return " | ".join([*errors, f"{100 * s.near:.0f} %", f"{100 * s.alike:.0f} %", str(s.lost)])


def _percent(error: float) -> str:
    return "lost" if np.isinf(error) else f"{100 * error:.1f} %"
