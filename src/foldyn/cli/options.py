"""Options shared by several commands."""

from __future__ import annotations

import argparse
from typing import Any

from foldyn.errors import InputError
from foldyn.plots import ANIMATIONS, FIGURES
from foldyn.values import parsed


def number(text: str) -> float:
    """Parse a number; argparse uses the name of this function in its message."""
    return parsed(text)


def integer(text: str) -> int:
    """Parse a whole number."""
    return parsed(text, int)


def halves(text: str, option: str) -> tuple[str, str]:
    """Parse a key of a case file and the text after its "="."""
    key, equals, rest = text.partition("=")
    if not equals or not rest.strip():
        raise InputError(f'{option} "{text}": write KEY=..., with a key of the case file')
    return key.strip(), rest.strip()


def flag(command: argparse.ArgumentParser, name: str, text: str) -> None:
    """Add a switch, an option without a value."""
    command.add_argument(name, action="store_true", help=text)


def add_results(command: argparse.ArgumentParser, default: str, figures: bool = True) -> None:
    """Add options for writing a results folder, `default` unless given."""
    command.add_argument("--out", help=f"folder of the results (default: {default})")
    flag(command, "--replace", "replace results of another file or command that the folder holds")
    add_switches(command, figures)


def add_reading(
    command: argparse.ArgumentParser, frame: str, scale: str = "factor on all lengths"
) -> None:
    """Add options for reading a pattern file; `frame` and `scale` are their help texts."""
    command.add_argument("--scale", type=number, help=scale)
    command.add_argument("--unit", help="unit of the coordinates of the file: mm, cm, m, in, ...")
    command.add_argument("--frame", help=frame)
    command.add_argument(
        "--tolerance", type=number, help="distance (m) within which points of the file are one"
    )
    flag(command, "--flat-foldable", "move vertices to the nearest places that fold flat")


def reading_of(given: argparse.Namespace) -> dict[str, Any]:
    """Return the arguments for `read_pattern` from the options of `add_reading`."""
    return {
        "scale": given.scale, "unit": given.unit, "frame": frame_of(given.frame),
        "tolerance": given.tolerance, "flat_foldable": given.flat_foldable,
    }  # fmt: skip


def frame_of(given: str | None) -> int | str | None:
    """Parse the number or title of a frame."""
    if given is None or not (given.isascii() and given.isdecimal()):
        return given
    return int(given)


def add_figures(command: argparse.ArgumentParser) -> None:
    """Add options for figures in publication formats."""
    command.add_argument("--figures", choices=FIGURES, help="draw figures too, in this format")


def add_film(command: argparse.ArgumentParser) -> None:
    """Add the option for a film of the motion."""
    command.add_argument(
        "--film", choices=ANIMATIONS, help="write the motion as a film too, in this format"
    )


def add_switches(command: argparse.ArgumentParser, figures: bool = True) -> None:
    """Add options of all commands that compute; `main` handles `--force`."""
    if figures:
        flag(command, "--no-figures", "write data only: no figures and no report")
    flag(command, "--quiet", "no progress bar and no summary")
    flag(command, "--force", "run even if more than half of the memory is needed, as estimated")
