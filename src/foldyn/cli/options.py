"""Options shared by several commands."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from typing import Any

from foldyn.errors import InputError
from foldyn.plots import ANIMATIONS, FIGURES
from foldyn.values import parsed

READING = ("scale", "unit", "frame", "tolerance", "flat_foldable")
"""Options of `add_reading`, arguments of `read_pattern`."""


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


def add(
    command: argparse.ArgumentParser, kind: Callable[[str], Any], texts: Mapping[str, str],
    **more: Any,
) -> None:  # fmt: skip
    """Add options with their help texts, each by its name and metavars: "--frequencies A B"."""
    for name, text in texts.items():
        option, *words = name.split()
        metavar = tuple(words) if len(words) > 1 else "".join(words) or None
        own = {"nargs": len(words)} if len(words) > 1 else {}
        command.add_argument(option, type=kind, metavar=metavar, help=text, **own, **more)


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
    add(command, number, {"--scale": scale})
    add(command, str, {"--unit": "unit of the coordinates of the file: mm, cm, m, in, ..."})
    add(command, frame_of, {"--frame": frame})
    add(command, number, {"--tolerance": "distance (m) within which points of the file are one"})
    flag(command, "--flat-foldable", "move vertices to the nearest places that fold flat")


def reading(given: argparse.Namespace) -> dict[str, Any]:
    """Return the arguments for `read_pattern` from the options of `add_reading`."""
    return {key: getattr(given, key) for key in READING}


def frame_of(text: str) -> int | str:
    """Parse the number or title of a frame."""
    return int(text) if text.isascii() and text.isdecimal() else text


def add_figures(command: argparse.ArgumentParser) -> None:
    """Add options for figures in publication formats."""
    command.add_argument("--figures", choices=FIGURES, help="draw figures too, in this format")


def add_film(command: argparse.ArgumentParser) -> None:
    """Add the option for a film of the motion."""
    text = "write the motion as a film too, in this format"
    command.add_argument("--film", choices=ANIMATIONS, help=text)


def add_switches(command: argparse.ArgumentParser, figures: bool = True) -> None:
    """Add options of all commands that compute; `main` handles `--force`."""
    if figures:
        flag(command, "--no-figures", "write data only: no figures and no report")
    flag(command, "--quiet", "no progress bar and no summary")
    flag(command, "--force", "run even if more than half of the memory is needed, as estimated")
