"""`view`: a result, case or pattern as an interactive page, in a notebook or a file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from html import escape
from os import PathLike
from pathlib import Path
from typing import Any

import xarray as xr

from foldyn.analyses import CaseFile
from foldyn.cases import Case
from foldyn.errors import InputError
from foldyn.linear import stresses as find_stresses
from foldyn.patterns import Pattern
from foldyn.plots.readings import moved_supports
from foldyn.report.page import report_html, write_report
from foldyn.results import case_of, check_result
from foldyn.statics import Folding
from foldyn.structures.discretized import Discretized
from foldyn.values import flag, of_kind, whole
from foldyn.viewer import Stage, rest_stage, stage

HEIGHT = 820
"""Pixels of a view in a notebook."""
TITLES: Mapping[str, str] = {
    "trajectory": "Motion", "path": "Static curve", "modes": "Modes", "frf": "Frequency response",
    "folding": "Folding", "bands": "Bands", "response_curve": "Response curve",
    "backbone": "Backbone", "periodic_motion": "Periodic motion",
}  # fmt: skip
"""Titles of results by kind."""
MOVING = (
    "a motion, a path, modes, a frequency response, bands, a folding, a response curve, a backbone "
    "or a periodic motion"
)


@dataclass(frozen=True)
class View:
    """An interactive page that a notebook shows.

    Attributes
    ----------
    title : str
    stage : Stage
        The content of the page.
    height : int
        Height of the frame in a notebook (pixels).
    """

    title: str
    stage: Stage = field(repr=False)
    height: int = HEIGHT

    def html(self) -> str:
        """Text of the page."""
        return report_html(self.title, [self.stage])

    def save(self, path: str | PathLike[str]) -> Path:
        """Write the page to a file, which opens in any browser; returns its path.

        Raises
        ------
        InputError
            There is no such folder.
        """
        return write_report([self.stage], path, title=self.title)

    def _repr_html_(self) -> str:
        """The page in a frame that can neither access the notebook nor load anything."""
        return (
            f'<iframe title="{escape(self.title)}" sandbox="allow-scripts allow-downloads" '
            f'style="width: 100%; height: {self.height}px; border: 0" '
            f'srcdoc="{escape(self.html())}"></iframe>'
        )


def view(what: Any, title: str = "", *, height: int = HEIGHT, stresses: bool = False) -> View:
    """Show something in three dimensions: in a notebook, as the last line of a cell.

    Parameters
    ----------
    what : Dataset, mapping of Datasets, CaseFile, Case, Structure, Shell, Folding or Pattern
        A motion, path, modes or frequency response; several of one kind by name, which play in
        step; a case with its supports and loads, a structure or a pattern, at rest; or a folding.
    title : str
        Title above the view; by default it names the object shown.
    height : int
        Height of the frame in a notebook (pixels).
    stresses : bool
        Whether von Mises stresses and moments of creases (`foldyn.stresses`) can color motions and
        paths.

    Returns
    -------
    View
        It has `save(path)`.

    Raises
    ------
    InputError
        `what` is of another type, or the results are of several kinds.

    Examples
    --------
    >>> import foldyn as fd
    >>> fd.view(fd.patterns.miura(cells=(4, 3)))
    View(title='miura', height=820)
    """
    height = whole("height", height, least=100, most=10_000, what="pixels")
    named, make = _maker(what, flag("stresses", stresses))
    title = of_kind("title", title, str) or named
    return View(title, make(title), height)


def _maker(what: Any, stresses: bool) -> tuple[str, Callable[[str], Stage]]:
    """Name of an object's kind, and the function that makes its stage from a title."""
    if isinstance(what, CaseFile):
        return what.heading, partial(rest_stage, what.case())
    if isinstance(what, Discretized):
        what = Case(what)
    if isinstance(what, Case):
        return what.structure.pattern.name or "Case", partial(rest_stage, what)
    if isinstance(what, Pattern):
        return what.name or "Pattern", partial(rest_stage, what)
    if isinstance(what, Folding):
        return what.pattern.name or "Folding", partial(results_stage, {"folding": what.path})
    results = {"result": what} if isinstance(what, xr.Dataset) else what
    return check_results(results), partial(results_stage, results, stresses=stresses)


def check_results(results: Any) -> str:
    """Return the common kind of results given by name.

    Raises
    ------
    InputError
        There are no results, or they are of several kinds.
    """
    if not isinstance(results, Mapping) or not results:
        raise InputError(
            ": give a result, several by name ({'panel': one, 'centroid': other}), a case, a "
            "structure, a pattern or a folding",
            "what",
        )
    for name, result in results.items():
        check_result(result, f"what[{name!r}]: ")
    kinds = {result.attrs["foldyn_result"] for result in results.values()}
    if len(kinds) > 1:
        raise InputError(
            f": results of several kinds ({', '.join(sorted(kinds))}); give one", "what"
        )
    (kind,) = kinds
    if kind not in TITLES:
        raise InputError(f": a result of kind {kind!r} does not move; give {MOVING}", "what")
    return TITLES[kind]


def results_stage(results: Mapping[str, xr.Dataset], title: str, stresses: bool = False) -> Stage:
    """Stage of results of one kind by name, with their cases; foldings have no cases."""
    if next(iter(results.values())).attrs["foldyn_result"] == "folding":
        return stage(results, {}, title, [])
    cases = {name: case_of(result) for name, result in results.items()}
    first = next(iter(cases.values()))
    moved = moved_supports(first)
    nodes = first.loaded_nodes.tolist() or (moved[0] if moved else [0])
    return stage(results, cases, title, nodes, stresses=find_stresses if stresses else None)
