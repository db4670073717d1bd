"""Options that several commands share."""

from __future__ import annotations

import argparse
from typing import Any

from foldyn.plots import ANIMATIONS, FIGURES
from foldyn.values import parsed


def number(text: str) -> float:
    """Number of an option; its name stands in argparse's message."""
    return parsed(text)


def integer(text: str) -> int:
    """Whole number of an option."""
    return parsed(text, int)


def flag(command: argparse.ArgumentParser, name: str, text: str) -> None:
    """Add an option without a value."""
    command.add_argument(name, action="store_true", help=text)


def add_results(command: argparse.ArgumentParser, default: str, figures: bool = True) -> None:
    """Add what all commands take that write a folder of results, `default` unless it is given."""
    command.add_argument("--out", help=f"folder of the results (default: {default})")
    flag(command, "--replace", "replace results of another file or command that the folder holds")
    add_switches(command, figures)


def add_reading(
    command: argparse.ArgumentParser, frame: str, scale: str = "factor on all lengths"
) -> None:
    """Add how a pattern file is read; `frame` and `scale` say what these are for."""
    command.add_argument("--scale", type=number, help=scale)
    command.add_argument("--unit", help="unit of the coordinates of the file: mm, cm, m, in, ...")
    command.add_argument("--frame", help=frame)
    command.add_argument(
        "--tolerance", type=number, help="distance (m) within which points of the file are one"
    )
    flag(command, "--flat-foldable", "move vertices to the nearest places that fold flat")


def reading_of(given: argparse.Namespace) -> dict[str, Any]:
    """Arguments of `read_pattern` that `add_reading` takes."""
    return {
        "scale": given.scale, "unit": given.unit, "frame": frame_of(given.frame),
        "tolerance": given.tolerance, "flat_foldable": given.flat_foldable,
    }  # fmt: skip


def frame_of(given: str | None) -> int | str | None:
    """Number or title of a frame."""
    if given is None or not (given.isascii() and given.isdecimal()):
        return given
    return int(given)


BOTH = "--figures: draws figures; leave out --no-figures"
"""Message where both are given."""


def add_figures(command: argparse.ArgumentParser) -> None:
    """Add the figures for papers."""
    command.add_argument("--figures", choices=FIGURES, help="draw figures too, beside the page")


def add_film(command: argparse.ArgumentParser) -> None:
    """Add the film of what moves."""
    command.add_argument(
        "--film", choices=ANIMATIONS, help="write the motion as a film too, beside its page"
    )


def add_switches(command: argparse.ArgumentParser, figures: bool = True) -> None:
    """Add what all commands take that compute; `main` acts on `--force`."""
    if figures:
        flag(command, "--no-figures", "write data only: no figures and no report")
    flag(command, "--quiet", "no progress bar and no summary")
    flag(command, "--force", "go on even if more than half of the memory is needed, as estimated")
