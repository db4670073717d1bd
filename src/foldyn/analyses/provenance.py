"""The last part of every page: what was computed, with what, and when."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from datetime import datetime
from typing import TYPE_CHECKING, Any

from foldyn.materials.law import Law
from foldyn.report.album import ByRule
from foldyn.report.sections import Heading, Listing, Section, Table
from foldyn.structures import PanelSheet
from foldyn.values import plain

if TYPE_CHECKING:
    import xarray

    from foldyn.analyses.casefile import CaseFile
    from foldyn.cases import Case

UNITS: Mapping[str, str] = {
    "youngs_modulus": "Pa", "thickness": "m", "density": "kg/m3", "alpha": "1/s", "beta": "s",
    "crease_stiffness": "N m/rad per m", "crease_rest": "degrees",
}  # fmt: skip
MOST = 200  # characters of a value


def provenance(case_file: CaseFile, results: ByRule, command: str = "") -> list[Section]:
    """Sheet, model and damping in a table, and the case file itself.

    command : what was typed to compute it.
    """
    first = next(iter(results))
    case = case_file.case(first)
    model = _given(case.structure.options) | {"mass": ", ".join(results)}
    mesh, version = mesh_error(results[first]), results[first].attrs["foldyn_version"]
    rows = [
        ["sheet", _listed(_given(case_file.sheet))],
        ["model", f"{case_file.model.replace('_', ' ')}; {_listed(model)}"],
        *([["mesh", mesh]] if mesh else []),
        ["damping", damping_text(case)],
        *([["point masses", _point_masses(case)]] if case.masses else []),
        ["computed", f"{datetime.now():%Y-%m-%d %H:%M}, Foldyn {version}"],
    ]
    if command:
        rows.append(["command", command])
    sections: list[Section] = [
        Heading("How it was computed"),
        Table(["part", "as computed"], rows),
    ]
    if case_file.text:
        sections.append(Listing(f"The case file {case_file.path.name}", case_file.text))
    return sections


def damping_text(case: Case) -> str:
    """The damping of a case and its dashpots, in words."""
    parts = []
    for part in case.dampings:
        name = part.key or "Rayleigh"
        parts.append(f"{name}: {_listed(_given(part))}" if part.key else _listed(_given(part)))
    parts += [f"dashpot: {_listed(_given(dashpot))}" for _, dashpot in case.dashpots]
    return "; ".join(parts)


def _point_masses(case: Case) -> str:
    """How much the point masses weigh, and on how many nodes."""
    masses = case.point_masses
    count = int((masses > 0.0).sum())
    nodes = f"{count} node{'s' if count > 1 else ''}"
    return f"{masses.sum():.6g} kg on {nodes}, of {case.total_mass:.6g} kg in all"


def mesh_error(result: xarray.Dataset) -> str:
    """What a result says of its mesh, in words; empty where there is nothing to say."""
    if "mesh_error" not in result.attrs:
        return ""
    percent = 100.0 * float(result.attrs["mesh_error"])
    return (
        f"the lowest frequencies are {abs(percent):.2g} % too {'low' if percent < 0.0 else 'high'} "
        "with this mesh, by extrapolation from it and one half as fine"
    )


def _given(choices: Any) -> dict[str, Any]:
    """Fields of a data class."""
    return {item.name: getattr(choices, item.name) for item in fields(choices)}


def _listed(values: Mapping[str, Any]) -> str:
    """Names and values with their units; what was not given is left out."""
    return "; ".join(
        f"{name.replace('_', ' ')} {_written(value)} {UNITS.get(name, '')}".rstrip()
        for name, value in values.items()
        if value is not None and value != ()
    )


def _written(value: Any) -> str:
    if isinstance(value, Law):
        given = _given(value) if is_dataclass(value) else {}
        given.pop("name", None)
        return f"{value.name} ({_listed(given)})" if given else value.name
    if isinstance(value, Mapping):
        return ", ".join(f"{word} {number:.6g}" for word, number in value.items())
    if isinstance(value, tuple) and all(isinstance(part, PanelSheet) for part in value):
        text = ", ".join(f"{_written(part.panels)} with {_listed(part.own)}" for part in value)
    else:
        text = f"{value:.6g}" if isinstance(value, float) else str(plain(value))
    return text if len(text) <= MOST else f"{text[: MOST - 4]} ..."
