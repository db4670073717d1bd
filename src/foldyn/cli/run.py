"""`foldyn run`: a case file from reading to report."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from foldyn.cases.casefile import CaseFile, read_case
from foldyn.errors import ComputationError, InputError
from foldyn.studies import find_case

if TYPE_CHECKING:
    import xarray


def run(case: str, out: str | None, figures: bool = True, quiet: bool = False) -> Path:
    """Run a case file and write its results; returns their folder.

    Everything is checked before the first step is computed and before anything is written.
    """
    from foldyn.dynamics import compiled, prepare

    path = find_case(case)
    case_file = read_case(path)
    folder = Path(out) if out is not None else Path(f"{path.stem}-results")
    _check_folder(folder)
    method = case_file.analysis.arguments["method"]
    motions = {}
    for rule in case_file.masses:
        try:
            motions[rule] = prepare(case_file.case(rule), **case_file.analysis.arguments)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None
    say = _nothing if quiet else _say
    say(_headline(case_file))
    if not compiled(method):
        say("compiling the kernels: first use, up to half a minute; they are kept for later runs")
    results: dict[str, xarray.Dataset] = {}
    failure = None
    for rule, motion in motions.items():
        try:
            results[rule] = motion.run(progress=not quiet and sys.stderr.isatty())
        except ComputationError as error:
            failure = (rule, error)
            break
        say(_line(rule, results[rule]))
    kept = _save(folder, case_file, results, failure)
    if failure is not None:
        rule, error = failure
        raise ComputationError(
            f"{path}: mass = {rule!r}: {error}\nfoldyn: kept what was computed: {', '.join(kept)}",
            error.partial,
        ) from None
    if figures:
        from foldyn.report import write_motion

        say("drawing figures")
        page = write_motion(case_file, results, folder)
        say(f"wrote {', '.join(kept)}, figures and {page}")
    else:
        say(f"wrote {', '.join(kept)}")
    return folder


def _check_folder(folder: Path) -> None:
    """Refuse a results folder that cannot be written, before anything is computed."""
    if folder.exists() and not folder.is_dir():
        raise InputError(f"--out {folder}: is a file; name a folder")
    above = folder
    while not above.exists():
        above = above.parent
    if not os.access(above, os.W_OK):
        raise InputError(f"--out {folder}: {above} may not be written; name another folder")


def _save(
    folder: Path,
    case_file: CaseFile,
    results: dict[str, xarray.Dataset],
    failure: tuple[str, ComputationError] | None,
) -> list[str]:
    """Write the results, a partial one included; returns the files' names."""
    from foldyn.results import save

    folder.mkdir(parents=True, exist_ok=True)
    everything = dict(results)
    if failure is not None and failure[1].partial is not None:
        everything[failure[0]] = failure[1].partial
    single = len(case_file.masses) == 1
    kept = []
    for rule, result in everything.items():
        file = folder / ("result.nc" if single else f"result-{rule}.nc")
        save(result, file)
        kept.append(str(file))
    return kept


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
