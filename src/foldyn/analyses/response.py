"""Response curves: [analysis] of kind "response", arguments of `response_curve`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any

import numpy as np
import xarray

from foldyn import plots
from foldyn.analyses.bars import bar_closed, share_bar
from foldyn.analyses.casefile import Analysis, Begun, CaseFile, Compute, arguments_of, counted
from foldyn.analyses.sections import AnalysisSection, CaseSchema, Count, whole_number
from foldyn.arguments import Check
from foldyn.dynamics import Progress
from foldyn.periodic import response_curve
from foldyn.periodic.equation import Drive
from foldyn.periodic.response import checked_range
from foldyn.report.album import Album, ByRule, computation
from foldyn.report.sections import Heading, Section, Table
from foldyn.tables import ListOf
from foldyn.values import number

ENDS = ListOf(Check(number, above=0.0), "two numbers, as in [2.0, 5.0]", least=2, most=2)
Ends = Annotated[Sequence[float] | None, ENDS]


class ResponseSection(AnalysisSection):
    """[analysis] of kind "response"."""

    like = (response_curve,)
    frequencies: Ends = None
    amplitudes: Ends = None
    harmonics: Count = 9
    modes: Count | None = None
    branches: Annotated[int, Check(whole_number, least=0)] = 1
    longest_step: Annotated[float, Check(number, above=0.0, most=1.0)] = 0.1
    most_points: Annotated[int, Check(whole_number, least=2)] = 500

    def agree(self) -> None:
        """Require two ends, of either frequencies or amplitudes."""
        checked_range(self.frequencies, self.amplitudes)


class ResponseSchema(CaseSchema):
    """A case file of kind "response"."""

    analysis: ResponseSection


class ResponseAnalysis(Analysis):
    """Periodic motions along the frequency or the amplitude of the drive."""

    kind = "response"
    moving = True
    schema = ResponseSchema
    needs_density = "a response curve needs"
    takes = arguments_of(response_curve)
    files = ("response_curve",)

    def prepare(self, case_file: CaseFile, mass: str, changes: Mapping[str, Any]) -> Compute:
        """See `Analysis`."""
        case, given = case_file.case(mass), {**self.arguments, **changes}
        Drive(case)  # refuses other histories

        def compute(progress: bool, begun: Begun) -> xarray.Dataset:
            begun()

            def tell(now: Progress) -> None:
                reached.update(now.time - reached.n)

            with bar_closed(share_bar(progress, "response curve"), keeps=True) as reached:
                return response_curve(case, progress=tell, **given)

        return compute

    def line(self, name: str, result: xarray.Dataset) -> str:
        """Points, bifurcations and time."""
        marked = int((result["bifurcation"].values != "").sum())
        return (
            f"  {name}: {counted(result.sizes['point'], 'point')}, "
            f"{counted(marked, 'bifurcation')}, {result.attrs['wall_seconds']:.1f} s"
        )

    @staticmethod
    def sections(case_file: CaseFile, results: ByRule, album: Album) -> Iterator[Section]:
        """See `Analysis`."""
        first = next(iter(results))
        caption = "The pattern with its nodes, supports and loads."
        yield from album.structure(case_file.case(first), caption)
        yield Heading("The curve")
        curves = results if len(results) > 1 else results[first]
        yield from album.figure(
            "response_curve",
            "Largest displacement in a period, half the distance between its extremes. Solid: "
            "stable motions, dashed: unstable ones.",
            lambda: plots.plot_response_curve(curves),
        )
        yield Heading("The numbers")
        yield _bifurcations(results)
        names = "harmonics", "unknowns", "complete"
        yield computation(case_file, results, {name: name for name in names})


def _bifurcations(results: ByRule) -> Table:
    """Table of bifurcations and of the ends of each branch."""
    header = ["mass rule", "branch", "point", "frequency (Hz)", "factor", "amplitude (m)"]
    rows = [
        [
            rule, int(result["branch"][k]), str(result["bifurcation"].values[k]) or "end",
            float(result["frequency"][k]), float(result["level"][k]),
            float(result["amplitude"][k]),
        ]
        for rule, result in results.items() for k in _told(result)
    ]  # fmt: skip
    return Table(header, rows, "Bifurcations, and both ends of each branch", digits=5)


def _told(result: xarray.Dataset) -> list[int]:
    """Numbers of the points in the table."""
    branch = result["branch"].values
    edges = np.flatnonzero(np.diff(branch))
    ends = {0, len(branch) - 1, *edges.tolist(), *(edges + 1).tolist()}
    return sorted(ends | set(np.flatnonzero(result["bifurcation"].values != "").tolist()))
