"""`foldyn convert`: a pattern file, a result or a case, written in another format."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from foldyn.cli.options import add, add_reading, add_switches, flag, integer, number, reading
from foldyn.cli.streams import speech
from foldyn.errors import InputError
from foldyn.studies import find_case, shipped_cases

if TYPE_CHECKING:
    from collections.abc import Sequence

    from foldyn.cases import Case

RESULT = ".nc"
HDF5 = b"\x89HDF\r\n\x1a\n"
"""First bytes of a NetCDF file."""
PATTERNS_ONLY = ("check", "unit", "tolerance", "flat_foldable")
RESULTS_ONLY = ("format", "every", "frames", "seconds", "rows", "fields", "nodes")
DECKS_ONLY = ("divisions", "modes", "element")
"""Options that apply to one kind of files only."""


def add_convert(commands: Any) -> None:
    """Add the arguments of `foldyn convert`."""
    command = commands.add_parser(
        "convert",
        help="write a pattern file or a result in another format",
        description="Read a pattern file, or a result (.nc), and write it in the format that the "
        "ending of OUT names; a case file becomes an input deck (.inp, .tcl) or a model of MuJoCo "
        "(.xml). --check says what was assumed of a pattern file, repaired and doubted, with the "
        "conditions of flat folding at each vertex.",
    )
    command.add_argument("file", metavar="IN", help="pattern file, result (.nc) or case file")
    command.add_argument("out", metavar="OUT", nargs="?", help="file to make or to replace")
    flag(command, "--check", "print the diagnosis; without OUT, write nothing")
    add_reading(
        command,
        "number or title of the frame, or number of the sample",
        "factor on all lengths, or displacements of a result",
    )
    add(command, str, {"--format": "format of a result, where the ending does not name it"})
    add(command, integer, {
        "--every": "of a result, take every such sample",
        "--frames": "of a result, take so many samples, evenly",
    })  # fmt: skip
    add(command, number, {"--seconds": "how long an animation (.glb) takes"})
    add(command, str, {
        "--rows": "of tables, what a row is for: time,node (default), time",
        "--fields": "of a result, these variables: displacement,velocity",
        "--nodes": "of a result, these nodes: 0,7,12, or a selection: xmax",
    })  # fmt: skip
    add(command, integer, {
        "--divisions": "of input decks, pieces of every edge (16)",
        "--modes": "of input decks, how many frequencies (6)",
    })  # fmt: skip
    add(command, str, {"--element": "of Abaqus, kind of the triangles: STRI3 (default), S3"})
    add_switches(command, figures=False)


def convert(given: argparse.Namespace) -> None:
    """Run `foldyn convert` with the arguments of `add_convert`."""
    if given.out is None and not given.check:
        raise InputError(": missing; name the file to write, or give --check", "OUT")
    source = Path(given.file)
    if _is_result(source):
        _export(given, source)
    elif given.file.endswith(".toml") or (given.file in shipped_cases() and not source.exists()):
        from foldyn.analyses import read_case

        _export(given, read_case(find_case(given.file)).case())
    else:
        _convert_pattern(given, source)


def _is_result(source: Path) -> bool:
    """Whether a file is a result, judged by its suffix or its first bytes."""
    if source.suffix.lower() == RESULT:
        return True
    try:
        with source.open("rb") as file:
            return file.read(len(HDF5)) == HDF5
    except OSError:  # the reader reports it
        return False


def _export(given: argparse.Namespace, what: Path | Case) -> None:
    """Write a result or a case in the format of another program."""
    from foldyn.exports import export

    _refuse(given, PATTERNS_ONLY, "pattern files")
    if isinstance(given.frame, str):
        raise InputError(f" = {given.frame}: give the number of a sample, from 0", "--frame")
    options = {key: getattr(given, key) for key in (*RESULTS_ONLY, *DECKS_ONLY, "scale", "frame")}
    try:
        files = export(what, given.out, **options)
    except InputError as error:
        raise error.within("--" if error.key in options else "") from None
    speech(given.quiet)(f"wrote {_listed(files)}")


def _refuse(given: argparse.Namespace, names: Sequence[str], kind: str) -> None:
    """Refuse options that apply to another kind of files."""
    for name in names:
        value = getattr(given, name)
        if value is not None and value is not False:
            raise InputError(f": only for {kind}; leave it out", f"--{name.replace('_', '-')}")


def _listed(files: Sequence[Path]) -> str:
    """Names and total size of files; of many files only the first and last name."""
    size = sum(file.stat().st_size for file in files)
    names = ", ".join(map(str, files))
    if len(files) > 3:
        names = f"{files[0]} to {files[-1].name} ({len(files)} files)"
    return f"{names}: {size / 1e3:.4g} kB"


def _convert_pattern(given: argparse.Namespace, source: Path) -> None:
    """Write a pattern file in another format; print the diagnosis of the pattern or warn of it."""
    from foldyn.formats import diagnose, read_pattern, write_pattern

    _refuse(given, RESULTS_ONLY, "results (.nc)")
    _refuse(given, DECKS_ONLY, "input decks (.inp, .tcl)")
    if given.check:
        pattern, diagnosis = diagnose(source, facets="line", **reading(given))
        print(f"{source}: {pattern!r}")
        print(diagnosis)
    else:
        pattern = read_pattern(source, facets="line", **reading(given))
    if given.out is not None:
        write_pattern(pattern, given.out)
        speech(given.quiet)(
            f"wrote {given.out}: {len(pattern.vertices)} vertices, {len(pattern.faces)} panels, "
            f"{len(pattern.creases)} creases"
        )
