"""The last part of every page: inputs, program, time and cost of the computation."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, is_dataclass
from datetime import datetime
from typing import Any

import numpy as np
import xarray

from foldyn.arguments import arguments
from foldyn.cases import Case, Contact, History
from foldyn.cases.units import units
from foldyn.linear.compared import percent
from foldyn.linear.reference import NO_LIMIT
from foldyn.materials.law import Law
from foldyn.plots.load_curves import history_name
from foldyn.report.album import ByRule
from foldyn.report.sections import Heading, Listing, Section, Table
from foldyn.structures import PanelSheet, Ply
from foldyn.values import plain

MOST_LISTED = 24
"""Largest number of entries of a list that are written individually."""
MOST = 200  # longest text of a value, in characters


@dataclass(frozen=True)
class Call:
    """The command or call that computed results, and its cost.

    Parameters
    ----------
    command : str
        Command as typed; "" in Python.
    warnings : tuple of str
        Warnings issued while the command or call ran.
    wall, cpu : float
        Wall time and processor time (s) from reading the case file to the last result.
    """

    command: str = ""
    warnings: tuple[str, ...] = ()
    wall: float = 0.0
    cpu: float = 0.0


def provenance(case_file: Any, results: ByRule, call: Call | None = None) -> list[Section]:
    """Table of all inputs that led to results of a `CaseFile`, and the text of the file."""
    rows = inputs(case_file, case_file.case(next(iter(results))), results)
    rows += computed(results, call or Call())
    sections: list[Section] = [Heading("How it was computed"), inputs_table(rows)]
    if case_file.text:
        sections.append(Listing(f"The case file {case_file.path.name}", case_file.text))
    return sections


def inputs_table(rows: Iterable[tuple[str, str]]) -> Table:
    """Table of the parts of a computation; parts without a description are left out."""
    return Table(["part", "as computed"], [[*row] for row in rows if row[1]], sorts=False)


def inputs(case_file: Any, case: Case, results: ByRule) -> list[tuple[str, str]]:
    """Pattern, sheet, model, supports, loads, damping, analysis of a `CaseFile`, in words."""
    structure = case.structure
    model = vars(structure.options) | {"mass": ", ".join(results)}
    pattern = structure.pattern
    counts = [
        (len(pattern.vertices), "vertices"), (len(pattern.faces), "panels"),
        (len(pattern.creases), "creases"), (len(structure.nodes), "nodes"),
        *((len(getattr(structure, part, ())), part) for part in ("bars", "folds", "bends")),
    ]  # fmt: skip
    counted = ", ".join(f"{count} {what}" for count, what in counts if count)
    analysis, kind = case_file.analysis, case_file.choice.told or case_file.model.replace("_", " ")
    return [
        ("pattern", f"{counted}; size {pattern.size:.6g} m"),
        ("sheet", _said(case_file.sheet)),
        ("model", f"{kind}; {_listed(model)}"),
        ("mesh", mesh_error(next(iter(results.values())))),
        ("supports", _parts(case.supports)),
        ("loads", _parts(case.loads)),
        ("damping", damping_text(case)),
        ("masses at nodes", _carried(case) if case.carried.nnz else ""),
        ("contact", _contact(case.contact) if case.contact else ""),
        ("air", _said(case.air) if case.air else ""),
        ("initial state", _listed(case_file.start_keys)),
        ("analysis", f"{analysis.kind}; {_listed(analysis.arguments)}"),
    ]


def computed(results: ByRule, call: Call) -> Iterator[tuple[str, str]]:
    """Date, program, command, cost and warnings of results."""
    own = sum(float(result.attrs.get("wall_seconds", 0.0)) for result in results.values())
    yield from cost_rows(next(iter(results.values())).attrs["foldyn_version"], call, own)


def cost_rows(version: str, call: Call, own: float = 0.0) -> Iterator[tuple[str, str]]:
    """Date, program, command, cost and warnings of a computation.

    own : time (s) in solvers.
    """
    yield "computed", f"{datetime.now():%Y-%m-%d %H:%M}, Foldyn {version}"
    yield "command", call.command
    cost = f"{own:.3g} s in the solver" if own else ""
    if call.wall:
        whole = f"{call.wall:.3g} s with reading and saving, {call.cpu:.3g} s of processor time"
        cost = f"{cost}; {whole}" if cost else whole
    yield "cost", cost
    yield "warnings", "; ".join(call.warnings) or "none"


def _parts(parts: Iterable[Any]) -> str:
    """Supports or loads in words, each with its kind."""
    return ". ".join(
        f"{re.sub(r'(?<=[a-z])(?=[A-Z])', ' ', type(part).__name__).capitalize()}: {_said(part)}"
        for part in parts
    )


def damping_text(case: Case) -> str:
    """The damping of a case and its dashpots, in words."""
    parts = []
    for part in case.dampings:
        name = part.key or "Rayleigh"
        parts.append(f"{name}: {_said(part)}" if part.key else _said(part))
    parts += [f"dashpot: {_said(dashpot)}" for _, dashpot in case.dashpots]
    return "; ".join(parts)


def _carried(case: Case) -> str:
    """Sum of point masses and bars, and the number of nodes that carry them."""
    masses = case.point_masses
    count = int((masses > 0.0).sum())
    nodes = f"{count} node{'s' if count > 1 else ''}"
    return f"{masses.sum():.6g} kg on {nodes}, of {case.total_mass:.6g} kg in all"


def _contact(contact: Contact) -> str:
    """Contact in words: between which parts, and with how much friction."""
    touching = "between panels" if contact.panels else "on planes alone"
    said = f"{touching}; {_said(contact, 'planes', 'panels')}"
    return ". ".join([said, *filter(None, [_parts(contact.planes)])])


def mesh_error(result: xarray.Dataset) -> str:
    """Mesh error of a result in words; "" if it was not estimated."""
    if "mesh_divisions" not in result.attrs:
        return ""
    told, order = result.attrs, np.atleast_1d(result.attrs["mesh_order"])
    first, second, third = (int(n) for n in told["mesh_divisions"])
    meshes = f"{first}, {second} and {third} pieces of every edge"
    error = 100.0 * float(told["mesh_error"])
    if "touched_clamp" in told:
        return f"no mesh converges: {NO_LIMIT.format(told['touched_clamp'])}"
    if np.isnan(told["mesh_changes"]).any():
        return (
            f"this mesh cannot be judged: with {first} piece{'s' * (first > 1)} of every edge some "
            "of the lowest modes are not there yet; take more divisions"
        )
    if np.isnan(error):
        early, late = (percent(change) for change in told["mesh_changes"])
        return (
            f"this mesh has not converged: with {meshes} one of the lowest frequencies changes by "
            f"{early} and then by {late}; take more divisions"
        )
    low, high = f"{order.min():.1f}", f"{order.max():.1f}"
    return (
        f"the lowest frequencies are about {abs(error):.2g} % too "
        f"{'low' if error < 0.0 else 'high'} with this mesh, by meshes of {meshes} (observed order "
        f"{low if low == high else f'{low} to {high}'})"
    )


def _said(part: Any, *aside: str) -> str:
    """Arguments of a data class in words, with their units."""
    own = {name: argument.unit for name, argument in arguments(type(part)).items()}
    return _listed({name: getattr(part, name) for name in own if name not in aside}, own)


def _listed(values: Mapping[str, Any], own: Mapping[str, str] | None = None) -> str:
    """Names and values with units; values that were not given are left out."""
    known = units() if own is None else own
    return "; ".join(
        f"{name.replace('_', ' ')} {_written(value)} "
        f"{'' if isinstance(value, str) else known.get(name, '')}".rstrip()
        for name, value in values.items()
        if value is not None and not (isinstance(value, tuple) and not value)
    )


def _written(value: Any) -> str:
    if isinstance(value, Law):
        given = _said(value, "name") if is_dataclass(value) else ""
        return f"{value.name} ({given})" if given else value.name
    if isinstance(value, History):
        return history_name(value)
    if isinstance(value, np.ndarray | list | tuple):
        size = sum(map(np.size, value))
        if size > MOST_LISTED:
            return f"{size} values"
    if isinstance(value, list | tuple) and value and isinstance(value[0], Ply):
        return " / ".join(f"{ply.angle:g}" for ply in value) + " degrees"
    if isinstance(value, list) and value and all(map(is_dataclass, value)):
        return _parts(value)
    if is_dataclass(value):
        return f"({_said(value)})"
    if isinstance(value, Mapping):
        return ", ".join(f"{word} {_written(one)}" for word, one in value.items())
    if isinstance(value, tuple) and all(isinstance(part, PanelSheet) for part in value):
        text = ", ".join(f"{_written(part.panels)} with {_listed(part.own)}" for part in value)
    elif isinstance(value, tuple) and [*map(type, value)] == [tuple, float]:
        text = f"{value[1]:g} degrees from the edge {list(value[0])}"
    elif isinstance(value, list | tuple) and all(isinstance(part, float) for part in value):
        text = f"[{', '.join(map(_written, value))}]"
    else:
        text = f"{value:.6g}" if isinstance(value, float) else str(plain(value))
    return text if len(text) <= MOST else f"{text[: MOST - 4]} ..."
