"""The kinds of analysis that a case file may ask for."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from foldyn.analyses.bands import BandsAnalysis
from foldyn.analyses.casefile import Analysis
from foldyn.analyses.fidelity import FidelityAnalysis
from foldyn.analyses.frf import FrfAnalysis
from foldyn.analyses.modes import ModesAnalysis
from foldyn.analyses.motion import MotionAnalysis
from foldyn.analyses.path import PathAnalysis
from foldyn.analyses.response import ResponseAnalysis
from foldyn.analyses.sections import CaseSchema
from foldyn.arguments import Check
from foldyn.errors import InputError
from foldyn.tables import check_table
from foldyn.values import choice

ANALYSES: Mapping[str, type[Analysis]] = {
    analysis.kind: analysis
    for analysis in (
        MotionAnalysis,
        PathAnalysis,
        ModesAnalysis,
        FrfAnalysis,
        ResponseAnalysis,
        BandsAnalysis,
        FidelityAnalysis,
    )
}
"""By the name that `analysis.kind` has for them."""


def _known_kind(name: str, value: Any) -> Any:
    """Refuse an analysis whose kind is missing or unknown."""
    if "kind" not in check_table(name, value):
        raise InputError(f": missing; choose one of {', '.join(ANALYSES)}", f"{name}.kind")
    return choice(f"{name}.kind", value["kind"], ANALYSES)


class UnknownSchema(CaseSchema):
    """A case file that does not say its kind: the sections of its kind are left alone."""

    initial: Any = None
    drive: Any = None
    analysis: Annotated[Any, Check(_known_kind)]
    output: Any = None


def schema_of(document: Mapping[str, Any]) -> type[CaseSchema]:
    """Schema of a case file by the kind that it names."""
    analysis = document.get("analysis")
    kind = analysis.get("kind") if isinstance(analysis, Mapping) else None
    if isinstance(kind, str) and kind in ANALYSES:
        return ANALYSES[kind].schema
    return UnknownSchema
