"""The kinds of analysis in case files, and the JSON Schema of case files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from foldyn import __version__, tables
from foldyn.analyses.bands import BandsAnalysis
from foldyn.analyses.buckling import BucklingAnalysis
from foldyn.analyses.casefile import Analysis
from foldyn.analyses.effective import EffectiveAnalysis
from foldyn.analyses.fidelity import FidelityAnalysis
from foldyn.analyses.frf import FrfAnalysis
from foldyn.analyses.modes import ModesAnalysis
from foldyn.analyses.motion import MotionAnalysis
from foldyn.analyses.path import PathAnalysis
from foldyn.analyses.random import RandomAnalysis
from foldyn.analyses.response import ResponseAnalysis
from foldyn.analyses.sections import CaseSchema
from foldyn.arguments import Check
from foldyn.errors import InputError
from foldyn.json_schema import Schema, any_of, described, summary
from foldyn.tables import check_table, table_under
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
        EffectiveAnalysis,
        FidelityAnalysis,
        BucklingAnalysis,
        RandomAnalysis,
    )
}
"""Analyses by `analysis.kind`."""


def _known_kind(name: str, value: Any) -> Any:
    """Refuse an analysis whose kind is missing or unknown."""
    if "kind" not in check_table(name, value):
        raise InputError(f": missing; choose one of {', '.join(ANALYSES)}", f"{name}.kind")
    return choice(f"{name}.kind", value["kind"], ANALYSES)


class UnknownSchema(CaseSchema):
    """A case file without a valid kind: sections that depend on the kind are not checked."""

    initial: Any = None
    drive: Any = None
    analysis: Annotated[Any, Check(_known_kind)]
    output: Any = None


def schema_of(document: Mapping[str, Any]) -> type[CaseSchema]:
    """Schema of a case file, by its kind."""
    analysis = document.get("analysis")
    kind = analysis.get("kind") if isinstance(analysis, Mapping) else None
    return ANALYSES[kind].schema if isinstance(kind, str) and kind in ANALYSES else UnknownSchema


def case_schema() -> Schema:
    """JSON Schema (draft 7) of case files, with stricter rules for each kind of analysis."""
    definitions: dict[str, Schema] = {}
    listed: list[dict[str, Schema]] = []
    kinds: list[Schema] = []
    for kind, analysis in ANALYSES.items():
        whole: Schema = tables.schema_of(analysis.schema, definitions)
        listed.append(definitions[analysis.schema.__name__]["properties"])
        own: Any = table_under("analysis", analysis.schema)
        named = described({"enum": [kind]}, summary(analysis))
        definitions[own.__name__]["properties"]["kind"] = named
        at_hand = {"required": ["kind"], "properties": {"kind": {"enum": [kind]}}}
        condition = {"required": ["analysis"], "properties": {"analysis": at_hand}}
        kinds.append({"if": condition, "then": whole})
    keys = dict.fromkeys(key for one in listed for key in one)
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": f"Case file of Foldyn {__version__}",
        "type": "object",
        "required": ["analysis"],
        "properties": {key: any_of(one[key] for one in listed if key in one) for key in keys},
        "allOf": kinds,
        "definitions": definitions,
    }
