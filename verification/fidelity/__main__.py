"""`python -m verification.fidelity`: compute the tables of the fidelity study.

    python -m verification.fidelity --out FOLDER

writes documented.csv, drawn.csv and sheets.csv, by default into the folder of stored results, and
prints summaries (about ten minutes).
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
    sets = {
        "documented": documented(),
        "drawn": drawn(chosen.count, chosen.seed),
        "sheets": sheets(min(chosen.count, COUNT_SHEETS)),
    }
    for name, cases in sets.items():
        below = []
        for case in cases:
            below.append(compare.modes_below(case, compare.reference(case)))
            count = len(next(iter(below[-1].rows.values())))
            print(f"{case.name}: {count} modes", file=sys.stderr, flush=True)
        compare.write(below, chosen.out / f"{name}.csv")
        print(f"\n{name}: {len(cases)} cases\n\n{compare.table(below)}\n")
    print(statics_table(), large_table(), sep="\n\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
