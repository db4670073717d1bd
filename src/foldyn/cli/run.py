"""`foldyn run`: a case file from reading to report."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from foldyn.cases.casefile import CaseFile
from foldyn.cases.reading import read_case
from foldyn.cli.folder import check_folder, remove_drawn, save_result
from foldyn.cli.motions import Motions
from foldyn.cli.paths import Paths
from foldyn.cli.runs import Task
from foldyn.cli.speech import speech
from foldyn.cli.vibrations import Modes, Responses
from foldyn.errors import ComputationError, InputError, MotionInterrupted
from foldyn.studies import find_case

if TYPE_CHECKING:
    import xarray

KINDS: Mapping[str, Callable[[CaseFile, bool], Task]] = {
    "dynamics": Motions,
    "statics": Paths,
    "modes": Modes,
    "frf": Responses,
}
"""What is computed for each kind of analysis."""
PARTS: Mapping[str, tuple[str, ...]] = {
    "bars_and_hinges": ("nodes", "bars", "folds", "bends"),
    "shell": ("nodes", "triangles", "folds"),
}
"""What is counted of the structure of each model."""


def run(
    case: str,
    out: str | None,
    figures: bool = True,
    quiet: bool = False,
    read: Callable[[Path], CaseFile] = read_case,
    results: str = "results",
) -> Path:
    """Run a case file and write its results; returns their folder, by default NAME-`results`.

    Everything is checked before the first step is computed and before anything is written.
    """
    path = find_case(case)
    folder = Path(f"{path.stem}-{results}" if out is None else out)
    with warnings.catch_warnings(record=True) as told:  # bad input gets its one message only
        case_file = read(path)
        task = KINDS[case_file.analysis.kind](case_file, figures)
        if figures:
            _check_video(case_file)
        names = [run.file for run in task.runs.values()]
        check_folder(folder, out, [*names, *(["report.html"] if figures else [])])
    say = speech(quiet)
    progress = not quiet and sys.stderr.isatty()
    introduction = _Introduction(case_file, task, told, say)
    done: dict[str, xarray.Dataset] = {}
    kept: list[str] = []
    for name, one in task.runs.items():
        try:
            done[name] = one.compute(progress, introduction)
        except (ComputationError, MotionInterrupted) as error:
            if error.partial is not None:
                error.partial.attrs.setdefault("stopped_because", str(error))
                kept.append(_keep(error.partial, folder, one.file, kept))
            failed = _failed(one.place, str(error), kept, error.partial)
            if isinstance(error, MotionInterrupted):
                raise MotionInterrupted(str(failed), error.partial) from None
            raise failed from None
        kept.append(_keep(done[name], folder, one.file, kept))
        say(one.line(done[name]))
        _tell_missing(one.place, done[name], kept, say)
    if not figures:
        say(f"wrote {', '.join(kept)}")
        return folder
    say("drawing figures")
    try:
        page = task.write(done, folder)
    except (InputError, ComputationError) as error:
        raise _failed(f"{path}: figures: ", str(error), kept) from None
    say(f"wrote {', '.join(kept)}, figures and {page}")
    return folder


def _check_video(case_file: CaseFile) -> None:
    """Refuse an animation in MP4 before anything is computed, if there is no ffmpeg to make it."""
    if case_file.output.animation != "mp4":
        return
    from foldyn.plots.writers import find_ffmpeg

    try:
        find_ffmpeg()
    except InputError as error:
        raise InputError(f'{case_file.path}: output.animation = "mp4": {error}') from None


class _Introduction:
    """Says what is run, once, when nothing is left to be refused."""

    def __init__(
        self,
        case_file: CaseFile,
        task: Task,
        told: list[warnings.WarningMessage],
        say: Callable[[str], None],
    ) -> None:
        self.case_file, self.task, self.told, self.say = case_file, task, told, say
        self.given = False

    def __call__(self) -> None:
        if self.given:
            return
        self.given = True
        for one in self.told:
            warnings.warn_explicit(one.message, one.category, one.filename, one.lineno)
        structure = self.case_file.case().structure
        parts = PARTS[self.case_file.model]
        counted = ", ".join(f"{len(getattr(structure, part))} {part}" for part in parts)
        self.say(f"{self.case_file.title or self.case_file.path.name}: {counted}")
        if self.task.compiles():
            self.say(
                "compiling the kernels: first use, up to half a minute; they are kept for later "
                "runs"
            )


def _tell_missing(
    place: str, result: xarray.Dataset, kept: list[str], say: Callable[[str], None]
) -> None:
    """Say which values a result lacks; it has failed where it may lack none."""
    from foldyn.results.missing import REASONS, told

    for name, text in told(result).items():
        if name not in REASONS:
            raise _failed(place, f"{name}: {text}", kept, result)
        say(f"  {name}: {text}")


def _keep(result: xarray.Dataset, folder: Path, file: str, kept: list[str]) -> str:
    """Write a result; with the first one the figures of an earlier run go."""
    if not kept:
        remove_drawn(folder)
    return save_result(result, folder / file)


def _failed(
    place: str, reason: str, kept: list[str], partial: xarray.Dataset | None = None
) -> ComputationError:
    told = f"\nfoldyn: kept what was computed: {', '.join(kept)}" if kept else ""
    return ComputationError(f"{place}{reason}{told}", partial)
