"""`foldyn design`: the best design of a case file, from reading to report."""

from __future__ import annotations

import argparse
import math
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from foldyn.cli.folder import Results, add_page, held_by
from foldyn.cli.options import add, add_figures, add_results, integer
from foldyn.cli.streams import Clock, noted_warnings, progress_bar, speech

if TYPE_CHECKING:
    from foldyn.designs import Course, Design
    from foldyn.designs.run_design import Plan

WRITTEN = ("design.nc", "history.csv", "designed.toml")
KEPT = "evaluations"
DRAWN = "convergence", "before", "after", "sensitivity-*"


def add_design(commands: Any) -> None:
    """Add the command and its arguments."""
    design = commands.add_parser(
        "design",
        help="the best design of a case file, within bounds and constraints",
        description="Search for values of some keys of a case file that make a measure as small or "
        "large as possible, as its table [design] asks for. Every evaluation is kept, so that "
        "an interrupted search can be resumed. The history, the case file with the best values, "
        "figures and report.html go to a folder.",
    )
    method = {"--method slsqp|trust-constr|mma|cma": "method (default: that of the file)"}
    add(design, str, {"case": "case file (TOML) with a table [design]", **method})
    add(design, integer, {
        "--searches N": "from designs drawn within the bounds",
        "--seed": "of the drawn designs (default: 0)",
    })  # fmt: skip
    add_results(design, "NAME-design")
    add_figures(design)


def run_design(given: argparse.Namespace) -> Path:
    """Run `foldyn design`; return the results folder."""
    from foldyn.designs.page import write_design
    from foldyn.designs.run_design import planned, write_case
    from foldyn.studies import find_case

    clock = Clock.now()
    path = find_case(given.case)
    changes = {name: getattr(given, name) for name in ("method", "searches", "seed")}
    changes = {name: value for name, value in changes.items() if value is not None}
    case_file, plan = planned(path, changes)
    say = speech(given.quiet)
    goal = "minimize" if plan.problem.sign > 0.0 else "maximize"
    count = len(plan.space.lower)
    say(f"{case_file.heading}: {goal} {plan.problem.objective.text} by {count} "
        f"number{'s' * (count > 1)} ({plan.method})")  # fmt: skip
    with held_by(given, "design", path, WRITTEN, DRAWN, KEPT) as results:
        folder = results.folder
        with noted_warnings() as noted:
            found = _searched(plan, results, given.quiet)
        spent = clock.spent()
        _tell(found, say)
        for name in WRITTEN[:2]:
            results.keep(name, found.save)
        results.keep(WRITTEN[2], partial(write_case, case_file, found.parameters))
        say(f"wrote {folder / WRITTEN[0]}")
        add_page(given, folder, noted, spent, partial(write_design, found, plan, folder, case_file))
    return folder


def _searched(plan: Plan, results: Results, quiet: bool) -> Design:
    """Run the search with a progress bar; keep every evaluation."""
    from foldyn.designs.run_design import designed

    layout = "evaluations: {n_fmt}{postfix} [{elapsed}]"
    with progress_bar(quiet, bar_format=layout, mininterval=0.0) as bar:

        def tell(course: Course) -> None:
            if not results.kept:
                results.begin(KEPT)
            if math.isfinite(course.objective):
                off = f", violation {course.violation:.2g}" if course.violation > 0.0 else ""
                bar.set_postfix_str(f"best {course.objective:.6g}{off}", refresh=False)
            bar.n = course.done
            bar.refresh()

        return designed(plan, results.folder / KEPT, tell)


def _tell(found: Design, say: Any) -> None:
    """Print the outcome of the search."""
    import numpy as np

    for name, value in found.parameters.items():
        if np.ndim(value) == 0:
            say(f"  {name} = {value:.6g}")
        else:
            low, high = np.min(value), np.max(value)
            say(f"  {name}: {np.size(value)} values from {low:.4g} to {high:.4g}")
    sound = "" if found.feasible else ", not feasible"
    say(f"  objective {found.objective:.6g}{sound}")
    for text, amount in found.constraints.items():
        say(f"  {text}: {f'violated by {amount:.3g}' if amount else 'holds'}")
    for end in found.ends:
        count = f"{end.evaluations} evaluation{'s' * (end.evaluations != 1)}"
        say(f"  search {end.search + 1}: {end.objective:.6g} after {count}: {end.message}")
