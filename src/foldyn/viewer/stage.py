"""`Stage`: the interactive part of a page, which shows results of one kind or a sheet at rest."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn import __version__
from foldyn.cases import Case
from foldyn.errors import InputError, quietly
from foldyn.linear import character, mac
from foldyn.linear.frf import quantity_of
from foldyn.patterns import Pattern
from foldyn.plots.readings import displacements, moved_supports, stretches, total_reaction, way
from foldyn.results.contents import pattern_of
from foldyn.structures import Sheet, discretize
from foldyn.threads import one_thread
from foldyn.viewer.arrays import Arrays
from foldyn.viewer.backdrop import Backdrop
from foldyn.viewer.orbits import about_orbits, orbits
from foldyn.viewer.scripts import in_page
from foldyn.viewer.sheet import bare_sheet, gone, sheet
from foldyn.viewer.states import Field, energies, fields, folding_fields, stress_fields
from foldyn.viewer.waves import about_waves, waves

OF_SIZE, OF_LARGEST, OF_COLORS = 5e-5, 1e-3, 4e-3
"""Allowed errors on the page: of displacements relative to the sheet's size and to the largest
displacement (the smaller error applies), and of colored values relative to the largest value."""
MOST_LINES = 20_000
"""Largest number of bars or creases that a page colors: in larger sheets they are too fine to see
and take most of the page's size."""
MOST = 30_000_000
"""Largest number of displacements of a result that are used; of longer results only every k-th
sample."""
THIN = 1e-3
"""Thickness of the sheet of a folding, relative to the pattern's size; has no visible effect."""

Results = Mapping[str, xr.Dataset]


@dataclass(frozen=True)
class Stage:
    """Results in three dimensions with their charts, as a section of a page.

    Parameters
    ----------
    about : mapping
        Data for the page's script; see `stage`.
    arrays : Arrays
        The arrays that `about` names.
    """

    about: Mapping[str, Any]
    arrays: Arrays

    def whole(self) -> dict[str, Any]:
        """Data for the page's script, with the description of the arrays."""
        return {**self.about, "arrays": self.arrays.about}

    def html(self, key: str = "stage") -> str:
        """Write as HTML with element names that begin with a key; the page must have the script."""
        about = in_page(self.whole())
        return (
            f'<div class="foldyn" data-foldyn="{key}">'
            "<p>This part of the page needs JavaScript.</p></div>\n"
            f'<script type="application/json" id="{key}.about">{about}</script>\n'
            f"{self.arrays.html(key)}"
        )


def stage(
    results: Results, cases: Mapping[str, Case], title: str, nodes: list[int],
    backdrop: Backdrop | None = None,
    stresses: Callable[[xr.Dataset], xr.Dataset] | None = None,
) -> Stage:  # fmt: skip
    """Show results of one kind by name: motions, paths, modes, bands or others that move.

    cases : cases of the results; foldings have no cases.
    nodes : nodes listed at the start; the first is selected.
    backdrop : photographs behind the sheets.
    stresses : finds the stresses that color the panels and creases of motions and paths.
    """
    arrays, sheets, listed = Arrays(), {}, []
    kind = _kind(next(iter(results.values())))
    node = None if kind in ("modes", "bands") or not nodes else nodes[0]
    about = {"title": title, "kind": kind, "version": __version__, "node": node}
    keys: dict[int, str] = {}
    with one_thread():  # threads do not pay for small matrices
        for name, result in results.items():
            case = folding_case(result) if kind == "folding" else cases[name]
            key = keys.setdefault(id(case.structure.pattern), f"s{len(keys)}")
            if key not in sheets:
                sheets[key] = sheet(arrays, key, case)
            alone = len(results) == 1
            found = stresses(result) if stresses and kind in ("motion", "path") else None
            one = _Shown(arrays, f"r{len(listed)}", case, result, name, alone, found)
            own = {"name": name, "sheet": key, "alone": alone, **gone(case, result)}
            listed += [own | about for about in _LISTED[kind](one)]
    about |= {"sheets": sheets, "results": listed, **_more(kind, results, cases, nodes)}
    if listed and "way" in listed[0]:  # axes along which supports move
        about["axis"] = "xyz".index(listed[0]["way"][-1])
    if backdrop:
        about["backdrop"] = backdrop.about()
    return Stage(about, arrays)


def rest_stage(shown: Pattern | Case, title: str) -> Stage:
    """Show a pattern, or a case with its supports and loads, at rest."""
    arrays = Arrays()
    bare = isinstance(shown, Pattern)
    drawn = bare_sheet(arrays, "s0", shown) if bare else sheet(arrays, "s0", shown)
    count = len(shown.vertices if bare else shown.structure.nodes)
    result: dict[str, Any] = {"name": title, "sheet": "s0"}
    result["displacement"] = arrays.changing("u", np.zeros((1, count, 3)), 1.0)
    result["moments"] = arrays.exact("t", [0.0], "f4")
    about = {
        "title": title, "kind": "shape", "version": __version__, "node": None, "axis": 0,
        "sheets": {"s0": drawn}, "results": [result],
    }  # fmt: skip
    return Stage(about, arrays)


class _Shown(NamedTuple):
    """A result to show: its arrays on the page get names that begin with `key`."""

    arrays: Arrays
    key: str
    case: Case
    result: xr.Dataset
    name: str
    alone: bool
    stresses: xr.Dataset | None


def _kind(result: xr.Dataset) -> str:
    if "share" in result.coords:
        return "folding"
    if "band" in result.sizes:
        return "bands"
    if "point" in result.sizes and "coefficient" in result:
        return "periodic"
    for name, kind in (("time", "motion"), ("step", "path"), ("mode", "modes")):
        if name in result.sizes:
            return kind
    if "frequency" in result.sizes:
        return "response"
    raise InputError(
        "result: it is no motion, path, folding, modes, frequency response, bands, response curve "
        "or backbone"
    )


def _motion(one: _Shown) -> Iterator[dict[str, Any]]:
    every = slice(None, None, -(-one.result["displacement"].size // MOST))
    some, found = one.result.isel(time=every), one.stresses
    own = {} if found is None else stress_fields(found.isel(time=every))
    yield _changing(one, some, displacements(some, "time"), some["time"].values, own)


def _path(one: _Shown) -> Iterator[dict[str, Any]]:
    arrays, key, case, result, *_ = one
    u = displacements(result, "step")
    stable = np.ones(len(u), bool)
    for start, stop, good in stretches(result):
        stable[start + 1 : stop] &= good
        stable[[start, stop]] &= good
    own = {} if one.stresses is None else stress_fields(one.stresses)
    about = _changing(one, result, u, way(result), own)
    about["load"] = arrays.exact(f"{key}.load", result["load_factor"].values, "f4")
    if (moved := moved_supports(case)) is not None:  # the load factor is the supports' displacement
        force = total_reaction(result, moved[0], direction=moved[1])
        about |= {"way": moved[1], "force": arrays.exact(f"{key}.force", force, "f4")}
    yield about | {"stable": stable.tolist()}


def _folding(one: _Shown) -> Iterator[dict[str, Any]]:
    result, u = one.result, displacements(one.result, "step")
    own_fields = folding_fields(one.case, u, result["fold_angle"].values)
    about = _changing(one, result, u, way(result), own_fields)
    yield about | {"load": one.arrays.exact(f"{one.key}.load", result["share"].values, "f4")}


def _changing(
    one: _Shown, result: xr.Dataset, u: NDArray, moments: NDArray,
    more: Mapping[str, Field],
) -> dict[str, Any]:  # fmt: skip
    """Shared description of motions, paths and foldings, at some of their samples."""
    arrays, key, case, *_ = one
    known = more if "share" in result.coords else fields(case, result, u) | {**more}
    error = allowed(case.structure.pattern.size, float(np.abs(u).max(initial=0.0)))
    return {
        "displacement": arrays.changing(f"{key}.u", u, error),
        "moments": arrays.exact(f"{key}.t", moments, "f4"),
        "fields": {
            name: {
                "label": field.label, "unit": field.unit, "on": field.on, "signed": field.signed,
                "values": arrays.changing(f"{key}.{name}", field.values, OF_COLORS),
            }
            for name, field in known.items()
            if field.on == "panel" or field.values.shape[1] <= MOST_LINES
        },
        "energies": {
            text: arrays.exact(f"{key}.E{k}", values, "f4")
            for k, (text, values) in enumerate(energies(case, result).items())
        },
    }  # fmt: skip


def allowed(size: float, largest: float) -> float:
    """Allowed error of displacements relative to the largest, for a sheet of some size (m)."""
    return min(OF_LARGEST, OF_SIZE * size / (largest or 1.0))


def _modes(one: _Shown) -> Iterator[dict[str, Any]]:
    result = one.result
    shapes = result["shape"].transpose("mode", "node", "axis").values
    words = character(result, case=one.case)
    for k, frequency in enumerate(result["frequency"].values.tolist()):
        damping = float(result["damping_ratio"][k]) if "damping_ratio" in result else np.nan
        yield {
            "name": f"{k + 1}" if one.alone else f"{one.name} {k + 1}",
            "of": one.name,
            "number": k + 1,
            "frequency": frequency if np.isfinite(frequency) else None,  # nan if unstable
            "damping": damping if np.isfinite(damping) else None,
            "what": str(words.name.values[k]),
            "displacement": one.arrays.changing(f"{one.key}.{k}", shapes[k : k + 1], OF_LARGEST),
        }


def _response(one: _Shown) -> Iterator[dict[str, Any]]:
    values = one.result[quantity_of(one.result)].transpose("frequency", "node", "axis").values
    both = np.stack([np.real(values), np.imag(values)], axis=1)
    yield {
        "displacement": one.arrays.changing(f"{one.key}.u", both, OF_LARGEST / 1000),
        "moments": one.arrays.exact(f"{one.key}.t", one.result["frequency"].values, "f4"),
    }


_LISTED: Mapping[str, Callable[[_Shown], Iterable[dict[str, Any]]]] = {
    "motion": _motion, "path": _path, "folding": _folding, "modes": _modes, "response": _response,
    "bands": lambda one: [waves(one.arrays, one.key, one.result)],
    "periodic": lambda one: [orbits(one.arrays, one.key, one.result)],
}  # fmt: skip
"""Function for each kind of result that describes it once, or once for each mode."""


def _more(
    kind: str, results: Results, cases: Mapping[str, Case], nodes: list[int]
) -> dict[str, Any]:
    """Further data: the initial axis, the unit of a response, and the likeness of modes."""
    if kind == "modes":
        return {"axis": 0, "mac": _likeness(results, cases)}
    if kind == "bands":
        structure = next(iter(cases.values())).structure
        return about_waves(next(iter(results.values())), len(structure.triangles))
    first = next(iter(results.values()))
    usual = "coefficient" if kind == "periodic" else "displacement"
    name = quantity_of(first) if kind == "response" else usual
    shown = nodes[:1] or [0]
    moved = [one[name].sel(node=shown).transpose(..., "axis").values for one in results.values()]
    largest = np.max([np.abs(each).reshape(-1, 3).max(axis=0) for each in moved], axis=0)
    more = about_orbits(first) if kind == "periodic" else {}
    return {"axis": int(largest.argmax()), "unit": first[name].attrs.get("units", ""), **more}


def _likeness(results: Results, cases: Mapping[str, Case]) -> list[list[float | None]] | None:
    """MAC of all modes of all results with each other, at the vertices; None if patterns differ."""
    counts = {len(case.structure.pattern.vertices) for case in cases.values()}
    if len(counts) > 1:
        return None
    (count,) = counts
    shapes = [one["shape"].transpose("mode", "node", "axis").values for one in results.values()]
    every = np.concatenate([each[:, :count] for each in shapes])
    rows = mac(every, every).round(3).tolist()
    return [[value if np.isfinite(value) else None for value in row] for row in rows]


def folding_case(result: xr.Dataset) -> Case:
    """Case of a folding's pattern, with panels cut along their diagonals.

    The nodes of the case are the vertices. The sheet is arbitrary, because only the geometry
    counts; creases have flat rest angles, since the pattern's own may be fully folded.
    """
    pattern = pattern_of(result)
    with quietly():
        thin = Sheet(1.0, 0.0, THIN * pattern.size)
        return Case(discretize(pattern, thin, scheme="n4b5", crease_rest=180.0))
