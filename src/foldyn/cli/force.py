"""`--force` of the commands that run case files."""

from __future__ import annotations

import argparse


def add_force(command: argparse.ArgumentParser) -> None:
    """Add the argument; `main` acts on it."""
    command.add_argument(
        "--force",
        action="store_true",
        help="go on where more than half of the memory is needed, as estimated",
    )
