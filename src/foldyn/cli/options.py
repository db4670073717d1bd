"""Options that several commands share."""

from __future__ import annotations

import argparse


def add_results(command: argparse.ArgumentParser, default: str, figures: bool = True) -> None:
    """Add what all commands take that write a folder of results, `default` unless it is given."""
    command.add_argument("--out", help=f"folder of the results (default: {default})")
    command.add_argument(
        "--replace",
        action="store_true",
        help="replace results of another file or command that the folder holds",
    )
    add_switches(command, figures)


def add_switches(command: argparse.ArgumentParser, figures: bool = True) -> None:
    """Add what all commands take that compute; `main` acts on `--force`."""
    if figures:
        command.add_argument(
            "--no-figures", action="store_true", help="write data only: no figures and no report"
        )
    command.add_argument("--quiet", action="store_true", help="no progress bar and no summary")
    command.add_argument(
        "--force",
        action="store_true",
        help="go on even if an estimate says that more than half of the memory is needed",
    )
