"""`foldyn run`: a case file from reading to report."""

from __future__ import annotations

import sys
import warnings
from argparse import Namespace
from collections.abc import Callable, Mapping
from contextlib import ExitStack, nullcontext
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from foldyn.analyses import ANALYSES, CaseFile, Computation, read_case
from foldyn.analyses.motion import MotionComputation
from foldyn.analyses.provenance import Call, mesh_error
from foldyn.analyses.reading import read_as
from foldyn.arguments import arguments
from foldyn.cli.folder import Owner, Results, drawing, held
from foldyn.cli.streams import Clock, noted_warnings, speech
from foldyn.dynamics import SECONDS, Keeping
from foldyn.errors import ComputationError, InputError, MotionInterrupted, Told, within
from foldyn.plots import FIGURES
from foldyn.studies import find_case
from foldyn.tables import table_under
from foldyn.values import number

if TYPE_CHECKING:
    import xarray

PARTS: Mapping[str, tuple[str, ...]] = {
    "bars_and_hinges": ("nodes", "bars", "folds", "bends"),
    "shell": ("nodes", "triangles", "folds"),
    "superelements": ("nodes", "folds"),
}
"""Parts that the introduction counts, for each model."""
FILES = ["structure", "laws", *(name for kind in ANALYSES.values() for name in kind.files)]
DRAWN = [
    "report.html", *(name for name in FILES if "." in name),
    *(f"{name}.{form}" for name in FILES if "." not in name for form in FIGURES),
]  # fmt: skip
"""Glob patterns of the files that pages may have."""


def run(given: Namespace) -> Path:
    """Run a case file, write its results, and return their folder.

    Everything is checked before the first step is computed and before anything is written. The
    folder is stamped with the command and the case file. A folder with results of another command
    or case file is refused, unless --replace is given.
    """
    clock = Clock.now()
    path, page = find_case(given.case), not given.no_figures
    command, suffix = given.command, "results" if given.command == "run" else given.command
    if given.model is not None:
        command, suffix = f"{command} --model {given.model}", f"{given.model}-{suffix}"
    folder = Path(f"{path.stem}-{suffix}" if given.out is None else given.out)
    told = Told()
    with told.noting():  # warnings would distract from the one message on bad input
        case_file = _read(path, given)
        if getattr(given, "film", None):
            case_file = replace(case_file, output=replace(case_file.output, animation=given.film))
        device = getattr(given, "device", None)
        if device is not None and "device" not in case_file.analysis.takes:
            raise InputError("--device: is for motions only; leave it out")
        changes = {} if device is None else {"device": device}
        task = list[Computation]()
        for mass in case_file.masses:
            told.where = mass if len(case_file.masses) > 1 else ""
            task.append(case_file.computation(mass, **changes))
        _keep(task, folder, given)
        with case_file.placing():
            case_file.analysis.check([one.compute for one in task], given.figures is not None)
        if page and case_file.output.animation == "mp4":
            from foldyn.plots.writers import find_ffmpeg

            with within('output.animation = "mp4": ', case_file.path):
                find_ffmpeg()
    names = [one.file for one in task]
    say = speech(given.quiet)
    owner = Owner.of(command, path, folder)
    pages = ["report.html"] if page else []
    with (
        held(folder, given.out, [*names, *pages], owner, given.replace, DRAWN) as kept,
        ExitStack() as stack,
    ):
        for one in task:  # no other process may store to the results of motions
            if isinstance(one.compute, MotionComputation) and one.compute.kept:
                stack.enter_context(one.compute.kept.held())
        with noted_warnings(path if page else None) as noted:
            introduction = _introduction(case_file, told, say)
            done = _computed(task, kept, introduction, not given.quiet and sys.stderr.isatty(), say)
        call = Call(given.typed, tuple(noted), **clock.spent())
        say(f"wrote {', '.join(kept.kept)}")
        if page:
            drawn = given.figures or case_file.output.animation
            with drawing(case_file.path):  # whatever the error, the results are already saved
                if drawn:
                    say("drawing figures")
                written = case_file.analysis.page(case_file, done, folder, call, given.figures)
            say(f"wrote {'figures and ' if drawn else ''}{written}")
    return folder


def _keep(task: list[Computation], folder: Path, given: Namespace) -> None:
    """Set up checkpoints in the folder for motions while they run."""
    resume, seconds = getattr(given, "resume", False), getattr(given, "checkpoint", None)
    if resume and given.replace:
        raise InputError("--resume: continues from the stored results; leave out --replace")
    if seconds is not None:
        number("--checkpoint", seconds, above=0.0)
    for one in task:
        if isinstance(one.compute, MotionComputation):
            how = "--resume", "--replace"
            file = folder / one.file
            one.compute.kept = Keeping(file, seconds or SECONDS, resume, given.replace, how)
            one.compute.shown = not given.no_figures
        elif resume or seconds is not None:
            option = "--resume" if resume else "--checkpoint"
            raise InputError(f"{option}: only motions have checkpoints; leave it out")


def _read(path: Path, given: Namespace) -> CaseFile:
    """Read a case file as the kind of analysis that the command stands for."""
    if given.command == "run":
        return read_case(path, model=given.model, divisions=given.divisions)
    own: Any = table_under("analysis", ANALYSES[given.command].schema)
    keys = {key: value for key, value in vars(given).items() if key in arguments(own)}
    if given.command == "frf" and given.frequencies is not None:
        first, last, count = given.frequencies
        whole = int(count) if count.is_integer() else count
        keys["frequencies"] = {"first": first, "last": last, "count": whole}
    if given.command == "random":
        keys = {key: value for key, value in keys.items() if value is not False}
        keys["base"] = given.base and dict(_density(*words) for words in given.base)
    divisions = None if "divisions" in keys else getattr(given, "divisions", None)
    return read_as(path, given.command, keys, given.model, divisions)


def _density(axis: str, *words: str) -> tuple[str, dict[str, Any]]:
    """An axis and the table of its density, from the words of --base."""
    unit, *points = words or [""]
    pairs = [point.split(":") for point in points]
    try:
        frequency, value = ([*map(float, column)] for column in zip(*pairs, strict=True))
    except ValueError:
        raise InputError(
            f"--base {' '.join((axis, *words))}: write AXIS UNIT F:DENSITY F:DENSITY ..., as in z "
            "g2/Hz 20:0.005 80:0.04 500:0.04"
        ) from None
    return axis, {"frequency": frequency, "value": value, "unit": unit}


def _computed(
    task: list[Computation], results: Results, introduction: Callable[[], None], progress: bool,
    say: Callable[[str], None],
) -> dict[str, xarray.Dataset]:  # fmt: skip
    """Run all computations; save each result as soon as it is ready, and say what it lacks.

    A missing value without a known reason is an error.
    """
    from foldyn.results import save
    from foldyn.results.quantities import REASONS, missing_values

    done: dict[str, xarray.Dataset] = {}
    told = Told()
    for one in task:
        told.where = one.mass
        try:
            with told.noting() if len(task) > 1 else nullcontext():
                done[one.mass] = one.run(progress, introduction)
        except (ComputationError, MotionInterrupted) as error:
            if error.partial is not None:
                error.partial.attrs.setdefault("stopped_because", str(error))
                results.keep(one.file, partial(save, error.partial))
                if not isinstance(error, MotionInterrupted):
                    _saved(one, error.partial)
            told.issue()
            raise type(error)(f"{one.place}{error}", error.partial) from None
        result = done[one.mass]
        there = result.encoding.get("source") == str(results.folder / one.file)
        results.keep(one.file, partial(save, result) if not there else lambda _: None)
        result = done[one.mass] = _saved(one, result)
        say(one.case_file.analysis.line(one.mass, result))
        if mesh := mesh_error(result):
            say(f"  {one.mass}: {mesh}")
        for name, text in missing_values(result).items():
            if name not in REASONS:
                raise ComputationError(f"{one.place}{name}: {text}", result)
            say(f"  {name}: {text}")
    told.issue()
    return done


def _saved(one: Computation, result: xarray.Dataset) -> xarray.Dataset:
    """Reopen a motion's result from its final file if checkpoints kept it on disk."""
    from foldyn.results import load

    keeping = one.compute.kept if isinstance(one.compute, MotionComputation) else None
    if keeping is None or not keeping.begun:
        return result
    keeping.remove()
    return load(keeping.file, whole=False)


def _introduction(
    case_file: CaseFile, told: Told, say: Callable[[str], None]
) -> Callable[[], None]:
    """Return a function that announces the run once, after all checks."""
    show = warnings.showwarning  # Python's function, even while warnings are collected

    @cache
    def introduce() -> None:
        with warnings.catch_warnings():
            warnings.showwarning = show
            told.issue()
        structure = case_file.case().structure
        parts = PARTS[case_file.model]
        counted = ", ".join(f"{len(getattr(structure, part))} {part}" for part in parts)
        say(f"{case_file.title or case_file.path.name}: {counted}")
        if case_file.choice.told:
            say(f"  model: {case_file.choice.told}")

    return introduce
