"""Load factors and shapes of linear buckling: [analysis] of kind "buckling"."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any

import numpy as np
import xarray

from foldyn import plots
from foldyn.analyses.bars import bar, bar_closed
from foldyn.analyses.casefile import Analysis, Begun, CaseFile, Compute, counted
from foldyn.analyses.path import constant_loads
from foldyn.analyses.sections import AnalysisSection, CaseSchema, Count, Seed, some_shapes
from foldyn.arguments import Check
from foldyn.cases.loads import LOAD
from foldyn.cases.supports import SUPPORT
from foldyn.errors import renamed
from foldyn.linear import buckling
from foldyn.linear.buckling import DEPARTS
from foldyn.report.album import Album, ByRule, computation
from foldyn.report.sections import Heading, Table, Text, cell
from foldyn.report.sections import Section as PageSection
from foldyn.statics import trace
from foldyn.statics.tracing import constant_numbers
from foldyn.tables import ListOf, Section

TIMELESS = "load factors have no time; leave it out: all loads are multiplied by the factor"
NO_BASE = (
    "a base moves over time, and load factors have none; give nodes, axis and displacement instead"
)


class BucklingSection(AnalysisSection):
    """[analysis] of kind "buckling"."""

    like = (buckling, trace)
    count: Count = 6
    constant: Annotated[str | Sequence[int], Check(constant_loads)] = ()
    iterations: Seed = 0


class BucklingOutput(Section):
    """[output] of kind "buckling".

    Parameters
    ----------
    shapes : int or sequence of int
        Number of drawn shapes, or their numbers.
    """

    shapes: Annotated[
        int | Sequence[int], Check(some_shapes, drawn="shapes", what="mode", least=1)
    ] = 6


class BucklingSchema(CaseSchema):
    """A case file of kind "buckling"."""

    supports: Annotated[Sequence[Any], ListOf(SUPPORT.without(base=NO_BASE, history=TIMELESS))] = ()
    loads: Annotated[Sequence[Any], ListOf(LOAD.without(history=TIMELESS))] = ()
    analysis: BucklingSection
    output: BucklingOutput = BucklingOutput()


class BucklingAnalysis(Analysis):
    """Load factors at which a case buckles, and the shapes."""

    kind = "buckling"
    schema = BucklingSchema
    needs_density = ""
    takes = ("count", "constant", "iterations")
    files = ("buckling",)
    by_mass = False

    def prepare(self, case_file: CaseFile, mass: str, changes: Mapping[str, Any]) -> Compute:
        """See `Analysis`."""
        given, case = {**self.arguments, **changes}, case_file.case(mass)
        steady = constant_numbers(case, given.pop("constant"))
        preload = [case.loads[i] for i in steady]
        scaled = case.altered(loads=[o for i, o in enumerate(case.loads) if i not in steady])

        def compute(progress: bool, begun: Begun) -> xarray.Dataset:
            own = renamed({"preload": "analysis.constant"})
            with own, bar_closed(bar(progress, bar_format="load factors")):
                result = buckling(scaled, preload=preload, **given)
            begun()
            return result

        return compute

    def line(self, name: str, result: xarray.Dataset) -> str:
        """Factors and effort."""
        factors, a = result["load_factor"].values, result.attrs
        reach = f": {', '.join(f'{each:.4g}' for each in factors[:6])}" if len(factors) else ""
        more = ", ..." if len(factors) > 6 else ""
        doubt = f", departure {a['departure']:.2g}" if abs(a["departure"]) > DEPARTS else ""
        return (
            f"  {counted(len(factors), 'load factor')}{reach}{more}{doubt}, "
            f"{a['wall_seconds']:.1f} s"
        )

    @staticmethod
    def sections(case_file: CaseFile, results: ByRule, album: Album) -> Iterator[PageSection]:
        """See `Analysis`."""
        (first, result), *_ = results.items()
        yield from album.structure(case_file.case(first))
        if result.sizes["mode"]:
            yield Heading("The shapes")
            yield from album.figure(
                "buckling",
                "Buckling shapes, over the state before in gray. A shape has no amplitude of its "
                "own: each is drawn so that it can be read.",
                lambda: plots.draw_buckling(result, which=case_file.output.shapes),
            )
        yield Heading("The numbers")
        yield _table(result)
        columns = {"free dofs": "free_dofs", "proven complete": "complete"}
        yield computation(case_file, results, columns)
        yield Text(_notes(result))


def _table(result: xarray.Dataset) -> Table:
    shape = result["shape"].transpose("mode", "node", "axis").values
    node = np.linalg.norm(shape, axis=2).argmax(axis=1)
    axis = np.abs(shape[np.arange(len(node)), node]).argmax(axis=1)
    columns = {
        "mode": result["mode"].values, "load factor": map(cell, result["load_factor"].values),
        "node that moves most": node, "mainly along": ["xyz"[k] for k in axis],
    }  # fmt: skip
    return Table.of(columns, "Load factors; negative ones belong to reversed loads.")


def _notes(result: xarray.Dataset) -> str:
    departure, turn = result.attrs["departure"], np.degrees(result.attrs["turn"])
    base = "at rest" if result.attrs["state"] == "rest" else "in the equilibrium under the preloads"
    if result.attrs["iterations"]:
        base = f"on the path at the load factor {result.attrs['base_factor']:.6g}"
    notes = [
        f"Linear buckling about the state {base}: all other loads, moved supports, actuated "
        "creases and temperatures grow together with the factor."
    ]
    if np.isfinite(departure):
        notes.append(
            f"At the first factor hinges or bars have turned by up to {turn:.2g} degrees, and "
            f"{departure:.2g} is its relative error if the displacement is corrected to second "
            "order. Both are small where linear buckling holds; paths "
            '(analysis.kind = "statics") find the true critical points.'
        )
    return "\n\n".join(notes)
