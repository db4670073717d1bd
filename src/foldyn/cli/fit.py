"""`foldyn fit`: a case fitted to measurements, from reading to report."""

from __future__ import annotations

import argparse
import math
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from foldyn.cli.folder import Results, add_page, held_by
from foldyn.cli.options import add, add_figures, add_results, halves, integer, number
from foldyn.cli.streams import Clock, noted_warnings, progress_bar, speech
from foldyn.errors import InputError
from foldyn.values import parsed

if TYPE_CHECKING:
    from foldyn.experiment import Course, Estimate, Fit
    from foldyn.experiment.calibration.fit_file import FitFile

WRITTEN = ("fit.json", "fit.nc", "fitted.toml")
KEPT = "evaluations"
NOTED = 0.05
"""The part of an interval that is due to discretization is reported above this share."""
DRAWN = "correlation", "data-[0-9]", "data-[0-9][0-9]"


def add_fit(commands: Any) -> None:
    """Add the arguments of `foldyn fit`."""
    fit = commands.add_parser(
        "fit",
        help="fit parameters of a case to measurements",
        description="Fit parameters of a case to measurements: a fit file names them all, or give "
        "a case file, the data and what to vary. Estimates with intervals, the case with the "
        "values found, figures and report.html go to a folder; so does every evaluation of the "
        "model, so that an interrupted fit can be resumed.",
    )
    data = "with a case file: measurements (CSV, tracks of a film, or a result of kind modes)"
    add(fit, str, {"file": "fit file, or case file (TOML) or the name of a shipped case"})
    add(fit, str, {"data": data}, nargs="*")
    many: dict[str, Any] = {"action": "append", "default": []}
    add(fit, str, {
        "--vary KEY[=START[:LOWER:UPPER]]": "with a case file: a key that is a parameter, such as "
        "sheet.thickness=2e-4:1e-4:4e-4",
        "--tie KEY=EXPRESSION": "with a case file: a key that depends on parameters",
    }, **many)  # fmt: skip
    error = "with a case file: standard error (SI units) of the data, for each of them once"
    add(fit, number, {"--sigma": error}, **many)
    fit.add_argument("--axis", default="x", help="with a case file: axis of the data (default: x)")
    add(fit, integer, {
        "--searches": "how many, from random guesses within the bounds",
        "--processes": "evaluations that run at a time",
    })  # fmt: skip
    add_results(fit, "NAME-fit")
    add_figures(fit)


def run_fit(given: argparse.Namespace) -> Path:
    """Run `foldyn fit`; return the results folder."""
    from foldyn.experiment.calibration.fit_page import write_fit

    clock = Clock.now()
    plan = plan_of(given)
    say = speech(given.quiet)
    with held_by(given, "fit", plan.path, WRITTEN, DRAWN, KEPT) as results:
        folder = results.folder
        with noted_warnings() as noted:
            found = _fit(plan, results, given.quiet)
        spent = clock.spent()
        for one in found.estimates:
            say(f"  {_line(one, found.confidence)}")
        say(f"  {found.quality}")
        for score in found.scores:
            held_out = ", held out" if score.held_out else ""
            sigmas = f", {score.sigmas:.3g} sigma" if math.isfinite(score.sigmas) else ""
            misfit = f"rms misfit {score.rms:.3g} {score.unit}".rstrip()
            say(f"  {score.name}{held_out}: {misfit}, {100.0 * score.relative:.2g} % of its "
                f"variation{sigmas}")  # fmt: skip
        for name, write in zip(WRITTEN, (found.save, found.save, found.write_case), strict=True):
            results.keep(name, write)
        say(f"wrote {folder / WRITTEN[0]}")
        add_page(given, folder, noted, spent, partial(write_fit, found, folder, plan.title))
    return folder


def _fit(plan: FitFile, results: Results, quiet: bool) -> Fit:
    """Run the fit; keep every evaluation."""
    from foldyn.experiment import fit

    kept = results.folder / KEPT
    layout = "evaluations: {n_fmt}{postfix} [{elapsed}]"
    with progress_bar(quiet, bar_format=layout, mininterval=0.0) as bar:

        def tell(course: Course) -> None:
            if not results.kept:
                results.begin(KEPT)
            if math.isfinite(course.cost):
                bar.set_postfix_str(f"smallest cost {course.cost:.6g}", refresh=False)
            bar.n = course.computed + course.found
            bar.refresh()

        return fit(
            plan.case, plan.data, parameters=plan.parameters, ties=plan.ties, folder=kept,
            progress=tell, **plan.solver,
        )  # fmt: skip


def _line(one: Estimate, confidence: float) -> str:
    if one.note:
        return f"{one.key} = {one.value:.6g} ({one.note})"
    coarse = abs(one.discretization) / (one.upper - one.lower)
    part = f" ({coarse:.0%} of that from discretization)" if coarse > NOTED else ""
    return (
        f"{one.key} = {one.value:.6g}, {100.0 * confidence:g} % from {one.lower:.6g} to "
        f"{one.upper:.6g}{part}"
    )


def plan_of(given: argparse.Namespace) -> FitFile:
    """Read the plan of a fit from a fit file, or from a case file and the other arguments."""
    from foldyn.experiment.calibration.fit_file import is_fit_file, read_fit
    from foldyn.studies import find_case

    path = find_case(given.file)
    if is_fit_file(path):
        for name in ("data", "vary", "tie", "sigma"):
            if getattr(given, name):
                option = "DATA" if name == "data" else f"--{name}"
                raise InputError(f"{option}: {path} is a fit file, which says that itself")
        plan = read_fit(path, find_case)
    else:
        plan = _of_case(path, given)
    changed = {key: getattr(given, key) for key in ("searches", "processes")}
    solver = plan.solver | {key: value for key, value in changed.items() if value is not None}
    return replace(plan, solver=solver)


def _of_case(path: Path, given: argparse.Namespace) -> FitFile:
    """Plan a fit of a case file from the command line's data, parameters and ties."""
    from foldyn.experiment.calibration.fit_file import FitFile
    from foldyn.experiment.calibration.measured_files import recognize

    if not given.data:
        raise InputError(
            f"{path}: is a case file: name the data to fit it to and what to --vary, or give a fit "
            "file (one with [[parameters]])"
        )
    if not given.vary:
        raise InputError("--vary: missing; name what to fit, as in --vary sheet.thickness")
    if given.sigma and len(given.sigma) != len(given.data):
        raise InputError(f"--sigma: {len(given.sigma)} of them for {len(given.data)} data files")
    data = [
        recognize(Path(file), given.axis, name=Path(file).stem, sigma=sigma)
        for file, sigma in zip(given.data, given.sigma or [None] * len(given.data), strict=True)
    ]
    ties = dict(halves(text, "--tie") for text in given.tie)
    return FitFile(path, "", path, tuple(data), tuple(map(_parameter, given.vary)), ties, {})


def _parameter(text: str) -> Any:
    from foldyn.experiment import Parameter

    if "=" not in text:
        return Parameter(text.strip())
    key, rest = halves(text, "--vary")
    try:
        numbers = [parsed(part) for part in rest.split(":")]
    except ValueError:
        numbers = []
    if len(numbers) not in (1, 3):
        raise InputError(f'--vary "{text}": write KEY, KEY=START or KEY=START:LOWER:UPPER')
    return Parameter(key, *numbers)
