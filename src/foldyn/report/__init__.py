"""Reports: one self-contained HTML page of text, tables and pictures."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from foldyn.report.page import write_report
from foldyn.report.sections import Heading, Picture, Section, Table, Text

if TYPE_CHECKING:
    from foldyn.report.frf import write_responses
    from foldyn.report.modes import write_modes
    from foldyn.report.motion import write_motion
    from foldyn.report.path import write_path

__all__ = [
    "Heading",
    "Picture",
    "Section",
    "Table",
    "Text",
    "write_modes",
    "write_motion",
    "write_path",
    "write_report",
    "write_responses",
]

_HOMES = {
    "write_modes": "modes",
    "write_motion": "motion",
    "write_path": "path",
    "write_responses": "frf",
}
"""What needs the case file's schema and the plots, and is loaded when first used."""


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
