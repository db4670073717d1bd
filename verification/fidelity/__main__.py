"""`python -m verification.fidelity`: compute the tables of the fidelity study.

    python -m verification.fidelity --out FOLDER

writes documented.csv, drawn.csv and sheets.csv, and for the first two sets the first five modes of
each case with internal amplitudes, by default into the folder of stored results, and prints
summaries (about ten minutes).
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from verification.fidelity import compare
from verification.fidelity.cases import COUNT, COUNT_SHEETS, SEED, documented, drawn, sheets
from verification.fidelity.statics import large_table, statics_table


def main(arguments: list[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description="Bars and hinges beside the shell.")
    parser.add_argument("--out", type=Path, default=compare.RESULTS, help="folder of the tables")
    parser.add_argument("--seed", type=int, default=SEED, help="of the random cases")
    parser.add_argument("--count", type=int, default=COUNT, help="of the random cases")
    chosen = parser.parse_args(arguments)
    chosen.out.mkdir(parents=True, exist_ok=True)
    small = {"documented": documented(), "drawn": drawn(chosen.count, chosen.seed)}
    for name, cases in {**small, "sheets": sheets(min(chosen.count, COUNT_SHEETS))}.items():
        below, first = [], []
        for case in cases:
            true = compare.reference(case)
            below.append(compare.modes_below(case, true))
            if name in small:
                first.append(compare.modes_first(case, true))
            count = len(next(iter(below[-1].rows.values())))
            print(f"{case.name}: {count} modes", file=sys.stderr, flush=True)
        compare.write(below, chosen.out / f"{name}.csv")
        print(f"\n{name}: {len(cases)} cases\n\n{compare.table(below)}\n")
        if first:
            compare.write(first, chosen.out / f"{name}_internal.csv")
            print(f"{name}, internal amplitudes\n\n{compare.first_table(first)}\n")
    print(statics_table(), large_table(), sep="\n\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
