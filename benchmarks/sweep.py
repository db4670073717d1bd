"""A 9 x 9 sweep of modes in processes against the same in one: wall times, and what was compiled.

The two take turns; ratios of one run mean something, seconds are those of the machine. Before the
first round the kernels are compiled; after it no process may add any.

    python benchmarks/sweep.py --cells 12 --processes 2 --rounds 3
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path
from statistics import median
from typing import NamedTuple

import machine

import foldyn as fd

CASE = """
[pattern]
kind = "miura"
cells = [{cells}, {cells}]
[sheet]
youngs_modulus = 1e9
poissons_ratio = 0.3
thickness = 0.01
density = 700.0
[[supports]]
nodes = "xmin"
[model]
preset = "plate"
[analysis]
kind = "modes"
count = 6
"""
VARY = {"sheet.length_scale_ratio": "1:5:9", "pattern.dihedral": "40:140:9"}


class Cost(NamedTuple):
    """Wall and processor time (s) of a sweep, that of its processes included."""

    wall: float
    processor: float


def swept(case: Path, processes: int) -> Cost:
    """What the sweep costs."""
    began, before = time.perf_counter(), sum(os.times()[:4])
    found = fd.sweep(case, VARY, measures=["frequencies"], processes=processes)
    if found.attrs["failed"]:
        sys.exit(f"points failed: {found['failure'].values.ravel()[0]}")
    return Cost(time.perf_counter() - began, sum(os.times()[:4]) - before)


def kernels(folder: str) -> set[Path]:
    """Files of compiled kernels."""
    return set(Path(folder).rglob("*.nbc"))


def main() -> None:
    """Measure, and print a table."""
    ask = argparse.ArgumentParser(description=__doc__)
    ask.add_argument("--cells", type=int, default=12, help="cells of the sheet along both sides")
    ask.add_argument("--processes", type=int, default=2)
    ask.add_argument("--rounds", type=int, default=3)
    given = ask.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        os.environ["NUMBA_CACHE_DIR"] = folder  # of this run alone, to see what is compiled
        case = Path(folder) / "case.toml"
        case.write_text(CASE.format(cells=given.cells), "utf-8")
        nodes = len(fd.read_case(case).case().structure.nodes)
        fd.read_case(case).run()  # compiles
        before, alone, together = kernels(folder), [], []
        for number in range(given.rounds):
            print(f"round {number + 1} of {given.rounds}", file=sys.stderr)
            alone.append(swept(case, 1))
            together.append(swept(case, given.processes))
        added = len(kernels(folder) - before)
    ratio = median(a.wall / b.wall for a, b in zip(alone, together, strict=True))
    print("\n".join(machine.describe(None)))
    print(f"81 points of modes, {3 * nodes} dofs; kernels compiled: {added}")
    print("| processes | wall (s) | processor (s) | speedup |\n|---|---|---|---|")
    for count, costs, gain in ((1, alone, 1.0), (given.processes, together, ratio)):
        wall, processor = (median(column) for column in zip(*costs, strict=True))
        print(f"| {count} | {wall:.1f} | {processor:.1f} | {gain:.2f} |")


if __name__ == "__main__":
    main()
