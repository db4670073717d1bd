"""Foldyn's exceptions and warnings.

Bad input raises `InputError` (the command line exits with 2, nothing written); a computation
that fails raises `ComputationError` (exit status 1) and carries what was computed until then.
"""

from __future__ import annotations

from typing import Any

MOST_LINES, LONGEST_LINE = 20, 600
"""Limits of a message, in lines and in characters of a line."""


def shortened(message: str) -> str:
    """Return a message that a person can read: long ones lose lines, and the middle of lines."""
    lines = message.split("\n")
    if len(lines) > MOST_LINES:
        kept = lines[: MOST_LINES - 1]
        lines = [*kept, f"  ... and {len(lines) - len(kept)} lines more"]
    end = LONGEST_LINE // 3
    start = LONGEST_LINE - end - len(" ... ")
    cut = [a if len(a) <= LONGEST_LINE else f"{a[:start]} ... {a[-end:]}" for a in lines]
    return "\n".join(cut)


class FoldynError(Exception):
    """Base of everything that Foldyn raises on purpose."""

    def __init__(self, message: object = "") -> None:
        super().__init__(shortened(str(message)))


class InputError(FoldynError, ValueError):
    """The input cannot be used; the message names the field, the value and the remedy."""


class ComputationError(FoldynError, RuntimeError):
    """A computation failed.

    Attributes
    ----------
    partial : xarray.Dataset or None
        What was computed until the failure.
    """

    def __init__(self, message: str, partial: Any = None) -> None:
        super().__init__(message)
        self.partial = partial


class InstabilityError(ComputationError):
    """A motion grew without bound, became NaN, or left the range of its time step."""


class PenetrationError(ComputationError):
    """A hinge's dihedral jumped by more than pi: panel passed through panel."""


class MotionInterrupted(KeyboardInterrupt):
    """A motion was interrupted from the keyboard; `partial` has what was computed until then."""

    def __init__(self, message: str, partial: Any = None) -> None:
        super().__init__(message)
        self.partial = partial


class FoldynWarning(UserWarning):
    """Something works, but perhaps not as intended."""

    def __init__(self, message: object = "") -> None:
        super().__init__(shortened(str(message)))
