"""`foldyn run`: a case file from reading to report."""

from __future__ import annotations

import re
import sys
import tempfile
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

from foldyn.cases.casefile import CaseFile, read_case
from foldyn.errors import ComputationError, InputError, MotionInterrupted
from foldyn.studies import find_case

if TYPE_CHECKING:
    import xarray

    from foldyn.dynamics import Motion

FIGURES = ("structure", "laws", "load", "motion", "energies")  # those of report.write_motion
# where the case file has what the functions that it calls complain about
KEYS = {"duration": "analysis", "method": "analysis", "dt": "analysis", "every": "output"}


def run(case: str, out: str | None, figures: bool = True, quiet: bool = False) -> Path:
    """Run a case file and write its results; returns their folder.

    Everything is checked before the first step is computed and before anything is written.
    """
    from foldyn.dynamics import compiled

    path = find_case(case)
    folder = Path(f"{path.stem}-results" if out is None else out)
    with warnings.catch_warnings(record=True) as told:  # bad input gets its one message only
        case_file = read_case(path)
        motions = _motions(case_file, figures)
        names = {rule: _name(case_file, rule) for rule in motions}
        _check_folder(folder, out, [*names.values(), *(["report.html"] if figures else [])])
    for warning in told:
        warnings.warn_explicit(warning.message, warning.category, warning.filename, warning.lineno)
    say = _nothing if quiet else _say
    say(_headline(case_file))
    if not compiled(case_file.analysis.arguments["method"]):
        say("compiling the kernels: first use, up to half a minute; they are kept for later runs")
    for name in ("report.html", "motion.gif", *(f"{figure}.png" for figure in FIGURES)):
        (folder / name).unlink(missing_ok=True)  # of an earlier run: they would belie this one
    results: dict[str, xarray.Dataset] = {}
    kept: list[str] = []
    for rule, motion in motions.items():
        try:
            results[rule] = motion.run(progress=not quiet and sys.stderr.isatty())
        except (ComputationError, MotionInterrupted) as error:
            if error.partial is not None:
                error.partial.attrs["stopped_because"] = str(error)
                kept.append(_save(error.partial, folder / names[rule]))
            failed = _failed(_place(case_file, rule), str(error), kept, error.partial)
            if isinstance(error, MotionInterrupted):
                raise MotionInterrupted(str(failed), error.partial) from None
            raise failed from None
        kept.append(_save(results[rule], folder / names[rule]))
        say(_line(rule, results[rule]))
    if not figures:
        say(f"wrote {', '.join(kept)}")
        return folder
    from foldyn.report import write_motion

    say("drawing figures")
    try:
        page = write_motion(case_file, results, folder)
    except InputError as error:
        raise _failed(f"{path}: figures: ", str(error), kept) from None
    say(f"wrote {', '.join(kept)}, figures and {page}")
    return folder


def _motions(case_file: CaseFile, figures: bool) -> dict[str, Motion]:
    """Motions by mass rule, checked and ready to run."""
    from foldyn.dynamics import initial_state, prepare
    from foldyn.dynamics.timing import check_memory
    from foldyn.results import load
    from foldyn.signals.spectrum import MINIMUM_SAMPLES

    motions: dict[str, Motion] = {}
    for rule in case_file.masses:
        place = _place(case_file, rule)
        start = case_file.initial(rule, read=lambda path, at: initial_state(load(path), at))
        try:
            motion = prepare(case_file.case(rule), initial=start, **case_file.analysis.arguments)
        except InputError as error:
            raise InputError(place + _with_key(str(error))) from None
        samples = motion.expected_samples
        if figures and samples < MINIMUM_SAMPLES:
            raise InputError(
                f"{place}output.every: gives {samples} samples, spectra need {MINIMUM_SAMPLES}: "
                "lower it, lengthen analysis.duration, or run with --no-figures"
            )
        motions[rule] = motion
    case = case_file.case()
    try:  # all of them together
        check_memory(
            sum(motion.expected_samples for motion in motions.values()),
            len(case.structure.nodes),
            len(case.supported_dofs),
        )
    except InputError as error:
        raise InputError(f"{case_file.path}: {_with_key(str(error))}") from None
    return motions


def _place(case_file: CaseFile, rule: str) -> str:
    """Beginning of a message: the file, and the mass rule where there are several."""
    several = len(case_file.masses) > 1
    return f'{case_file.path}: mass = "{rule}": ' if several else f"{case_file.path}: "


def _with_key(message: str) -> str:
    """Put the section's name before a message that begins with the name of a key."""
    found = re.match(r"\w+", message)
    section = KEYS.get(found[0]) if found else None
    return message if section is None else f"{section}.{message}"


def _name(case_file: CaseFile, rule: str) -> str:
    return "result.nc" if len(case_file.masses) == 1 else f"result-{rule}.nc"


def _check_folder(folder: Path, out: str | None, names: list[str]) -> None:
    """Refuse a results folder that cannot be written, by trying; leaves nothing behind."""
    place = f"--out {folder}" if out is not None else f"results folder {folder}"
    if out == "":
        raise InputError("--out: is empty; name a folder")
    made: list[Path] = []
    try:
        for part in (*reversed(folder.parents), folder):
            if not part.exists():
                part.mkdir()
                made.append(part)
        if not folder.is_dir():
            raise InputError(f"{place}: is a file; name a folder")
        for name in names:
            if (folder / name).is_dir():
                raise InputError(
                    f"{place}: {folder / name} is a folder, a file of this name is to be written; "
                    "name another folder"
                )
        with tempfile.TemporaryFile(dir=folder):
            pass
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{place}: cannot be written ({reason}); name another folder") from None
    finally:
        for part in reversed(made):
            part.rmdir()


def _save(result: xarray.Dataset, file: Path) -> str:
    """Write a result into a folder that is made where needed; returns the file's name."""
    from foldyn.results import save

    file.parent.mkdir(parents=True, exist_ok=True)
    try:
        save(result, file)
    except InputError as error:  # the input was right, but the folder has changed since
        raise ComputationError(str(error), result) from None
    return str(file)


def _failed(
    place: str, reason: str, kept: list[str], partial: xarray.Dataset | None = None
) -> ComputationError:
    told = f"\nfoldyn: kept what was computed: {', '.join(kept)}" if kept else ""
    return ComputationError(f"{place}{reason}{told}", partial)


def _headline(case_file: CaseFile) -> str:
    structure = case_file.case().structure
    return (
        f"{case_file.title or case_file.path.name}: {len(structure.nodes)} nodes, "
        f"{len(structure.bars)} bars, {len(structure.folds)} folds, {len(structure.bends)} bends"
    )


def _line(rule: str, result: xarray.Dataset) -> str:
    a = result.attrs
    per_second = a["steps"] / max(a["wall_seconds"], 1e-9)
    return (
        f"  {rule}: {a['steps']} steps of {a['dt']:.3g} s (critical {a['critical_step']:.3g} s), "
        f"{per_second:,.0f} steps/s, energy error {a['energy_error']:.1e}"
    )


def _say(text: str) -> None:
    print(text, flush=True)


def _nothing(text: str) -> None:
    pass
