"""The first five modes of every case, with and without internal amplitudes of panels."""

from __future__ import annotations

from math import inf

from foldyn.linear.reference import Reference
from foldyn.structures.plate_frequency import BELOW
from foldyn.studies.fidelity.cases import FidelityCase
from foldyn.studies.fidelity.compare import first_modes
from foldyn.studies.fidelity.stored import Modes, columns, summary_of

AMPLITUDES = {"none": 0, "1": 1, "3": 3}
"""Internal amplitudes of a panel, by their name in the table."""
RANGES = {"below 0.6": (0.0, BELOW), "0.6 to 1": (BELOW, 1.0), "above 1": (1.0, inf),
          "all": (0.0, inf)}  # fmt: skip
"""Ranges of frequencies relative to the plate's."""


def modes_first(case: FidelityCase, true: Reference) -> Modes:
    """Compare the first five modes by n5b8e with internal amplitudes with the shell's."""
    rows = {name: first_modes(case, true, count) for name, count in AMPLITUDES.items()}
    return Modes(case.name, rows)


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
            lines.append(f"| {title} | {s.modes} | {name} | {columns(s)} |")
    return "\n".join(lines)
