"""What commands say while they run."""

from __future__ import annotations

from collections.abc import Callable


def speech(quiet: bool) -> Callable[[str], None]:
    """Print a line at once, or nothing where it is to be quiet."""
    return silence if quiet else _say


def silence(text: str) -> None:
    """Say nothing."""


def _say(text: str) -> None:
    print(text, flush=True)
