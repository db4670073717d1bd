"""`foldyn run`: a case file from reading to report."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from foldyn.analyses import ANALYSES, CaseFile, Computation, read_case
from foldyn.cli.folder import Results, held, reason
from foldyn.cli.speech import speech
from foldyn.cli.stamp import Owner
from foldyn.errors import ComputationError, FoldynError, InputError, MotionInterrupted
from foldyn.studies import find_case

if TYPE_CHECKING:
    import xarray

PARTS: Mapping[str, tuple[str, ...]] = {
    "bars_and_hinges": ("nodes", "bars", "folds", "bends"),
    "shell": ("nodes", "triangles", "folds"),
}
"""What is counted of the structure of each model."""
DRAWN = (
    "report.html", "structure.png", "laws.png",
    *(name for kind in ANALYSES.values() for name in kind.files),
)  # fmt: skip
"""All that pages come with."""


def run(
    case: str,
    out: str | None,
    figures: bool = True,
    quiet: bool = False,
    read: Callable[[Path], CaseFile] = read_case,
    results: str = "results",
    command: str = "run",
    replace: bool = False,
) -> Path:
    """Run a case file and write its results; returns their folder, by default NAME-`results`.

    Everything is checked before the first step is computed and before anything is written. The
    folder is stamped with the command and the case file: others' results in it are refused, or
    replaced where that is asked for.
    """
    path = find_case(case)
    folder = Path(f"{path.stem}-{results}" if out is None else out)
    with warnings.catch_warnings(record=True) as told:  # bad input gets its one message only
        case_file = read(path)
        task = [case_file.computation(mass) for mass in case_file.masses]
        with case_file.placing():
            case_file.analysis.check([one.compute for one in task], figures)
        if figures:
            _check_video(case_file)
    names = [one.file for one in task]
    say = speech(quiet)
    introduction = _Introduction(case_file, task, told, say)
    owner = Owner.of(command, path, folder)
    pages = ["report.html"] if figures else []
    with held(folder, out, [*names, *pages], owner, replace, DRAWN) as kept:
        done = _computed(task, kept, introduction, not quiet and sys.stderr.isatty(), say)
        say(f"wrote {', '.join(kept.kept)}")
        if figures:
            page = _drawn(case_file, done, folder, say)
            say(f"wrote figures and {page}")
    return folder


def _computed(
    task: list[Computation], results: Results, introduction: Callable[[], None], progress: bool,
    say: Callable[[str], None],
) -> dict[str, xarray.Dataset]:  # fmt: skip
    """Compute all there is, and save each result as soon as it is there."""
    done: dict[str, xarray.Dataset] = {}
    for one in task:
        try:
            done[one.mass] = one.run(progress, introduction)
        except (ComputationError, MotionInterrupted) as error:
            failed = type(error)(f"{one.place}{error}", error.partial)
            if error.partial is not None:
                error.partial.attrs.setdefault("stopped_because", str(error))
                _keep(error.partial, one, results)
            raise failed from None
        result = done[one.mass]
        _keep(result, one, results)
        say(one.case_file.analysis.line(one.mass, result))
        _tell_missing(one.place, result, say)
    return done


def _keep(result: xarray.Dataset, one: Computation, results: Results) -> None:
    from foldyn.results import save

    results.keep(one.file, partial(save, result))


def _tell_missing(place: str, result: xarray.Dataset, say: Callable[[str], None]) -> None:
    """Say which values a result lacks; it has failed where it may lack none."""
    from foldyn.results.quantities import REASONS, missing_values

    for name, text in missing_values(result).items():
        if name not in REASONS:
            raise ComputationError(f"{place}{name}: {text}", result)
        say(f"  {name}: {text}")


def _drawn(
    case_file: CaseFile,
    done: Mapping[str, xarray.Dataset],
    folder: Path,
    say: Callable[[str], None],
) -> Path:
    """Draw the figures; whatever keeps them from being drawn, the results are there."""
    try:
        say("drawing figures")
        return case_file.analysis.page(case_file, done, folder)
    except KeyboardInterrupt:
        raise KeyboardInterrupt("interrupted while figures were drawn") from None
    except Exception as error:
        kind = "" if isinstance(error, FoldynError | OSError) else f"{type(error).__name__}: "
        raise ComputationError(f"{case_file.path}: figures: {kind}{reason(error)}") from None


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
        task: list[Computation],
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
        if self.case_file.analysis.compiles([one.compute for one in self.task]):
            self.say(
                "compiling the kernels: first use, up to half a minute; they are kept for later "
                "runs"
            )
