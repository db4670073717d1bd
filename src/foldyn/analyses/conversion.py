"""Conversion of a case file to another model, or to an analysis of small vibrations."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from foldyn.analyses.vibration import STATES
from foldyn.cases.models import BARS_AND_HINGES, MODELS
from foldyn.dynamics import METHODS
from foldyn.errors import InputError, warn
from foldyn.structures import PRESETS, ModelOptions
from foldyn.values import choice

Document = dict[str, Any]


def flagged(document: Document, flags: Mapping[str, Any]) -> Document:
    """Add keys of [analysis] from the command line to the document."""
    analysis = {**document["analysis"], **flags}
    if "state" not in flags:
        return {**document, "analysis": analysis}
    others = {key: value for key, value in document.items() if key != "initial"}
    if flags["state"] in STATES:
        return {**others, "analysis": analysis}
    del analysis["state"]
    start = {"file": str(Path(flags["state"]).resolve())}
    return {**others, "analysis": analysis, "initial": start}


STARTLESS: Mapping[str, str] = {
    "fidelity": "small vibrations about rest are compared, and displacements under the loads",
    "response": (
        "periodic motions have no start, and [[loads]] and [[supports]] with a harmonic history "
        "drive them"
    ),
}
"""Kinds in which loads and supports stay, each with the reason why a start and a drive do not."""


def startless(path: Path, document: Document, kind: str) -> Document:
    """The document as an analysis in `STARTLESS`; warns that its start and drive are left out."""
    _tell(path, kind, _tables(document, "initial", "drive"), STARTLESS[kind])
    return {**_without(document, "initial", "drive", "output"), "analysis": {"kind": kind}}


def unbounded(path: Path, document: Document, kind: str, state: str) -> Document:
    """The document as the cell of an infinite sheet.

    Supports, which would hold every cell, and loads are left out with a warning, except for folding
    creases in an equilibrium.
    """
    loads = document.get("loads", [])
    kept_loads = [_without(each, "history") for each in loads if "creases" in each]
    kept_loads = [] if state == "rest" else kept_loads
    left = _tables(document, "contact", "air", "initial", "drive")
    left += ["[[supports]]"] if document.get("supports") else []
    left += ["[[loads]]"] if len(loads) > len(kept_loads) else []
    why = (
        "the pattern repeats without end, and what holds or loads one cell would be in all of them "
        '(a file of kind "bands" may have supports)'
    )
    _tell(path, kind, left, why)
    kept = _without(document, "contact", "air", "initial", "drive", "output", "supports", "loads")
    return {**kept, "loads": kept_loads, "analysis": {"kind": kind}}


def _tables(document: Document, *names: str) -> list[str]:
    """Names of the given tables that the document has."""
    return [f"[{name}]" for name in names if name in document]


def _tell(path: Path, command: str, left: list[str], why: str) -> None:
    """Warn if a command leaves out parts of a file."""
    if left:
        text = f"{path}: foldyn {command} leaves out {', '.join(left)}: {why}"
        warn(text, "command-line.md#modes-frequency-responses-and-bands")


ALIKE: Mapping[str, Mapping[str, tuple[str, ...]]] = {
    "modes": {"output": ("animation",)},  # axis and nodes mean something else there
    "frf": {"output": ("nodes", "axis")},
    "buckling": {"analysis": ("constant",)},
    "random": {"output": ("nodes",)},
}
"""Keys of tables that mean the same in another kind."""


def converted(path: Path, document: Document, kind: str, state: str) -> Document:
    """The document as another kind of analysis; a warning names parts that are left out."""
    if kind in STARTLESS:
        return startless(path, document, kind)
    if kind in ("bands", "effective"):
        return unbounded(path, document, kind, state)
    left: list[str] = []
    atrest = state == "rest" and kind != "buckling"
    supports, bases = _supports(document.get("supports", []), atrest, left)
    loads = [_without(load, "history") for load in document.get("loads", [])]
    drive = [load for load in loads if kind == "frf" and "force" in load]
    if atrest:
        steady = ["history" not in load for load in document.get("loads", [])]
        left += [f"loads[{i}]" for i, load in enumerate(loads) if steady[i] and load not in drive]
    if kind == "frf" and not drive and bases:
        (_, base), *bases = bases
        drive = [{"base": base["base"], "displacement": abs(base.get("displacement", 1.0))}]
    left += [f"supports[{i}]" for i, _ in bases]
    what = "buckling" if kind == "buckling" else "small vibrations"
    left += _tables(document, "initial")
    why = (
        "nothing acts or moves in the state of rest (--state equilibrium takes the equilibrium "
        "under the loads)"
        if atrest
        else f"what moves over time has no place in {what} about a state"
    )
    _tell(path, kind, left, why)
    kept = _without(document, "initial", "drive", "output")
    kept |= {"supports": supports, "loads": [] if atrest else loads, "analysis": {"kind": kind}}
    for name, keys in ALIKE[kind].items():
        alike = {key: value for key, value in document.get(name, {}).items() if key in keys}
        kept[name] = {**kept.get(name, {}), **alike}
    if kind != "frf":
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
    """Supports of nodes (moving ones only if not at rest), and supports that move the base."""
    kept, bases = [], []
    for i, support in enumerate(supports):
        if "base" in support:
            bases.append((i, support))
        elif "axis" in support and atrest:
            left.append(f"the displacement of supports[{i}]")
            own = {key: support[key] for key in ("nodes", "along") if key in support}
            kept.append({**own, "axes": support["axis"]})
        else:
            kept.append(_without(support, "history"))
    return kept, bases


def _without(table: Document, *keys: str) -> Document:
    return {key: value for key, value in table.items() if key not in keys}


def remodeled(
    document: Mapping[str, Any], model: str | None, divisions: int | None
) -> dict[str, Any]:
    """Case file for another model, or for a shell with other divisions.

    Parts without a meaning for the other model are left out: its unknown keys of [model], the mass
    rules, and for a shell explicit methods with their steps, and secant amplitudes.

    Parameters
    ----------
    document : mapping
        Content of the file; changed sections are valid, or are checked later.
    model : {"bars_and_hinges", "shell"}, optional
    divisions : int, optional
        Pieces of every edge of a shell.
    """
    changed = dict(document)
    given = document.get("model", {})
    if not isinstance(given, Mapping):
        return changed
    now = given.get("kind", BARS_AND_HINGES)
    kind = now if model is None else choice("model", model, MODELS)
    if kind != now:
        shared = set(MODELS[kind].keys) - {"mass"}
        creases = {} if "fold_law" in given else _fold_law_of(given.get("preset"))
        given = {**creases, **{key: value for key, value in given.items() if key in shared}}
    if kind != now and kind != BARS_AND_HINGES:
        changed["analysis"] = _without_bends(document["analysis"])
    finer = {} if divisions is None else {"divisions": divisions}
    named = {"kind": kind} if "kind" in given or model is not None or finer else {}
    changed["model"] = {**given, **named, **finer}
    return changed


def _fold_law_of(preset: str | None) -> Document:
    """Table with the fold law of a preset; empty if it is the default law."""
    law = None if preset is None else PRESETS[preset].fold_law
    if law in (None, ModelOptions().fold_law):
        return {}
    values = dict(vars(law))
    return {"fold_law": {"kind": values.pop("name"), **values}}


def _without_bends(analysis: Mapping[str, Any]) -> dict[str, Any]:
    """The table [analysis] without keys that have meaning only for bars and hinges."""
    left = {"secant"}
    key, usual = ("method", "auto") if analysis["kind"] == "dynamics" else ("integrator", "rk4")
    method = METHODS.get(analysis.get(key, usual))
    if method is not None and not method.implicit:
        left |= {key, "dt", "force"}
    return {key: value for key, value in analysis.items() if key not in left}
