"""Fuzzers by hand: ``python tests/fuzz`` runs all of them long and stores what came of it.

``python tests/fuzz fold --mutations 500 --seed 3`` runs one, and ``--show 17`` shows one of its
inputs and reads it here.
"""

from __future__ import annotations

import argparse
import csv
import os
import sys
import tempfile
from pathlib import Path

from fuzz_judge import Report, fuzz
from fuzz_targets import TARGETS

RESULTS = Path(__file__).with_name("results.csv")
MANY = 10_000
"""Mutations of each target whose result is stored."""


def main() -> int:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(prog="python tests/fuzz", description=__doc__)
    parser.add_argument("targets", nargs="*", choices=[*TARGETS, []], metavar="TARGET",
                        help=f"of {', '.join(TARGETS)}; all of them if none is named")  # fmt: skip
    parser.add_argument("--mutations", type=int, default=MANY)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--show", type=int, metavar="NUMBER", help="show one input and read it")
    chosen = parser.parse_args()
    names = chosen.targets or list(TARGETS)
    if chosen.show is not None:
        return _show(names[0], chosen.seed, chosen.show)
    wrong = 0
    for name in names:
        report = fuzz(name, chosen.mutations, chosen.seed)
        print(report, flush=True)
        wrong += len(report.findings)
        if report.mutations >= MANY:
            store(report)
    return min(wrong, 1)


def store(report: Report) -> None:
    """Put a report into the table of results, one row a target."""
    rows = {row["target"]: row for row in stored()}
    rows[report.target] = {
        "target": report.target,
        "seed": str(report.seed),
        "mutations": str(report.mutations),
        "accepted": str(report.accepted),
        "refused": str(report.refused),
        "findings": str(len(report.findings)),
        "slowest_s": f"{report.slowest:.2f}",
        "memory_mib": str(report.memory),
    }
    with RESULTS.open("w", encoding="utf-8", newline="") as file:
        table = csv.DictWriter(file, list(rows[report.target]), lineterminator="\n")
        table.writeheader()
        table.writerows(rows[name] for name in sorted(rows))


def stored() -> list[dict[str, str]]:
    """Rows of the table of results."""
    if not RESULTS.exists():
        return []
    with RESULTS.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def _show(name: str, seed: int, number: int) -> int:
    target = TARGETS[name]
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        data = target.mutated(seed, number, target.seeds(Path(folder)))
        file = Path(folder) / f"input{target.suffix}"
        file.write_bytes(data)
        print(data[:2000] if len(data) > 2000 else data)
        print("read:", target.read(file))
    return 0


if __name__ == "__main__":
    sys.exit(main())
