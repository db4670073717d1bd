"""`python -m foldyn.studies.fidelity`: compute the tables of the fidelity study.

    python -m foldyn.studies.fidelity --out FOLDER

writes documented.csv, drawn.csv and the first five modes of their cases with internal amplitudes,
by default beside the stored ones, and prints their summaries (about six minutes).
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from foldyn.studies.fidelity.cases import documented
from foldyn.studies.fidelity.drawn import COUNT, SEED, drawn
from foldyn.studies.fidelity.internal import computed_first, first_table, write_first
from foldyn.studies.fidelity.large import large_table
from foldyn.studies.fidelity.statics import statics_table
from foldyn.studies.fidelity.stored import RESULTS, Modes, computed, table, write


def main(arguments: list[str] | None = None) -> int:
    """Run what the command line says."""
    parser = argparse.ArgumentParser(description="Bars and hinges beside the shell.")
    parser.add_argument("--out", type=Path, default=RESULTS, help="folder of the tables")
    parser.add_argument("--seed", type=int, default=SEED, help="of the random cases")
    parser.add_argument("--count", type=int, default=COUNT, help="of the random cases")
    chosen = parser.parse_args(arguments)
    chosen.out.mkdir(parents=True, exist_ok=True)
    sets = {"documented": documented(), "drawn": drawn(chosen.count, chosen.seed)}
    for name, cases in sets.items():
        found = computed(cases, _tell)
        write(chosen.out / f"{name}.csv", found)
        print(f"\n{name}: {len(cases)} cases\n\n{table(found)}\n")
        first = computed_first(cases, _tell)
        write_first(chosen.out / f"{name}_internal.csv", first)
        print(f"{name}, internal amplitudes\n\n{first_table(first)}\n")
    print(statics_table(), large_table(), sep="\n\n")
    return 0


def _tell(modes: Modes) -> None:
    count = len(next(iter(modes.rows.values())))
    print(f"{modes.case}: {count} modes", file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
