"""A 9 x 9 sweep of modes in processes against the same in one: wall times, and what was compiled.

The two take turns; ratios of one run mean something, seconds are those of the machine. Before the
first round the kernels are compiled; after it no process may add any.

    python benchmarks/sweep.py --cells 12 --processes 2 --rounds 3

With --motions, motions side by side against the same one after the other, in processor time of one
process: 256 of a specimen of 333 dofs by central differences, of so many seconds each.

    python benchmarks/sweep.py --motions 1 --rounds 3
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
from unittest.mock import patch

import machine

import foldyn as fd
from foldyn.analyses.motion import MotionAnalysis

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
[analysis]
kind = "modes"
count = 6
"""
MOTION = """
[pattern]
kind = "miura"
cells = [4, 3]
dihedral = 120.0
[sheet]
youngs_modulus = 1e6
poissons_ratio = 0.25
thickness = 0.01
density = 1.0
[model]
mass = "circumcenter"
[damping]
alpha = 0.0628
[[supports]]
nodes = "xmin"
[[loads]]
nodes = "xmax"
force = [0.0, 0.0, -1e-3]
[analysis]
kind = "dynamics"
method = "central_difference"
duration = {duration}
[output]
every = 0.01
"""
MOVED = {"sheet.youngs_modulus": "1e6:1.2e6:16", "sheet.density": "1:1.2:16"}
VARY = {"sheet.length_scale_ratio": "1:5:9", "pattern.dihedral": "40:140:9"}


class Cost(NamedTuple):
    """Wall and processor time (s) of a sweep, that of its processes included."""

    wall: float
    processor: float


def swept(case: Path, processes: int) -> Cost:
    """What the sweep costs."""
    began, before = time.perf_counter(), sum(os.times()[:4])
    found = fd.sweep(case, VARY, ["frequencies"], processes=processes)
    if found.attrs["failed"]:
        sys.exit(f"points failed: {found['failure'].values.ravel()[0]}")
    return Cost(time.perf_counter() - began, sum(os.times()[:4]) - before)


def kernels(folder: str) -> set[Path]:
    """Files of compiled kernels."""
    return set(Path(folder).rglob("*.nbc"))


def moved(case: Path, beside: bool) -> float:
    """Processor time of a sweep of motions."""
    before = time.process_time()
    with patch.object(MotionAnalysis, "goes_beside", beside):
        found = fd.sweep(case, MOVED, ["displacement[20,z]"], processes=1)
    if found.attrs["failed"] or (found["side_by_side"].values.mean() > 7.0) != beside:
        sys.exit("points failed, or were not computed as they should be")
    return time.process_time() - before


def motions(duration: float, rounds: int) -> None:
    """Measure motions side by side, and print a table."""
    with tempfile.TemporaryDirectory() as folder:
        case = Path(folder) / "case.toml"
        case.write_text(MOTION.format(duration=duration), "utf-8")
        steps = fd.read_case(case).run().attrs["steps"]
        fd.sweep(case, {"sheet.density": "1:1.1:8"}, ["displacement[20,z]"], processes=1)
        costs = []
        for number in range(rounds):
            print(f"round {number + 1} of {rounds}", file=sys.stderr)
            costs.append((moved(case, False), moved(case, True)))
    alone, beside = (median(column) for column in zip(*costs, strict=True))
    print("\n".join(machine.describe(None)))
    print(f"256 motions of 333 dofs, {steps} steps, processor time of one process")
    print(f"one after the other: {alone:.1f} s, side by side: {beside:.1f} s")
    print(f"throughput: {median(a / b for a, b in costs):.2f} times that of one after the other")


def main() -> None:
    """Measure, and print a table."""
    ask = argparse.ArgumentParser(description=__doc__)
    ask.add_argument("--cells", type=int, default=12, help="cells of the sheet along both sides")
    ask.add_argument("--processes", type=int, default=2)
    ask.add_argument("--rounds", type=int, default=3)
    ask.add_argument("--motions", type=float, metavar="SECONDS", help="of motions side by side")
    given = ask.parse_args()
    if given.motions is not None:
        motions(given.motions, given.rounds)
        return
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
