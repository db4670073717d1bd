"""`foldyn convert`: a pattern file read, checked, and written in another format."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from foldyn.cli.options import add_switches, flag
from foldyn.cli.streams import speech
from foldyn.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from foldyn.formats import Frame
    from foldyn.patterns import Pattern

RESULT = ".nc"


def add_convert(commands: Any) -> None:
    """Add the arguments of `foldyn convert`."""
    command = commands.add_parser(
        "convert",
        help="read a pattern file, check it, write it in another format",
        description="Read a pattern file and write it in the format that the ending of OUT names; "
        "a result (.nc) is written with all of its states, or in one of them. --check says what "
        "was assumed, repaired and doubted, with the conditions of flat folding at each vertex.",
    )
    command.add_argument("file", metavar="IN", help="pattern file, or a motion or path (.nc)")
    command.add_argument("out", metavar="OUT", nargs="?", help="file to make or to replace")
    flag(command, "--check", "print the diagnosis; without OUT, write nothing")
    command.add_argument("--scale", type=float, help="factor on all lengths")
    command.add_argument("--unit", help="unit of the coordinates of IN: mm, cm, m, in, ...")
    command.add_argument("--frame", help="number or title of the frame, or number of the sample")
    command.add_argument("--every", type=int, help="of a result, take every such sample (1)")
    add_switches(command, figures=False)


def convert(given: argparse.Namespace) -> None:
    """Do what the arguments of `add_convert` ask for."""
    from foldyn.formats import write_pattern

    if given.out is None and not given.check:
        raise InputError(": missing; name the file to write, or give --check", "OUT")
    source = Path(given.file)
    is_result = source.suffix.lower() == RESULT
    pattern, frames = (_states if is_result else _pattern)(given, source)
    if given.out is not None:
        write_pattern(given.out, pattern, frames)
        more = f", {len(frames)} frames" if frames else ""
        speech(given.quiet)(
            f"wrote {given.out}: {len(pattern.vertices)} vertices, {len(pattern.faces)} panels, "
            f"{len(pattern.creases)} creases{more}"
        )


def _pattern(given: argparse.Namespace, source: Path) -> tuple[Pattern, Sequence[Frame]]:
    """Pattern of a file; its diagnosis is printed, or warned of."""
    from foldyn.formats import diagnose, read_pattern

    if given.every is not None:
        raise InputError(": only for results (.nc); leave it out", "--every")
    frame = int(given.frame) if given.frame and given.frame.isdecimal() else given.frame
    if not given.check:
        return read_pattern(source, given.scale, given.unit, frame, "line"), ()
    pattern, diagnosis = diagnose(source, given.scale, given.unit, frame, "line")
    print(f"{source}: {pattern!r}")
    print(diagnosis)
    return pattern, ()


def _states(given: argparse.Namespace, source: Path) -> tuple[Pattern, Sequence[Frame]]:
    """Pattern of a result with its states, or in one of them."""
    from foldyn.formats import FORMATS
    from foldyn.results import frames_of, load, state_of

    for name in ("check", "scale", "unit"):
        if getattr(given, name):
            raise InputError(": only for pattern files; leave it out", f"--{name}")
    if given.frame is not None and not given.frame.isdecimal():
        raise InputError(f" = {given.frame}: give the number of a sample, from 0", "--frame")
    result = load(source)
    fmt = FORMATS.get(Path(given.out).suffix.lower())
    if given.frame is None and (fmt is None or fmt.frames):
        return frames_of(result, 1 if given.every is None else given.every)
    if given.every is not None:
        raise InputError(": only where all states are written, as .fold", "--every")
    return state_of(result, None if given.frame is None else int(given.frame)), ()
