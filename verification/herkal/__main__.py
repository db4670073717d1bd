"""`python -m verification.herkal`: the case studies of Herkal et al. beyond the paper.

    python -m verification.herkal sensitivity --out FOLDER    # other pulses, loads, bends
    python -m verification.herkal stiffnesses --out FOLDER    # other models of the sheet
    python -m verification.herkal film --out FOLDER           # the specimen's synthetic film

The first writes sensitivity.html and two tables (CSV) like those in `results`, the second
stiffnesses.html, the third photographs and a film. Results that are in the folder already are not
computed again.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from tqdm import tqdm

from foldyn import experiment
from foldyn.studies import pool
from foldyn.studies.herkal import study as studies
from foldyn.studies.herkal.runs import CASES
from foldyn.studies.herkal.specimen import synthetic
from foldyn.studies.pool import Done, Task
from verification.herkal import sensitivity, sensitivity_page, stiffnesses_page, variations
from verification.herkal.models import WiderPlan
from verification.herkal.stiffnesses import MESHES
from verification.herkal.stiffnesses_page import WiderStudy

COARSE = (3, 6)  # divisions of the shells for the specimen of a quick run


def main(arguments: list[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description="The case studies of Herkal et al. varied.")
    parser.add_argument("what", choices=("sensitivity", "stiffnesses", "film"))
    parser.add_argument("--quick", action="store_true", help="coarser shells and film")
    parser.add_argument("--out", type=Path, default=Path("herkal-beyond"), help="folder")
    parser.add_argument("--cases", nargs="+", default=list(CASES), choices=CASES)
    parser.add_argument("--processes", type=int, default=2)
    given = parser.parse_args(arguments)
    given.out.mkdir(parents=True, exist_ok=True)
    if given.what == "film":
        shot = synthetic.COARSE if given.quick else synthetic.PAPERS
        print(*synthetic.photograph(given.out, shot))
        experiment.write_film(synthetic.film(given.out, shot), given.out / synthetic.TRACKED)
        return 0
    cases, runs = tuple(given.cases), given.out / studies.RESULTS
    if given.what == "sensitivity":
        numerics = studies.QUICK.numerics
        ended = _run(sensitivity.tasks(cases, numerics), runs, given.processes)
        found = sensitivity.variations(runs, cases, numerics)
        variations.write(found, given.out)
        page = sensitivity_page.write(found, given.out)
    else:
        numerics = studies.QUICK.numerics if given.quick else studies.FULL.numerics
        meshes = COARSE if given.quick else MESHES
        study = WiderStudy(WiderPlan(numerics, cases), given.out, meshes=meshes)
        ended = _run(study.tasks(), runs, given.processes)
        page = stiffnesses_page.write(study)
    print(f"wrote {page}; {sum(done.skipped for done in ended)} runs were there")
    return int(any(done.failure for done in ended))


def _run(tasks: Sequence[Task], folder: Path, processes: int) -> list[Done]:
    """Compute what is missing, with a bar; say what failed."""
    folder.mkdir(exist_ok=True)
    with tqdm(total=len(tasks), unit="run") as bar:

        def tell(done: Done) -> None:
            bar.update()
            if done.failure:
                print(f"{done.task.name}: failed: {done.failure}", file=sys.stderr)

        return pool.run(tasks, folder, tell, processes)


if __name__ == "__main__":
    sys.exit(main())
