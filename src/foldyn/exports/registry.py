"""Export formats for other programs, and `export`, which selects one."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import xarray as xr

from foldyn.cases import Case
from foldyn.errors import InputError
from foldyn.exports import abaqus, csv_tables, glb, mat, mjcf, opensees, pattern_states, uff, vtkhdf
from foldyn.exports.chosen import ALONG
from foldyn.input_files import path_of
from foldyn.results import case_of, check_result, load
from foldyn.values import choice, suggest
from foldyn.viewer.stage import folding_case
from foldyn.writing import target_of


@dataclass(frozen=True)
class Export:
    """A format of another program, for results.

    Parameters
    ----------
    name : str
        Name of the format, such as "glb".
    suffixes : tuple of str
        File suffixes, lower case with the dot.
    kinds : tuple of str
        Kinds of results that the format can hold, as in the keys of `chosen.ALONG`.
    write : callable
        ``write(result, path, case, **options)`` writes the file, or several, and returns their
        paths. Its keyword-only arguments are the options of the format.
    doc : str
        Purpose of the format, in a few words.
    needs_case : bool
        Whether `write` needs the case of the result; otherwise it gets None, so that results
        without a rebuildable case can be exported too.
    of_cases : bool
        Whether `write` needs only the case, which can then be exported without a result.
    in_place_of : tuple of str
        Suffixes of unsupported formats whose readers accept this one.
    """

    name: str
    suffixes: tuple[str, ...]
    kinds: tuple[str, ...]
    write: Callable[..., list[Path]]
    doc: str
    needs_case: bool = True
    of_cases: bool = False
    in_place_of: tuple[str, ...] = ()

    @property
    def options(self) -> tuple[str, ...]:
        """Names of the options of the format."""
        arguments = inspect.signature(self.write).parameters.values()
        return tuple(each.name for each in arguments if each.kind is each.KEYWORD_ONLY)


SHAPES = ("trajectory", "path", "modes", "folding")
"""Kinds of results with shapes."""
OF_SHEETS = tuple(kind for kind in ALONG if kind != "folding")
"""Kinds of results with a case; a folding only has a pattern."""

_EXPORTS = (
    Export("glb", (".glb",), SHAPES, glb.write, "an animation for Blender and browsers"),
    Export(
        "pattern",
        pattern_states.SUFFIXES,
        SHAPES,
        pattern_states.write,
        "states as patterns: frames of a FOLD file, a series of OBJ or STL files",
        needs_case=False,
    ),
    Export(
        "vtkhdf",
        (".vtkhdf",),
        SHAPES,
        vtkhdf.write,
        "all samples and fields, for ParaView",
        in_place_of=(".vtk", ".vtu", ".vtp", ".pvd", ".xdmf"),
    ),
    Export("csv", (".csv",), tuple(ALONG), csv_tables.write, "tidy tables", needs_case=False),
    Export("mat", (".mat",), tuple(ALONG), mat.write, "MATLAB, Octave", needs_case=False),
    Export(
        "uff",
        (".uff", ".unv"),
        ("modes", "frf", "trajectory"),
        uff.write,
        "universal files, for modal software",
        needs_case=False,
    ),
    Export("opensees", (".tcl",), OF_SHEETS, opensees.write, "OpenSees: the shell", of_cases=True),
    Export(
        "abaqus",
        (".inp",),
        (*OF_SHEETS, "effective"),
        abaqus.write,
        "Abaqus: the shell, or effective properties as a section",
        of_cases=True,
    ),
    Export("mjcf", (".xml",), OF_SHEETS, mjcf.write, "MuJoCo: rigid panels", of_cases=True),
)

EXPORTS: dict[str, Export] = {each.name: each for each in _EXPORTS}
"""The formats by name."""
BY_SUFFIX: dict[str, Export] = {end: each for each in _EXPORTS for end in each.suffixes}


def export(
    result: xr.Dataset | Case | str | os.PathLike[str],
    path: str | os.PathLike[str],
    *,
    format: str | None = None,
    **options: Any,
) -> list[Path]:
    """Write a result in a format of another program.

    Parameters
    ----------
    result : xarray.Dataset, Case or path-like
        A result or its file; for input decks a case is enough.
    path : path-like
        The file to make or to replace; its folder must exist.
    format : str, optional
        Name of a format; by default the path's suffix chooses it.
    **options
        Options of the format; None selects its default.

    Returns
    -------
    list of Path
        The files written: several if each file holds a single state.

    Raises
    ------
    InputError
        The input is not a result, the format or an option is unknown, the format does not hold
        results of this kind, or the file cannot be written.

    Examples
    --------
    >>> fd.export("run.nc", "run.glb")  # doctest: +SKIP
    """
    file = _file(path)
    chosen = _format_of(file, format)
    given = {name: value for name, value in options.items() if value is not None}
    for name in given:
        if name not in chosen.options:
            known = ", ".join(chosen.options) or "none"
            raise InputError(
                f": not an option of the format {chosen.name}; "
                f"{suggest(name, chosen.options)}it has {known}",
                name,
            )
    if not isinstance(result, xr.Dataset | Case):
        source = path_of(result, "result")
        if file.exists() and source.exists() and file.samefile(source):
            raise InputError(f"{file}: is the result itself; name another file")
        result = load(source)
    case = _case_for(chosen, result)
    try:
        return chosen.write(result, file, case, **given)
    except OSError as error:
        raise InputError(
            f"{file}: cannot be written: {error.strerror or error}; check that its folder may be "
            "written to"
        ) from error


def _case_for(chosen: Export, result: xr.Dataset | Case) -> Case | None:
    """Case of the exported result, if the format needs it; refuse unsupported kinds."""
    if isinstance(result, Case):
        if chosen.of_cases:
            return result
        raise InputError(
            f": is a case, and the format {chosen.name} holds computed results; give a "
            "result, as fd.simulate returns it",
            "result",
        )
    check_result(result, "result: ")
    kind = result.attrs["foldyn_result"]
    if kind not in chosen.kinds:
        able = [each.name for each in _EXPORTS if kind in each.kinds]
        raise InputError(
            f": is of kind {kind!r}, which the format {chosen.name} does not hold; it holds "
            f"{', '.join(chosen.kinds)}; formats for {kind!r}: {', '.join(able) or 'none'}",
            "result",
        )
    if not chosen.needs_case:
        return None
    return folding_case(result) if kind == "folding" else case_of(result)


def _file(path: Any) -> Path:
    file = path_of(path, "path")
    if file.is_dir():
        raise InputError(f"{file}: is a folder; name a file in it")
    return target_of(file)


def _format_of(file: Path, name: str | None) -> Export:
    """Format by name, or by the file's suffix."""
    if name is not None:
        return EXPORTS[choice("format", name, EXPORTS)]
    found = BY_SUFFIX.get(file.suffix.lower())
    if found is None:
        has = f"has the unknown extension {file.suffix!r}" if file.suffix else "has no extension"
        near = [one for one in _EXPORTS if file.suffix.lower() in one.in_place_of]
        instead = [f"write {file.stem}{one.suffixes[0]}: {one.doc}; " for one in near]
        known = ", ".join(sorted(BY_SUFFIX))
        raise InputError(f"{file}: {has}; {''.join(instead)}results go to {known}")
    return found
