"""`Stage`: the interactive part of a page, and what it shows of results of each kind."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from foldyn import __version__
from foldyn.cases import Case
from foldyn.errors import InputError
from foldyn.linear import character
from foldyn.plots.along import displacements, stretches, way
from foldyn.viewer.arrays import Arrays
from foldyn.viewer.fields import energies, fields
from foldyn.viewer.sheet import sheet

OF_SIZE, OF_LARGEST, OF_COLORS = 5e-5, 1e-3, 4e-3
"""Errors of the page's displacements over the sheet's size and over the largest of them, of which
the smaller one is allowed, and of values for colors over the largest."""
MOST = 20_000_000
"""Displacements of a result that are looked at; of longer ones every k-th sample."""

Results = Mapping[str, xr.Dataset]


@dataclass(frozen=True)
class Stage:
    """Results in three dimensions with their charts, as a section of a page.

    Parameters
    ----------
    about : mapping
        What the page's script reads; see `stage`.
    arrays : Arrays
        The arrays that it names.
    """

    about: Mapping[str, Any]
    arrays: Arrays

    def html(self, key: str = "stage") -> str:
        """Write as HTML, with names that begin with a key; the page must have the script."""
        about = json.dumps({**self.about, "arrays": self.arrays.about}).replace("</", "<\\/")
        return (
            f'<div class="foldyn" data-foldyn="{key}">'
            "<p>This part of the page needs JavaScript.</p></div>\n"
            f'<script type="application/json" id="{key}.about">{about}</script>\n'
            f"{self.arrays.html(key)}"
        )


def stage(results: Results, cases: Mapping[str, Case], title: str, nodes: list[int]) -> Stage:
    """Show results of one kind, by name: motions, paths, modes or responses.

    nodes : those to begin with; the first is chosen.
    """
    arrays, sheets, listed = Arrays(), {}, []
    kind = _kind(next(iter(results.values())))
    node = None if kind == "modes" or not nodes else nodes[0]
    about = {"title": title, "kind": kind, "version": __version__, "node": node}
    keys: dict[int, str] = {}
    with threadpool_limits(1, user_api="blas"):  # small matrices
        for name, result in results.items():
            case = cases[name]
            key = keys.setdefault(id(case.structure.pattern), f"s{len(keys)}")
            if key not in sheets:
                sheets[key] = sheet(arrays, key, case)
            own = {"name": name, "sheet": key, "alone": len(results) == 1}
            listed += _LISTED[kind](arrays, f"r{len(listed)}", case, result, own)
    about |= {"sheets": sheets, "results": listed, **_more(kind, results, nodes)}
    return Stage(about, arrays)


def _kind(result: xr.Dataset) -> str:
    for name, kind in (("time", "motion"), ("step", "path"), ("mode", "modes")):
        if name in result.sizes:
            return kind
    if "frequency" in result.sizes:
        return "response"
    raise InputError("result: it is no motion, path, modes or frequency response")


def _motion(
    arrays: Arrays, key: str, case: Case, result: xr.Dataset, own: dict[str, Any]
) -> list[dict[str, Any]]:
    every = slice(None, None, -(-result["displacement"].size // MOST))
    some = result.isel(time=every)
    u = displacements(some, "time")
    return [own | _changing(arrays, key, case, some, u, some["time"].values)]


def _path(
    arrays: Arrays, key: str, case: Case, result: xr.Dataset, own: dict[str, Any]
) -> list[dict[str, Any]]:
    u = displacements(result, "step")
    stable = np.ones(len(u), bool)
    for start, stop, good in stretches(result):
        stable[start + 1 : stop] &= good
        stable[[start, stop]] &= good
    about = _changing(arrays, key, case, result, u, way(result))
    load = arrays.exact(f"{key}.load", result["load_factor"].values, "f4")
    return [own | about | {"load": load, "stable": stable.tolist()}]


def _changing(
    arrays: Arrays, key: str, case: Case, result: xr.Dataset,
    u: NDArray, moments: NDArray,
) -> dict[str, Any]:  # fmt: skip
    """What motions and paths have in common."""
    return {
        "displacement": arrays.changing(f"{key}.u", u, _allowed(case, u)),
        "moments": arrays.exact(f"{key}.t", moments, "f4"),
        "fields": {
            name: {
                "label": field.label, "unit": field.unit, "on": field.on, "signed": field.signed,
                "values": arrays.changing(f"{key}.{name}", field.values, OF_COLORS),
            }
            for name, field in fields(case, u).items()
        },
        "energies": {
            text: arrays.exact(f"{key}.E{k}", values, "f4")
            for k, (text, values) in enumerate(energies(case, result).items())
        },
    }  # fmt: skip


def _allowed(case: Case, u: NDArray) -> float:
    """Error of displacements over the largest of them."""
    largest = float(np.abs(u).max(initial=0.0)) or 1.0
    return min(OF_LARGEST, OF_SIZE * case.structure.pattern.size / largest)


def _modes(
    arrays: Arrays, key: str, case: Case, result: xr.Dataset, own: dict[str, Any]
) -> list[dict[str, Any]]:
    shapes, words = result["shape"].transpose("mode", "node", "axis").values, character(result)
    out = []
    for k, frequency in enumerate(result["frequency"].values.tolist()):
        damping = float(result["damping_ratio"][k]) if "damping_ratio" in result else np.nan
        facts = {
            "name": f"{k + 1}" if own["alone"] else f"{own['name']} {k + 1}",
            "mode": 0,
            "frequency": frequency,
            "damping": damping if np.isfinite(damping) else None,
            "what": str(words.name.values[k]),
            "displacement": arrays.changing(f"{key}.{k}", shapes[k : k + 1], OF_LARGEST),
        }
        out.append(own | facts)
    return out


def _response(
    arrays: Arrays, key: str, case: Case, result: xr.Dataset, own: dict[str, Any]
) -> list[dict[str, Any]]:
    values = result[_measured(result)].transpose("frequency", "node", "axis").values
    both = np.stack([np.real(values), np.imag(values)], axis=1)
    return [
        own
        | {
            "displacement": arrays.changing(f"{key}.u", both, OF_LARGEST / 1000),
            "moments": arrays.exact(f"{key}.t", result["frequency"].values, "f4"),
        }
    ]


_LISTED: Mapping[str, Callable[..., list[dict[str, Any]]]] = {
    "motion": _motion, "path": _path, "modes": _modes, "response": _response,
}  # fmt: skip


def _measured(result: xr.Dataset) -> str:
    known = ("receptance", "mobility", "accelerance", "transmissibility")
    return next(name for name in known if name in result)


def _more(kind: str, results: Results, nodes: list[int]) -> dict[str, Any]:
    """The axis to begin with, and the unit of a response."""
    if kind == "modes":
        return {"axis": 0}
    name = _measured(next(iter(results.values()))) if kind == "response" else "displacement"
    moved = [
        np.abs(result[name].sel(node=nodes[:1] or [0]).transpose(..., "axis").values)
        for result in results.values()
    ]
    largest = np.max([each.reshape(-1, 3).max(axis=0) for each in moved], axis=0)
    unit = next(iter(results.values()))[name].attrs.get("units", "")
    return {"axis": int(largest.argmax()), "unit": unit}
