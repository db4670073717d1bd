"""Reports: one self-contained HTML page of text, tables and pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from foldyn.report.page import write_report
from foldyn.report.sections import Heading, Picture, Section, Table, Text

if TYPE_CHECKING:
    from foldyn.report.motion import write_motion

__all__ = ["Heading", "Picture", "Section", "Table", "Text", "write_motion", "write_report"]


def __getattr__(name: str) -> Any:
    if name == "write_motion":  # it needs the case file's schema and the plots
        from foldyn.report.motion import write_motion

        return write_motion
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
