"""`foldyn modes` and `foldyn frf`: small vibrations of a case file of any kind."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from foldyn.cases.casefile import CaseFile, placed
from foldyn.cases.kinds import KINDS, schema_of
from foldyn.cases.messages import describe
from foldyn.cases.models import remodeled
from foldyn.cases.reading import case_of_document, read_document
from foldyn.cases.vibrations import STATES
from foldyn.errors import FoldynWarning, InputError

Document = dict[str, Any]


def read_as(
    path: Path,
    kind: str,
    flags: Mapping[str, Any],
    model: str | None = None,
    divisions: int | None = None,
) -> CaseFile:
    """Read a case file of any kind as one of modes or of a frequency response.

    Parameters
    ----------
    path : Path
    kind : {"modes", "frf"}
    flags : mapping
        Keys of [analysis] that the command line gives instead of the file; `state` may be a
        result's file, too.
    model, divisions
        As of `read_case`.

    Warns
    -----
    FoldynWarning
        Loads, motions of the base or a start have no place there, and are left out.
    """
    document: Document = read_document(path)
    shape = schema_of(document)
    try:
        shape.model_validate(document, context={"folder": path.parent})
    except ValidationError as error:
        if shape is not KINDS[kind]:  # where it is, flags may give what is missing
            raise InputError(f"{path}: {describe(error, shape, KINDS)}") from None
    with placed(path, ""):
        document = remodeled(document, model, divisions)
    flags = {key: value for key, value in flags.items() if value is not None}
    if shape is not KINDS[kind]:
        document = _converted(path, document, kind, flags.get("state", "rest"))
    if kind == "frf" and not {"frequencies"} & {*flags, *document["analysis"]}:
        raise InputError(f"{path}: at which frequencies? Give --frequencies FIRST LAST COUNT (Hz)")
    return case_of_document(path, _flagged(document, flags))


def _flagged(document: Document, flags: Mapping[str, Any]) -> Document:
    """The document with what the command line says of its analysis."""
    analysis = {**document["analysis"], **flags}
    if "state" not in flags:
        return {**document, "analysis": analysis}
    others = {key: value for key, value in document.items() if key != "initial"}
    if flags["state"] in STATES:
        return {**others, "analysis": analysis}
    del analysis["state"]
    start = {"file": str(Path(flags["state"]).resolve())}
    return {**others, "analysis": analysis, "initial": start}


def _converted(path: Path, document: Document, kind: str, state: str) -> Document:
    """The document of another kind with what has a place in one of `kind`."""
    left: list[str] = []
    atrest = state == "rest"
    supports, bases = _supports(document.get("supports", []), atrest, left)
    loads = [_without(load, "history") for load in document.get("loads", [])]
    drive = [load for load in loads if kind == "frf" and "force" in load]
    if atrest:
        left += [f"loads[{i}]" for i, load in enumerate(loads) if load not in drive]
    if kind == "frf" and not drive:
        drive = [
            {"base": base["base"], "displacement": abs(base.get("displacement", 1.0))}
            for _, base in bases[:1]
        ]
        bases = bases[1:]
    left += [f"supports[{i}]" for i, _ in bases]
    if "initial" in document:
        left.append("[initial]")
    if left:
        why = (
            "nothing acts or moves in the state of rest (--state equilibrium takes the equilibrium "
            "under the loads)"
            if atrest
            else "what moves over time has no place in small vibrations about a state"
        )
        warnings.warn(
            f"{path}: foldyn {kind} leaves out {', '.join(left)}: {why}",
            FoldynWarning,
            stacklevel=3,
        )
    kept = _without(document, "initial", "drive", "output")
    kept |= {"supports": supports, "loads": [] if atrest else loads, "analysis": {"kind": kind}}
    kept["output"] = _shown(document.get("output", {}), kind)
    if kind == "modes":
        return kept
    if not drive:
        raise InputError(
            f"{path}: nothing drives a frequency response: the file has neither forces nor a base "
            'that moves; make a case file of analysis.kind = "frf" with [[drive]]'
        )
    return {**kept, "drive": drive}


def _supports(
    supports: list[Document], atrest: bool, left: list[str]
) -> tuple[list[Document], list[tuple[int, Document]]]:
    """Supports that hold or, not at rest, move nodes; and those that move the base."""
    kept, bases = [], []
    for i, support in enumerate(supports):
        if "base" in support:
            bases.append((i, support))
        elif "axis" in support and atrest:
            left.append(f"the displacement of supports[{i}]")
            kept.append({"nodes": support["nodes"], "axes": support["axis"]})
        else:
            kept.append(_without(support, "history"))
    return kept, bases


def _shown(output: Document, kind: str) -> Document:
    """What the figures show of what those of another kind do."""
    if kind == "modes":  # axis and nodes mean something else there
        return {key: output[key] for key in ("animation",) if key in output}
    shown = {key: output[key] for key in ("nodes", "axis") if key in output}
    return {**shown, "axis": shown["axis"][-1]} if "axis" in shown else shown


def _without(table: Document, *keys: str) -> Document:
    return {key: value for key, value in table.items() if key not in keys}
