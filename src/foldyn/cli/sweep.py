"""`foldyn sweep`: run a case file at many values of its keys."""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from foldyn.cli.folder import Results, add_page, held_by
from foldyn.cli.options import add, add_figures, add_results, halves, integer
from foldyn.cli.streams import Clock, noted_warnings, progress_bar, speech
from foldyn.errors import ComputationError, InputError, within

if TYPE_CHECKING:
    import xarray

    from foldyn.sweeps.plan import Plan
    from foldyn.sweeps.run_sweep import Course

RESULT, KEPT = "sweep.nc", "points"
DRAWN = "map-*", "lines-*", "effects-*", "indices-*"
OFTEN = 30.0
"""Seconds between lines of progress when output is not a terminal."""
MOST_NAMED = 5
"""Largest number of printed reasons for missing values."""


def add_sweep(commands: Any) -> None:
    """Add the command and its arguments."""
    sweep = commands.add_parser(
        "sweep",
        help="a case file at many values of its numbers, each measured",
        description="Compute a case file at many values of its keys, and measure each result. All "
        "processors work on it; every computed point is kept, so that an interrupted sweep can "
        "be resumed. One dataset, figures and report.html go to a folder. Options that are not "
        "given come from the table [sweep] of the file.",
    )
    add(sweep, str, {"case": "case file (TOML), or the name of a shipped one"})
    add(sweep, str, {
        "--vary KEY=RANGE": "a key of the case file with A:B:N (N values from A to B), A:B:N:log, "
        "or values as in 1,2,5; with --samples A:B or A:B:log",
        "--measure NAME": "what is measured, such as frequencies or peak_frequency[8]; or your own "
        "function, [NAME=]module:function or [NAME=]file.py:function",
    }, action="append")  # fmt: skip
    add(sweep, integer, {"--samples N": "draw N points instead of a grid"})
    add(sweep, str, {
        "--method latin_hypercube|sobol|saltelli": "how points are drawn (default: "
        "latin_hypercube); saltelli is for Sobol indices, and takes N times the number of keys and "
        "two",
    })  # fmt: skip
    add(sweep, integer, {"--seed": "of the samples (default: 0)"})
    ties = {"--tie KEY=EXPRESSION": "a key that depends on others, such as b=360 - a"}
    add(sweep, str, ties, action="append")
    add(sweep, integer, {"--processes N": "points at a time (default: one per processor)"})
    add(sweep, str, {"--scheduler ADDRESS": "Dask scheduler whose workers compute instead"})
    add(sweep, str, {
        "--device": "where motions are computed (default: as the file says, else auto: on a GPU "
        "where that pays)",
    }, choices=("auto", "cpu", "gpu"))  # fmt: skip
    add_results(sweep, "NAME-sweep")
    add_figures(sweep)


def run_sweep(given: argparse.Namespace) -> Path:
    """Run `foldyn sweep`; return the results folder.

    Raises
    ------
    InputError
        An argument cannot be used; nothing was written.
    ComputationError
        No point has a value; the reasons are kept.
    """
    from foldyn.results import save
    from foldyn.results.sweep_dataset import has_values
    from foldyn.studies import find_case
    from foldyn.sweeps.page import write_sweep

    clock = Clock.now()
    path = find_case(given.case)
    plan = _plan(path, given)
    say = speech(given.quiet)
    say(_introduction(plan))
    with held_by(given, "sweep", path, [RESULT], DRAWN, KEPT) as results:
        folder = results.folder
        with noted_warnings(None if given.no_figures else path) as noted:
            found = _swept(plan, given, results, say)
        spent = clock.spent()
        results.keep(RESULT, partial(save, found))
        _tell_failed(found, say)
        say(f"wrote {folder / RESULT}")
        if found.attrs["failed"] == found.attrs["points"] and not has_values(found):
            raise ComputationError(
                f"all {found.attrs['points']} points failed, the first with: "
                f"{found['failure'].values.flat[0]}"
            )
        add_page(given, folder, noted, spent, partial(write_sweep, found, folder, plan.case_file))
    return folder


def _plan(path: Path, given: argparse.Namespace) -> Plan:
    """Build and check the plan of the sweep."""
    from foldyn.sweeps.measure import own_measure
    from foldyn.sweeps.plan import plan_of

    vary = None if given.vary is None else _table(given.vary, "--vary")
    ties = None if given.tie is None else _table(given.tie, "--tie")
    measures: list[Any] | None = None
    if given.measure is not None:
        here = Path.cwd()
        if str(here) not in sys.path:
            sys.path.insert(0, str(here))  # as with `python -m`: for the user's modules
        with within("--measure"):
            measures = [own_measure(text, here) or text for text in given.measure]
    asked = given.samples, given.method, given.seed, ties, given.device
    return plan_of(path, vary, measures, *asked)


def _table(texts: Sequence[str], option: str) -> dict[str, str]:
    """Parse keys and the text after their "="."""
    table: dict[str, str] = {}
    for text in texts:
        key, rest = halves(text, option)
        if key in table:
            raise InputError(f'{option} "{text}": {key} is named twice')
        table[key] = rest
    return table


def _introduction(plan: Plan) -> str:
    if plan.method == "grid":
        how = " x ".join(str(len(one.values)) for one in plan.varied)
        how = f"{how} points" if len(plan.varied) == 1 else f"{how} = {len(plan.points)} points"
    else:
        how = f"{len(plan.points)} points ({plan.method})"
    keys = ", ".join(one.key for one in plan.varied)
    return f"{plan.case_file.heading}: {plan.case_file.analysis.kind} at {how} of {keys}"


def _swept(
    plan: Plan, given: argparse.Namespace, results: Results, say: Callable[[str], None]
) -> xarray.Dataset:
    """Run the sweep with a progress bar, or with a line from time to time."""
    from foldyn.sweeps.run_sweep import swept

    total = len(set(plan.points))
    with progress_bar(given.quiet, total=total, unit="point") as bar:
        told = time.monotonic()

        def tell(course: Course) -> None:
            nonlocal told
            if not results.kept:
                results.begin(KEPT)
            if course.failed:
                bar.set_postfix_str(f"{course.failed} failed", refresh=False)
            if course.done == course.found:
                bar.initial = course.found  # stored points do not count for the speed
            bar.update(course.done - bar.n)
            if bar.disable and course.done < total and time.monotonic() - told > OFTEN:
                told = time.monotonic()
                failed = f", {course.failed} failed" if course.failed else ""
                say(f"  {course.done} of {total} points{failed}, {_left(course.left)}")

        return swept(plan, given.processes, given.scheduler, results.folder / KEPT, tell)


def _left(seconds: float) -> str:
    """Remaining time in words."""
    if not seconds >= 0.0:
        return "time left unknown"
    if seconds < 100.0:
        return f"about {seconds:.0f} s left"
    return f"about {seconds / 60.0:.0f} min left" if seconds < 6000.0 else (
        f"about {seconds / 3600.0:.1f} h left"
    )  # fmt: skip


def _tell_failed(found: xarray.Dataset, say: Callable[[str], None]) -> None:
    """Say how many points lack values, and why."""
    failed = found.attrs["failed"]
    if not failed:
        return
    say(f"values are missing at {failed} of {found.attrs['points']} points:")
    reasons = Counter(filter(None, found["failure"].values.ravel().tolist()))
    for reason, count in list(reasons.items())[:MOST_NAMED]:
        say(f"  {count} of them: {reason}")
    if len(reasons) > MOST_NAMED:
        say(f"  and {len(reasons) - MOST_NAMED} other reasons: see {RESULT}")
