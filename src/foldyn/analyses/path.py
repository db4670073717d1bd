"""Paths of equilibria: [analysis] of kind "statics", arguments of `trace` and of its settings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from typing import Annotated, Any, Self

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn.analyses.bars import bar
from foldyn.analyses.casefile import Analysis, Begun, CaseFile, Compute, arguments_of, counted
from foldyn.analyses.path_page import path_sections
from foldyn.analyses.sections import (
    AnalysisSection,
    Animation,
    CaseSchema,
    Count,
    ModelSection,
    Positive,
    ShownSection,
    Switch,
    check_mass,
    one_of,
    some_shapes,
    still,
)
from foldyn.analyses.start import StoredStart
from foldyn.arguments import Check
from foldyn.cases import Case, Contact, resolve_nodes
from foldyn.cases.directions import DIRECTIONS
from foldyn.cases.loads import LOAD
from foldyn.cases.supports import SUPPORT
from foldyn.errors import InputError
from foldyn.plots.along import critical_word, is_loose
from foldyn.statics import METHODS, Point, Settings, trace
from foldyn.statics.newton import settings_of
from foldyn.statics.reached import UNTIL, Reached
from foldyn.tables import ListOf, TableOf
from foldyn.values import indices, number, number_or_list, show

SETTINGS = ("tolerance", "largest_turn", "stability")
"""Keys that are settings of the solver."""


def _one_mass(name: str, value: Any, beside: Mapping[str, Any]) -> list[str]:
    if isinstance(value, list):
        raise InputError(
            f" = {show(value)}: a path is computed once; give one rule, or none: only gravity and "
            "inertia relief use the mass",
            name,
        )
    return [check_mass(name, value, beside)]


def _constant(name: str, value: Any) -> str | tuple[int, ...]:
    if value == "gravity":
        return "gravity"
    if isinstance(value, str):
        raise InputError(
            f' = {show(value)}: give "gravity", or numbers of [[loads]], as in [0]', name
        )
    return indices(name, value, "load", 'or "gravity"')


TIMELESS = (
    "a path has no time; leave it out: what loads and moves the structure grows with the load "
    "factor (or is named in analysis.constant)"
)
NO_BASE = (
    "a base moves over time, and a path has no time; give nodes, axis and displacement instead"
)


class PathSection(AnalysisSection):
    """[analysis] of kind "statics"."""

    like = (trace, Settings)
    method: Annotated[str, one_of(METHODS)] = "newton"
    load_factors: Annotated[
        Sequence[float] | None,
        ListOf(Check(number), "a list of numbers, as in [0, 0.5, 1]", least=1),
    ] = None
    steps: Count | None = None
    duration: Annotated[
        float | Sequence[float] | None,
        Check(number_or_list, what="interval", least=0.0, unit="s"),
    ] = None
    first_step: Annotated[float | None, Check(number)] = None
    constant: Annotated[str | Sequence[int], Check(_constant)] = ()
    until: Annotated[Reached | None, UNTIL] = None
    inertia_relief: Switch = False
    tolerance: Annotated[float, Check(number, least=1e-14, most=1e-2)] = Settings.tolerance
    largest_turn: Positive = Settings.largest_turn
    stability: Switch = Settings.stability


class PathOutput(ShownSection):
    """[output] of a path: what is shown.

    Parameters
    ----------
    axis : {"x", "y", "z", "-x", "-y", "-z"}, optional
        Direction that figures show; by default that of the largest motion.
    shapes : int or sequence of int
        How many deformed shapes are drawn, or the numbers of their points.
    animation : {"gif", "mp4"}, optional
        Film of the path beside the page.
    """

    axis: Annotated[str | None, one_of(DIRECTIONS)] = None
    shapes: Annotated[int | Sequence[int], Check(some_shapes, drawn="shapes", what="point")] = 4
    animation: Animation = None


class PathModel(ModelSection):
    """[model] of a path, with one mass rule at most."""

    mass: Annotated[str | None, Check(_one_mass)] = None


class PathSchema(CaseSchema):
    """A case file of kind "statics"."""

    model: PathModel = PathModel()
    supports: Annotated[Sequence[Any], ListOf(SUPPORT.without(base=NO_BASE, history=TIMELESS))] = ()
    loads: Annotated[Sequence[Any], ListOf(LOAD.without(history=TIMELESS))] = ()
    contact: Annotated[Contact | None, Check(still, why=TIMELESS), TableOf(Contact)] = None
    initial: StoredStart | None = None
    analysis: PathSection
    output: PathOutput = PathOutput()


class PathAnalysis(Analysis):
    """The path of equilibria under loads and moving supports that grow together."""

    kind = "statics"
    moving = True
    schema = PathSchema
    files = (
        "reaction", "curve", "energies", "landscape", "shapes", "path.gif", "path.mp4",
    )  # fmt: skip
    needs_density = ""
    takes = (*arguments_of(trace), *SETTINGS)

    @classmethod
    def of(cls, schema: Any, case: Case) -> Self:
        """See `Analysis`."""
        given = super().of(schema, case).arguments
        until = schema.analysis.until
        if until is not None:
            resolve_nodes(case.structure, (until.node,), "analysis.until.node")
        settings = Settings(**{name: given.pop(name) for name in SETTINGS})
        return cls({**given, "settings": settings})

    def prepare(self, case_file: CaseFile, mass: str, changes: Mapping[str, Any]) -> Compute:
        """See `Analysis`; bad input is refused before the first point, a mechanism for example."""
        own = dict(self.arguments)
        for one, other in (("load_factors", "steps"), ("steps", "load_factors")):
            if one in changes:
                own[other] = None  # they say the same
        given = {"initial": case_file.start(mass).state, **own, **changes}
        turned = {name: given.pop(name) for name in SETTINGS if name in given}
        given["settings"] = replace(settings_of(given["settings"]), **turned)
        case = case_file.case(mass)

        def compute(progress: bool, begun: Begun) -> xarray.Dataset:
            count = 0

            def tell(point: Point) -> None:
                nonlocal count
                if not count:
                    points.clear()
                    begun()
                count += 1
                points.set_postfix_str(f"load factor {point.factor:.4g}", refresh=False)
                points.update()

            with closing(_bar(progress)) as points:
                return trace(case, progress=tell, **given)

        return compute

    def line(self, name: str, result: xarray.Dataset) -> str:
        """Points, what is special about them, effort."""
        a, kinds = result.attrs, result["point"].values
        limits, crossings = int((kinds == "limit").sum()), int((kinds == "bifurcation").sum())
        loose = [critical_word(result, int(k)) for k in np.flatnonzero(is_loose(result))]
        more = f"; not located: {', '.join(loose)}" if loose else ""
        special = f" ({counted(limits, 'limit point')}, {counted(crossings, 'bifurcation')}{more})"
        unstable = f", {a['unstable_points']} of them unstable," if a["unstable_points"] > 0 else ""
        missed = f" ({a['status']})" if a["status"] != "complete" else ""
        return (
            f"  {a['method']}: {counted(result.sizes['step'], 'point')}"
            f"{special if limits or crossings else ''}{unstable} to the load factor "
            f"{float(result['load_factor'][-1]):.4g}{missed}, {a['newton_iterations']} iterations, "
            f"{a['wall_seconds']:.1f} s"
        )

    def shown(self, case: Case) -> NDArray[np.int64]:
        """Those with a force, else those that supports move, else all that can move."""
        moved = [vectors.any(axis=1) for vectors, _ in case.prescribed_terms]
        if not case.loaded_nodes.size and np.any(moved):
            return np.flatnonzero(np.any(moved, axis=0))
        return super().shown(case)

    sections = staticmethod(path_sections)


def _bar(shown: bool) -> Any:
    """Bar of points, whose number is not known."""
    return bar(shown, bar_format="points: {n_fmt}{postfix} [{elapsed}]", mininterval=0.0)
