"""The kinds of analysis that a case file may ask for, and what a file of each looks like."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BeforeValidator

from foldyn.cases.analyses import MotionSchema, PathSchema
from foldyn.cases.schema import CaseSchema
from foldyn.cases.vibrations import FrfSchema, ModesSchema
from foldyn.errors import InputError
from foldyn.values import choice

KINDS: Mapping[str, type[CaseSchema]] = {
    "dynamics": MotionSchema,
    "statics": PathSchema,
    "modes": ModesSchema,
    "frf": FrfSchema,
}
"""What a case file of each kind looks like."""


def _known_kind(value: Any) -> Any:
    """Refuse an analysis whose kind is missing or unknown."""
    if not isinstance(value, Mapping):
        return value
    if "kind" not in value:
        raise InputError(f".kind: missing; choose one of {', '.join(KINDS)}")
    choice(".kind", value["kind"], KINDS)
    return value


class UnknownSchema(CaseSchema):
    """A case file that does not say its kind: the sections of its kind are left alone."""

    initial: Any = None
    drive: Any = None
    analysis: Annotated[dict[str, Any], BeforeValidator(_known_kind)]
    output: Any = None


def schema_of(document: Mapping[str, Any]) -> type[CaseSchema]:
    """Schema of a case file by the kind that it names."""
    analysis = document.get("analysis")
    kind = analysis.get("kind") if isinstance(analysis, Mapping) else None
    return KINDS.get(kind, UnknownSchema) if isinstance(kind, str) else UnknownSchema
