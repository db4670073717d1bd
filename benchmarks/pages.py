"""How long `foldyn run` takes with its page, and how much of that is computing.

Each case is run by a fresh process, after one that compiles. Where another checkout is named, the
two take turns. Wall and processor time are those of the process, computing is what the results say
of their solvers.

    python benchmarks/pages.py --other ../before --rounds 5
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from statistics import median
from typing import NamedTuple

import h5py
import numpy as np

CASES = (
    "run herkal/case1",
    "run herkal/case2",
    "run herkal/specimen",
    "run herkal/specimen-modes",
    "frf herkal/case2 --secant 1 --frequencies 0 3 301",
)
HERE = Path(__file__).resolve().parents[1]


class Run(NamedTuple):
    """Times (s) of one process, and the size of its page (bytes)."""

    wall: float
    processor: float
    solver: float
    page: int


def run(checkout: Path, command: str) -> Run:
    """Run a command of a checkout into an empty folder."""
    with tempfile.TemporaryDirectory() as folder:
        words = [sys.executable, "-m", "foldyn.cli.main", *command.split(), "--quiet"]
        # files of modules in bytecode, as an installed package has them
        own = {"PYTHONPATH": str(checkout / "src"), "PYTHONDONTWRITEBYTECODE": ""}
        begun = time.perf_counter()
        process = subprocess.Popen([*words, "--out", folder], env=os.environ | own)
        _, status, used = os.wait4(process.pid, 0)
        wall = time.perf_counter() - begun
        if status:
            sys.exit(f"{checkout}: foldyn {command} failed")
        solver = 0.0
        for file in Path(folder).glob("*.nc"):
            with h5py.File(file) as result:
                solver += float(np.sum(result.attrs["wall_seconds"]))
        page = (Path(folder) / "report.html").stat().st_size
    return Run(wall, used.ru_utime + used.ru_stime, solver, page)


def main() -> None:
    """Measure, and print a table."""
    ask = argparse.ArgumentParser(description=__doc__)
    ask.add_argument("--other", type=Path, help="another checkout, to compare with")
    ask.add_argument("--rounds", type=int, default=5)
    ask.add_argument("--cases", nargs="+", default=CASES, help="commands, each as one word")
    given = ask.parse_args()
    checkouts = [*([given.other] if given.other else []), HERE]
    runs: dict[tuple[str, Path], list[Run]] = {}
    with suppress(KeyboardInterrupt):  # the table is then of the rounds that there are
        for number in range(given.rounds + 1):
            print(f"round {number} of {given.rounds}", file=sys.stderr)
            for command in given.cases:
                for checkout in checkouts:
                    found = run(checkout, command)
                    if number:  # the first compiles
                        runs.setdefault((command, checkout), []).append(found)
    titles = ("wall (s)", "processor (s)", "solver (s)", "not solver (%)", "page (kB)")
    print(f"| command | checkout | {' | '.join(titles)} |")
    print("|---|---|---|---|---|---|---|")
    for (command, checkout), found in runs.items():
        wall, processor, solver, page = (median(column) for column in zip(*found, strict=True))
        share = median(100.0 * (1.0 - one.solver / one.wall) for one in found)
        print(
            f"| `{command}` | {checkout.name} | {wall:.2f} | {processor:.2f} | {solver:.2f} "
            f"| {share:.0f} | {page / 1e3:.0f} |"
        )


if __name__ == "__main__":
    main()
