"""`python -m verification.waves`: repeat two papers on waves, and write a page.

    python -m verification.waves --quick --out FOLDER

Results that are in the folder already are not computed again.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from tqdm import tqdm

from foldyn.studies.pool import Done
from verification.waves import report
from verification.waves.study import FULL, QUICK, Study


def main(arguments: list[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description="Bands of sheets, impacts on a chain.")
    parser.add_argument("--quick", action="store_true", help="coarser: a preview")
    parser.add_argument("--out", type=Path, default=Path("waves-study"), help="folder of the page")
    parser.add_argument("--processes", type=int, default=2)
    given = parser.parse_args(arguments)
    study = Study(QUICK if given.quick else FULL, given.out)
    with tqdm(total=study.count, unit="run") as bar:

        def tell(done: Done) -> None:
            bar.update()

        ended = study.compute(tell, given.processes)
    failed = [done for done in ended if done.failure]
    for done in failed:
        print(f"{done.task.name}: failed: {done.failure}", file=sys.stderr)
    print(f"wrote {report.write(study)}; {sum(done.skipped for done in ended)} runs were there")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
