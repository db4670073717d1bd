"""`foldyn study`: the study of a paper, from its computations to the page."""

from __future__ import annotations

import sys
from pathlib import Path

from foldyn.cli.folder import check_folder
from foldyn.errors import ComputationError


def study(name: str, quick: bool, out: str | None, quiet: bool = False, processes: int = 2) -> Path:
    """Compute what a study has not computed yet and write its page; returns its path.

    Raises
    ------
    InputError
        The folder cannot be written.
    ComputationError
        Computations failed; the page is that of the others.
    """
    from tqdm import tqdm

    from foldyn.studies.herkal import report
    from foldyn.studies.herkal.runs import Done
    from foldyn.studies.herkal.study import FULL, QUICK, Study

    folder = Path(out or (f"{name}-quick" if quick else f"{name}-study"))
    check_folder(folder, out, ["report.html"])
    one = Study(QUICK if quick else FULL, folder)
    say = _nothing if quiet else tqdm.write
    n = one.plan.numerics
    say(
        f"case studies 1 to 4: shell with {n.divisions} divisions, {len(one.plan.models)} mass "
        f"distributions, {n.duration:g} s of motion"
    )
    jobs = one.plan.jobs()
    hidden = quiet or not sys.stderr.isatty()
    with tqdm(total=len(jobs), unit="run", disable=hidden, leave=False) as bar:

        def tell(done: Done) -> None:
            bar.update()
            if done.failure:
                say(f"  {done.job.name}: failed: {done.failure}")
            elif not done.skipped and done.seconds >= 10.0:
                say(f"  {done.job.name}: {done.seconds:.0f} s")
            for text in done.warnings:
                say(f"  {done.job.name}: warning: {text}")

        ended = one.compute(tell, processes)
    skipped = sum(done.skipped for done in ended)
    if skipped:
        say(f"skipped {skipped} of {len(ended)} runs: their results are in {folder}")
    say("drawing figures")
    page = report.write(one)
    say(f"wrote {page}")
    failed = [done for done in ended if done.failure]
    if failed:
        raise ComputationError(
            f"{len(failed)} of {len(ended)} runs failed, the first of them {failed[0].job.name}: "
            f"{failed[0].failure}\nfoldyn: kept what was computed: {page}"
        )
    return page


def _nothing(text: str) -> None:
    pass
