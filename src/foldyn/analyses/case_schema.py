"""JSON Schema of case files, from what their tables declare: editors complete keys by it."""

from __future__ import annotations

from typing import Any

from foldyn import __version__
from foldyn.analyses.registry import ANALYSES
from foldyn.json_schema import Schema, any_of, described, summary
from foldyn.tables import schema_of, table_under


def case_schema() -> Schema:
    """Schema (draft 7) of case files: of all kinds of analysis, and then of the kind at hand."""
    definitions: dict[str, Schema] = {}
    tables: list[dict[str, Schema]] = []
    kinds: list[Schema] = []
    for kind, analysis in ANALYSES.items():
        whole: Schema = schema_of(analysis.schema, definitions)
        tables.append(definitions[analysis.schema.__name__]["properties"])
        own: Any = table_under("analysis", analysis.schema)
        named = described({"enum": [kind]}, summary(analysis))
        definitions[own.__name__]["properties"]["kind"] = named
        at_hand = {"required": ["kind"], "properties": {"kind": {"enum": [kind]}}}
        condition = {"required": ["analysis"], "properties": {"analysis": at_hand}}
        kinds.append({"if": condition, "then": whole})
    keys = dict.fromkeys(key for one in tables for key in one)
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": f"Case file of Foldyn {__version__}",
        "type": "object",
        "required": ["analysis"],
        "properties": {key: any_of(one[key] for one in tables if key in one) for key in keys},
        "allOf": kinds,
        "definitions": definitions,
    }
