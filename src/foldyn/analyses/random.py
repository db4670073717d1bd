"""Random vibration: [analysis] of kind "random", with the densities of a moving base."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any

import numpy as np
import xarray

from foldyn import plots
from foldyn.analyses.casefile import CaseFile, arguments_of, counted
from foldyn.analyses.frf import NO_HISTORY, frequencies_of
from foldyn.analyses.sections import AnalysisSection, Count, ShownSection, Switch
from foldyn.analyses.vibration import About, Vibration, VibrationSchema
from foldyn.arguments import Check, arguments
from foldyn.cases import Force
from foldyn.cases.decode import PartOf
from foldyn.cases.directions import AXES
from foldyn.errors import InputError
from foldyn.linear import SpectralDensity, margins, random_response
from foldyn.plots.charts import Chart, Curve
from foldyn.report.album import Album, ByRule, computation, shown_nodes
from foldyn.report.sections import Charts, Heading, Section, Table, Text, cell
from foldyn.tables import check_table, read
from foldyn.values import choice, show

KEYS = tuple(arguments(SpectralDensity))


def _base(name: str, value: Any) -> dict[str, SpectralDensity]:
    """Densities of a base by axis, from tables."""
    found = {
        choice(name, axis, AXES): read(SpectralDensity, f"{name}.{axis}", table)
        for axis, table in check_table(name, value).items()
    }
    if not found:
        raise InputError(": give an axis, as [analysis.base.z]", name)
    return found


FORCE = PartOf((Force,), "force", "nodes and force", history=NO_HISTORY)


def _forces(name: str, value: Any) -> list[tuple[Force, SpectralDensity]]:
    """Forces with their densities, from tables."""
    if not isinstance(value, list):
        raise InputError(f" = {show(value)}: must be tables, written [[analysis.forces]]", name)
    found = []
    for i, table in enumerate(value):
        place = f"{name}[{i}]"
        density = {key: each for key, each in check_table(place, table).items() if key in KEYS}
        own = {key: each for key, each in table.items() if key not in KEYS}
        found.append((FORCE(place, own), read(SpectralDensity, place, density)))
    return found


class RandomSection(AnalysisSection):
    """[analysis] of kind "random"."""

    like = (random_response,)
    base: Annotated[Mapping[str, Any] | None, Check(_base)] = None
    forces: Annotated[Sequence[Any], Check(_forces)] = ()
    coherence: float | Sequence[Sequence[float]] = 0.0
    count: Count | None = None
    state: About = "rest"
    frequencies: Annotated[Sequence[float] | Mapping[str, float] | None, Check(frequencies_of)] = (
        None
    )
    stresses: Switch = False
    reactions: Switch = False
    secant = None


class RandomSchema(VibrationSchema):
    """A case file of kind "random"."""

    analysis: RandomSection
    output: ShownSection = ShownSection()


class RandomAnalysis(Vibration):
    """Root mean square response to a base that moves at random."""

    kind = "random"
    schema = RandomSchema
    needs_density = "random vibration needs"
    function = staticmethod(random_response)
    takes = arguments_of(random_response)
    files = ("stresses",)

    def line(self, name: str, result: xarray.Dataset) -> str:
        """Largest root mean squares, and effort."""
        moved, shaken = (_largest(result, what) for what in ("displacement", "acceleration"))
        return (
            f"  {name}: {counted(result.attrs['modes'], 'mode')}, up to {moved:.3g} m and "
            f"{shaken:.3g} m/s2 rms, {result.attrs['wall_seconds']:.1f} s"
        )

    @staticmethod
    def sections(case_file: CaseFile, results: ByRule, album: Album) -> Iterator[Section]:
        """See `Analysis`."""
        first, result = next(iter(results.items()))
        yield from album.structure(case_file.case(first))
        if "frequency" in result:
            nodes, some = shown_nodes(case_file.output.nodes.tolist())
            text = (
                f"Densities of the chosen nodes{some}, and root mean squares of the part below "
                "each frequency."
            )
            yield Charts(_charts(result, nodes), text)
        if "von_mises_rms" in result:
            yield from album.figure(
                "stresses",
                "Root mean square of the von Mises stress, the largest of each panel.",
                lambda: plots.draw_stresses(result, "von_mises"),
            )
        yield Heading("The numbers")
        yield _table(result)
        columns = {
            "modes": "modes",
            "largest displacement (m rms)": lambda one: cell(_largest(one, "displacement")),
            "largest acceleration (m/s2 rms)": lambda one: cell(_largest(one, "acceleration")),
        }
        yield computation(case_file, results, columns)
        yield Text(
            "Displacements are relative to the base, accelerations absolute. A normal process is "
            "within three times its root mean square 99.7 % of the time."
        )


def _largest(result: xarray.Dataset, what: str) -> float:
    return float(np.linalg.norm(result[f"{what}_rms"].values, axis=-1).max())


def _charts(result: xarray.Dataset, nodes: Sequence[int]) -> list[Chart]:
    """Densities, and what has come together up to each frequency."""
    charts, f = [], result["frequency"].values
    for what, unit in (("displacement", "m"), ("acceleration", "m/s2")):
        density = result[f"{what}_psd"].sel(node=nodes).sum("axis")
        below = (result[f"{what}_cumulative"].sel(node=nodes) ** 2).sum("axis") ** 0.5
        for label, values, ratio in (
            (f"{what} (({unit})2/Hz)", density, True), (f"{what} ({unit} rms)", below, False),
        ):  # fmt: skip
            curves = [Curve(f"node {node}", f, values.sel(node=node).values) for node in nodes]
            charts.append(Chart("frequency (Hz)", label, curves, by_ratio=ratio))
    return charts


def _table(result: xarray.Dataset) -> Table:
    """Where the response is largest, and the least margin if the strength is known."""
    rows = []
    for what, unit in (("displacement", "m"), ("acceleration", "m/s2")):
        rms, rate = (result[f"{what}_{name}"].values for name in ("rms", "crossings"))
        node, axis = np.unravel_index(rms.argmax(), rms.shape)
        most, swings = float(rms[node, axis]), float(rate[node, axis])
        where = f"node {node} along {AXES[axis]}"
        rows.append([f"{what} ({unit})", cell(most), cell(3.0 * most), where, cell(swings)])
    for name, label, part in (
        ("von_mises_rms", "von Mises stress (Pa)", "panel"),
        ("crease_moment_rms", "moment of a crease (N)", "crease"),
        ("total_reaction_rms", "sum of the reactions (N)", "along"),
    ):
        if name in result and result[name].size:
            value = result[name].values
            at = int(np.unravel_index(value.argmax(), value.shape)[0])
            at = int(result["point_panel"].values[at]) if part == "panel" else at
            where = f"{part} {AXES[at] if part == 'along' else at}"
            most = float(value.max())
            rows.append([label, cell(most), cell(3.0 * most), where, ""])
    if "von_mises_rms" in result:
        try:
            found = margins(result).attrs
            least = cell(found["least_margin"])
            rows.append(["least margin of a panel", "", least, found["least_where"], ""])
        except InputError:
            pass  # no strength is known
    header = ["largest", "root mean square", "three times that", "where", "swings per second"]
    return Table(header, rows, "Where the response is largest.")
