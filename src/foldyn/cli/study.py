"""`foldyn study`: the study of a paper, from its computations to the page."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from foldyn.cli.folder import Results, held
from foldyn.cli.speech import silence
from foldyn.cli.stamp import Owner
from foldyn.errors import ComputationError, FoldynError, InputError

if TYPE_CHECKING:
    from foldyn.studies.herkal.pool import Done
    from foldyn.studies.herkal.specimen.measured import Data

Say = Callable[[str], None]
PROCESSES = 2
INSIDE = ("runs", "runs/specimen", "sensitivity")  # folders that are written to


def study(
    name: str,
    quick: bool,
    out: str | None,
    quiet: bool = False,
    sensitivity: bool = False,
    data: Sequence[str] | None = None,
    replace: bool = False,
) -> Path:
    """Compute what a study has not computed yet and write its page; returns its path.

    Parameters
    ----------
    name : str
    quick : bool
        Coarser shells.
    out : str or None
        Folder.
    quiet : bool
    sensitivity : bool
        The combinations of what the paper leaves unsaid, instead of the study itself.
    data : sequence of str, optional
        Files with measurements of the specimen; synthetic ones by default.
    replace : bool
        Whether another study in the folder is replaced.

    Raises
    ------
    InputError
        The folder cannot be written, or the data cannot be used.
    ComputationError
        Computations failed; the page is that of the others.
    """
    from tqdm import tqdm

    say = silence if quiet else tqdm.write
    if sensitivity and data:
        raise InputError("--data: belongs to the study; leave out --sensitivity")
    plan = "quick" if quick else "study"
    folder = Path(f"{name}-{plan}" if out is None else out)
    page = "sensitivity.html" if sensitivity else "report.html"
    owner = Owner("study --quick" if quick else "study", name)
    with held(folder, out, [page], owner, replace, [page], INSIDE) as results:
        measured = None if sensitivity else _data(data, say)
        hidden = quiet or not sys.stderr.isatty()
        if sensitivity:
            written, ended = _vary(quick, results, say, hidden)
        else:
            written, ended = _study(quick, results, measured, say, hidden)
        say(f"wrote {written}")
        _check(ended, results)
    return written


def _check(ended: Sequence[Done], results: Results) -> None:
    """Raise where computations failed."""
    failed = [done for done in ended if done.failure]
    if failed:
        raise ComputationError(
            f"{len(failed)} of {len(ended)} runs failed, the first of them {failed[0].task.name}: "
            f"{failed[0].failure}"
        )


def _data(names: Sequence[str] | None, say: Say) -> Data | None:
    """What was measured of the specimen; None where it must be left out."""
    from foldyn.experiment import opencv
    from foldyn.studies.herkal.specimen.measured import data_of

    if names:
        return data_of(names)
    try:
        opencv()
    except FoldynError as error:
        say(f"the specimen's synthetic film is left out: {error}")
        return None
    return data_of([])


def _study(
    quick: bool, results: Results, data: Data | None, say: Say, hidden: bool
) -> tuple[Path, Sequence[Done]]:
    from foldyn.studies.herkal import report
    from foldyn.studies.herkal.study import FULL, QUICK, RESULTS, Study

    one = Study(QUICK if quick else FULL, results.folder, data)
    n = one.plan.numerics
    say(
        f"case studies 1 to 4: shell with {n.divisions} divisions, {len(one.plan.models)} mass "
        f"distributions, {n.duration:g} s of motion"
    )
    if data is not None:
        given = "a synthetic film" if data.synthetic else ", ".join(data.names)
        say(f"the specimen: calibrated to {given}")
    ended = _told(one.compute, one.count, results, RESULTS, say, hidden)
    say("drawing figures")
    return report.write(one), ended


def _vary(quick: bool, results: Results, say: Say, hidden: bool) -> tuple[Path, Sequence[Done]]:
    from foldyn.studies.herkal import pool, report, variations
    from foldyn.studies.herkal import sensitivity as how
    from foldyn.studies.herkal.study import CASES, QUICK, VARIED

    numerics = QUICK.numerics if quick else VARIED
    tasks = how.tasks(CASES, numerics)
    folder = results.folder
    inside = folder / report.SENSITIVITY
    inside.mkdir(parents=True, exist_ok=True)
    say(
        f"sensitivity of the case studies: {len(tasks)} tasks of a motion of the shell with "
        f"{numerics.divisions} divisions and {4 * len(how.MODELS)} of bars and hinges each"
    )

    def compute(tell: Callable[[Done], None], processes: int) -> list[Done]:
        return pool.run(tasks, inside, tell, processes)

    ended = _told(compute, len(tasks), results, report.SENSITIVITY, say, hidden)
    found = how.variations(inside, CASES, numerics)
    variations.write(inside, found)
    if not found.motions:
        return inside, ended
    return report.write_sensitivity(folder, found), ended


def _told(
    compute: Callable[[Callable[[Done], None], int], list[Done]], count: int, results: Results,
    inside: str, say: Say, hidden: bool,
) -> list[Done]:  # fmt: skip
    """Compute with a progress bar, and say what took long, failed or was skipped."""
    from tqdm import tqdm

    with tqdm(total=count, unit="run", disable=hidden, leave=False) as bar:

        def tell(done: Done) -> None:
            if not done.failure and not results.kept:
                results.begin(inside)
                results.clear()
            bar.update()
            if done.failure:
                say(f"  {done.task.name}: failed: {done.failure}")
            elif not done.skipped and done.seconds >= 10.0:
                say(f"  {done.task.name}: {done.seconds:.0f} s")
            for text in done.warnings:
                say(f"  {done.task.name}: warning: {text}")

        ended = compute(tell, PROCESSES)
    skipped = sum(done.skipped for done in ended)
    if skipped:
        say(f"skipped {skipped} of {len(ended)} runs: their results are in {results.folder}")
    return ended
