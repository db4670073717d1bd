"""`foldyn study`: run the study of a paper and write its page."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from foldyn.cli.folder import Owner, Results, held
from foldyn.cli.options import add, add_results, flag
from foldyn.cli.streams import Clock, progress_bar, speech
from foldyn.errors import ComputationError, FoldynError, Told

if TYPE_CHECKING:
    from foldyn.studies.herkal.specimen.measured import Data
    from foldyn.studies.herkal.study import Study
    from foldyn.studies.pool import Done

Say = Callable[[str], None]
PROCESSES = 2
PAGE = "report.html"
INSIDE = ("runs", "runs/specimen")  # subfolders that the study writes to


def add_study(commands: Any) -> None:
    """Add the command and its arguments."""
    study = commands.add_parser(
        "study",
        help="compute the study of a paper and compare numbers",
        description="Compute the studies of a paper; results, figures and report.html go to a "
        "folder. Results that are in the folder already are not computed again.",
    )
    papers = {"name": "which: herkal (Herkal, Nagarajaiah and Paulino)"}
    add(study, str, papers, choices=("herkal",))
    flag(study, "--quick", "coarser: a preview, no measure")
    add(study, str, {
        "--data FILE": "measurements of the specimen instead of synthetic ones: a film of its "
        "release, tracks (NetCDF), or tables (CSV)",
    }, nargs="+")  # fmt: skip
    add_results(study, "NAME-study or NAME-quick", figures=False)


def study(given: Namespace) -> Path:
    """Compute the missing parts of a study and write its page; return the page's path.

    Raises
    ------
    InputError
        The folder cannot be written, or the data cannot be used.
    ComputationError
        Some computations failed; the page shows the others.
    """
    from tqdm import tqdm

    say = speech(True) if given.quiet else tqdm.write
    plan = "quick" if given.quick else "study"
    folder = Path(f"{given.name}-{plan}" if given.out is None else given.out)
    owner = Owner("study --quick" if given.quick else "study", given.name)
    with held(folder, given.out, [PAGE], owner, given.replace, [PAGE], INSIDE) as results:
        written, ended = _study(given, results, say)
        say(f"wrote {written}")
        failed = [done for done in ended if done.failure]
        if failed:
            raise ComputationError(
                f"{len(failed)} of {len(ended)} runs failed, the first of them "
                f"{failed[0].task.name}: {failed[0].failure}"
            )
    return written


def _data(names: Sequence[str] | None, say: Say) -> Data | None:
    """Return the data measured on the specimen; None if the specimen must be left out."""
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


def _study(given: Namespace, results: Results, say: Say) -> tuple[Path, Sequence[Done]]:
    """Compute the case studies and the specimen; return the page and the outcome of all tasks."""
    from foldyn.analyses.provenance import Call
    from foldyn.studies.herkal import report
    from foldyn.studies.herkal.study import FULL, QUICK, Study

    clock = Clock.now()
    data = _data(given.data, say)
    one = Study(QUICK if given.quick else FULL, results.folder, data)
    n = one.plan.numerics
    say(
        f"case studies 1 to 4: shell with {n.divisions} divisions, {len(one.plan.models)} mass "
        f"rules of bars and hinges, {n.duration:g} s of motion"
    )
    if data is not None:
        names = ", ".join(file.name for file in data.files.values())
        say(f"the specimen: calibrated to {names or 'a synthetic film'}")
    ended = _computed(one, results, say, given.quiet)
    say("drawing figures")
    return report.write(one, Call(given.typed, (), **clock.spent())), ended


def _computed(one: Study, results: Results, say: Say, quiet: bool) -> list[Done]:
    """Compute with a progress bar; report what took long, failed or was skipped."""
    told = Told()
    with progress_bar(quiet, total=one.count, unit="run") as bar:

        def tell(done: Done) -> None:
            if not done.failure and not results.kept:
                results.begin(INSIDE[0])
                results.clear()
            bar.update()
            if done.failure:
                say(f"  {done.task.name}: failed: {done.failure}")
            elif not done.skipped and done.seconds >= 10.0:
                say(f"  {done.task.name}: {done.seconds:.0f} s")
            for text in done.warnings:
                told.add(text, done.task.name)

        ended = one.compute(tell, PROCESSES)
    for text in told:
        say(f"  warning: {text}")
    skipped = sum(done.skipped for done in ended)
    if skipped:
        say(f"skipped {skipped} of {len(ended)} runs: their results are in {results.folder}")
    return ended
