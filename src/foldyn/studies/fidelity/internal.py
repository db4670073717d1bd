"""The first five modes of every case, with and without internal amplitudes of panels."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from math import inf
from pathlib import Path

from foldyn.structures.plate_frequency import BELOW
from foldyn.studies.fidelity.cases import FidelityCase
from foldyn.studies.fidelity.compare import first_modes
from foldyn.studies.fidelity.reference import reference
from foldyn.studies.fidelity.stored import Modes, read, summary_of, write

AMPLITUDES = {"none": 0, "1": 1, "3": 3}
"""Internal amplitudes of a panel, by their name in the table."""
RANGES = {"below 0.6": (0.0, BELOW), "0.6 to 1": (BELOW, 1.0), "above 1": (1.0, inf),
          "all": (0.0, inf)}  # fmt: skip
"""Of frequencies over that of the plate."""


def computed_first(
    cases: Iterable[FidelityCase], tell: Callable[[Modes], None] = lambda modes: None
) -> list[Modes]:
    """The first five modes of cases by the shell and by n5b8e with internal amplitudes."""
    found = []
    for case in cases:
        true = reference(case)
        rows = {name: first_modes(case, true, count) for name, count in AMPLITUDES.items()}
        tell(Modes(case.name, rows))
        found.append(Modes(case.name, rows))
    return found


def write_first(path: Path, results: Iterable[Modes]) -> None:
    """Write them as `stored.write` does."""
    write(path, results, AMPLITUDES)


def read_first(path: Path) -> list[Modes]:
    """What `write_first` wrote."""
    return read(path, AMPLITUDES)


def first_table(results: list[Modes]) -> str:
    """Errors by the range of the frequency, in Markdown."""
    lines = [
        "| frequency over $f_\\mathrm{plate}$ | modes | amplitudes | median | 90th percentile "
        "| within 5 % | MAC above 0.95 | lost |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for title, (low, high) in RANGES.items():
        for name in AMPLITUDES:
            rows = [row for modes in results for row in modes.rows[name]]
            s = summary_of([row for row in rows if low <= row.over_plate < high])
            errors = " | ".join(_percent(value) for value in (s.median, s.ninetieth))
            shares = f"{100 * s.near:.0f} % | {100 * s.alike:.0f} %"
            lines.append(f"| {title} | {s.modes} | {name} | {errors} | {shares} | {s.lost} |")
    return "\n".join(lines)


def _percent(error: float) -> str:
    return "lost" if error == inf else f"{100 * error:.1f} %"
