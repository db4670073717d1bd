"""`foldyn study`: run the study of a paper and write its page."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from foldyn.cli.folder import Owner, Results, held
from foldyn.cli.options import add_results, flag
from foldyn.cli.streams import Clock, progress_bar, speech
from foldyn.errors import ComputationError, FoldynError, InputError, Told

if TYPE_CHECKING:
    from foldyn.studies.herkal.specimen.measured import Data
    from foldyn.studies.pool import Done

Say = Callable[[str], None]
PROCESSES = 2
INSIDE = ("runs", "runs/specimen", "sensitivity")  # subfolders that the study writes to


def add_study(commands: Any) -> None:
    """Add the command and its arguments."""
    study = commands.add_parser(
        "study",
        help="compute the study of a paper and compare numbers",
        description="Compute the studies of a paper; results, figures and report.html go to a "
        "folder. Results that are in the folder already are not computed again.",
    )
    study.add_argument(
        "name",
        choices=("herkal",),
        help="which: herkal (Herkal, Nagarajaiah and Paulino)",
    )
    flag(study, "--quick", "coarser: a preview, no measure")
    sensitivity = "instead: the same under other pulses, loads, bends and calibrations"
    flag(study, "--sensitivity", sensitivity)
    study.add_argument(
        "--data",
        nargs="+",
        metavar="FILE",
        help="measurements of the specimen instead of synthetic ones: a film of its release, "
        "tracks (NetCDF), or tables (CSV)",
    )
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
    if given.sensitivity and given.data:
        raise InputError("--data: belongs to the study; leave out --sensitivity")
    plan = "quick" if given.quick else "study"
    folder = Path(f"{given.name}-{plan}" if given.out is None else given.out)
    page = "sensitivity.html" if given.sensitivity else "report.html"
    owner = Owner("study --quick" if given.quick else "study", given.name)
    with held(folder, given.out, [page], owner, given.replace, [page], INSIDE) as results:
        compute = _vary if given.sensitivity else _study
        written, ended = compute(given, results, say)
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
    from foldyn.studies.herkal.study import FULL, QUICK, RESULTS, Study

    clock = Clock.now()
    data = _data(given.data, say)
    one = Study(QUICK if given.quick else FULL, results.folder, data)
    n = one.plan.numerics
    say(
        f"case studies 1 to 4: shell with {n.divisions} divisions, {len(one.plan.models)} models "
        f"of bars and hinges, {n.duration:g} s of motion"
    )
    if data is not None:
        names = ", ".join(file.name for file in data.files.values())
        say(f"the specimen: calibrated to {names or 'a synthetic film'}")
    ended = _computed(one.compute, one.count, results, RESULTS, say, given.quiet)
    say("drawing figures")
    return report.write(one, Call(given.typed, (), **clock.spent())), ended


def _vary(given: Namespace, results: Results, say: Say) -> tuple[Path, Sequence[Done]]:
    """Compute the sensitivity of the case studies; return the page and the outcome of all tasks."""
    from foldyn.studies import pool
    from foldyn.studies.herkal import report, sensitivity, variations
    from foldyn.studies.herkal.runs import CASES
    from foldyn.studies.herkal.study import QUICK, VARIED

    numerics = QUICK.numerics if given.quick else VARIED
    tasks = sensitivity.tasks(CASES, numerics)
    inside = results.folder / report.SENSITIVITY
    inside.mkdir(parents=True, exist_ok=True)
    say(
        f"sensitivity of the case studies: {len(tasks)} tasks of a motion of the shell with "
        f"{numerics.divisions} divisions and {4 * len(sensitivity.MODELS)} of bars and hinges each"
    )
    compute = partial(pool.run, tasks, inside)
    ended = _computed(compute, len(tasks), results, report.SENSITIVITY, say, given.quiet)
    found = sensitivity.variations(inside, CASES, numerics)
    variations.write(found, inside)
    if not found.motions:
        return inside, ended
    return report.write_sensitivity(found, results.folder), ended


def _computed(
    compute: Callable[[Callable[[Done], None], int], list[Done]], count: int, results: Results,
    inside: str, say: Say, quiet: bool,
) -> list[Done]:  # fmt: skip
    """Compute with a progress bar; report what took long, failed or was skipped."""
    told = Told()
    with progress_bar(quiet, total=count, unit="run") as bar:

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
                told.add(text, done.task.name)

        ended = compute(tell, PROCESSES)
    for text in told:
        say(f"  warning: {text}")
    skipped = sum(done.skipped for done in ended)
    if skipped:
        say(f"skipped {skipped} of {len(ended)} runs: their results are in {results.folder}")
    return ended
