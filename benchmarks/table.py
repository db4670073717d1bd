"""The one table: rows from measured times, as Markdown or CSV."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from problem import Problem

Row = list[str]
RATIOS = ("C++", "C++ from lengths", "C++ AVX-512", "C++ AVX-512 from lengths")
HEADINGS = (
    "laws", "cells", "dofs", "hinges", "us/step", "median", "ns/hinge",
    *(f"/ {name}" for name in RATIOS), "2 threads /", "NumPy /", "JAX /", "flop %", "memory %",
)  # fmt: skip


def ratio(times: Mapping[str, NDArray], above: str, below: str) -> str:
    """Ratio of the minima and, in brackets, the median of the ratios round by round."""
    if above not in times or below not in times:
        return "-"
    a, b = times[above], times[below]
    rounds = min(len(a), len(b))
    each = np.median(a[:rounds] / b[:rounds])
    return f"{a.min() / b.min():.3g} ({each:.3g})"


def row(
    size: str, laws: str, problem: Problem, times: Mapping[str, NDArray], peak: float, band: float
) -> Row:
    """Row of one size and one set of laws; times in seconds per step."""
    best = times["Foldyn"].min()
    hinges = len(problem.hinges)
    return [
        laws,
        size.replace("x", " x "),
        str(problem.dofs),
        str(hinges),
        f"{1e6 * best:.4g}",
        f"{1e6 * np.median(times['Foldyn']):.4g}",
        f"{1e9 * best / 4 / hinges:.1f}",
        *(ratio(times, "Foldyn", name) for name in RATIOS),
        ratio(times, "Foldyn, 2 threads", "Foldyn"),
        ratio(times, "NumPy", "Foldyn"),
        ratio(times, "JAX", "Foldyn"),
        f"{100.0 * problem.flop / best / peak:.0f}",
        f"{100.0 * problem.traffic / best / band:.0f}",
    ]


def markdown(head: Sequence[str], rows: Sequence[Row], merlin2: float) -> str:
    """Machine, table, and the comparison with MERLIN2 at 333 dofs."""
    body = [HEADINGS, ["---"] * len(HEADINGS), *rows]
    lines = [f"- {line}" for line in head]
    lines += ["", *("| " + " | ".join(cells) + " |" for cells in body), ""]
    for cells in rows:
        if cells[2] == "333":
            times = merlin2 / float(cells[4])
            lines.append(
                f"One step at 333 dofs, {cells[0]}: {times:.0f} times as fast as four force "
                f"evaluations of MERLIN2 in Octave ({merlin2 / 1000:g} ms, a stored number from "
                "another machine)."
            )
    return "\n".join(lines)


def write_csv(path: Path, headings: Sequence[str], rows: Sequence[Row]) -> None:
    """Write the rows with their headings."""
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(headings)
        writer.writerows(rows)
