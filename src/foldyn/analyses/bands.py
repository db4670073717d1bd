"""Bands of a repeated case: [analysis] of kind "bands", arguments of `UnitCell` and `bands`."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Annotated, Any, NamedTuple

import numpy as np
import xarray
from numpy.typing import NDArray
from pydantic import Field, PlainValidator

from foldyn.analyses.bands_page import bands_sections
from foldyn.analyses.bars import bar
from foldyn.analyses.casefile import Analysis, Begun, CaseFile, Compute, counted
from foldyn.analyses.ranges import Varied, varied
from foldyn.analyses.sections import Count, Positive, Section, section_of
from foldyn.analyses.vibration import About, Secant, VibrationSchema, about, bar_closed
from foldyn.cases import Case
from foldyn.cases.units import unit_of
from foldyn.errors import ComputationError, InputError
from foldyn.linear import UnitCell, band_gaps, bands
from foldyn.linear.band_gaps import ALL
from foldyn.patterns.screw import Screw
from foldyn.results.dataset import bands_dataset
from foldyn.results.quantities import BANDS, GAPS
from foldyn.values import show

AROUND = {1: "G-X", 2: "G-X-M-Y-G"}
"""Paths around the zone by its dimensions, where a file names none."""
MOST_STATES, MOST_ZONE = 200, 200
OF_STATE = {
    "period_shift": "vectors", "period_turn": "angles", "period_axis": "axes",
    "period_point": "points", "residual": "residual",
}  # fmt: skip
"""Variables that `bands` has as attributes."""
COORDINATES = ("distance", "wave_vector", "zone_wave_vector")
OF_WAVES = tuple(name for name in BANDS if name not in OF_STATE)
ASIDE = ("analysis", "output", "sweep", "design", "title")
"""Tables and keys whose values make no other case."""


def _vary(value: Any) -> Varied:
    """The one key along which the states of a file follow each other."""
    one, *more = varied(value, sampled=False)
    if more:
        raise InputError(
            f" = {show(value)}: names {1 + len(more)} keys; give the one along which the states "
            "follow each other (foldyn sweep varies several)"
        )
    if one.key.split(".")[0] in ASIDE:
        raise InputError(f": {one.key} makes no other case; vary a key of another table")
    if not one.numeric or len(one.values) > MOST_STATES:
        raise InputError(f" = {show(value)}: give numbers, at most {MOST_STATES}")
    return one


class ScrewSection(section_of(Screw)):
    """[analysis.screw]: arguments of `Screw`."""


class BandsSection(Section):
    """[analysis] of kind "bands"."""

    kind: str
    path: str | None = None
    points: Count = 60
    count: Count = 6
    zone: Annotated[int, Field(ge=0, le=MOST_ZONE)] = 0
    vary: Annotated[Any, PlainValidator(_vary)] = None
    state: About = "rest"
    secant: Secant = None
    vectors: Any = None
    screw: ScrewSection | None = None
    tolerance: Positive = 1e-6


class BandsOutput(Section):
    """[output] of bands, which has no keys."""


class BandsSchema(VibrationSchema):
    """A case file of kind "bands"."""

    analysis: BandsSection
    output: BandsOutput = BandsOutput()


class _State(NamedTuple):
    """A repeated case in one of the states of a file."""

    value: Any  # of the key that varies
    cell: UnitCell
    start: Mapping[str, Any]


class BandsAnalysis(Analysis):
    """Frequencies of Bloch waves, in one state or in several."""

    kind = "bands"
    moving = True
    schema = BandsSchema
    needs_density = "bands need"
    takes = ("path", "points", "count", "zone", "secant")
    files = ("bands",)

    def prepare(self, case_file: CaseFile, mass: str, changes: Mapping[str, Any]) -> Compute:
        """See `Analysis`."""
        given = {**self.arguments, **changes}
        states = _states(case_file, mass, given)
        cell = states[0].cell
        path = cell.path(given["path"] or AROUND[cell.dimensions], given["points"])

        def compute(progress: bool, begun: Begun) -> xarray.Dataset:
            found = []
            with bar_closed(bar(progress, total=len(states), desc="states")) as reached:
                for state in states:
                    with _of(given["vary"], state.value):
                        found.append(_bands(state, path, given))
                    begun()
                    reached.update()
            return _joined(case_file.case(mass), states, found, given["vary"])

        return compute

    def line(self, name: str, result: xarray.Dataset) -> str:
        """How many bands and gaps, and the effort."""
        several = "state" in result.sizes
        of = f" in {result.sizes['state']} states" if several else ""
        full = int((result["gap_direction"] == ALL).sum())
        return (
            f"  {name}: {counted(result.sizes['band'], 'band')} at {result.sizes['phase']} wave "
            f"vectors{of}, {counted(full, 'full gap')}, {result.attrs['wall_seconds']:.1f} s"
        )

    sections = staticmethod(bands_sections)


def _states(case_file: CaseFile, mass: str, given: Mapping[str, Any]) -> list[_State]:
    """The repeated cases of a file, all of them checked."""
    vary: Varied | None = given["vary"]
    own = {"vectors": given["vectors"], "tolerance": given["tolerance"]}
    if given["screw"] is not None:
        own["screw"] = Screw(**given["screw"].model_dump())
    states = []
    for value in (None,) if vary is None else vary.values:
        with _of(vary, value):
            here = case_file if vary is None else case_file.with_values({vary.key: value})
            states.append(_State(value, UnitCell(here.case(mass), **own), about(here, mass)))
    if len({len(state.cell.case.structure.nodes) for state in states}) > 1:
        raise InputError(
            ": the states have different numbers of nodes, and show one cell; vary another key, or "
            "take foldyn sweep",
            "vary",
        )
    return states


@contextmanager
def _of(vary: Varied | None, value: Any) -> Iterator[None]:
    """Say in which state something is wrong."""
    try:
        yield
    except (InputError, ComputationError) as error:
        if vary is None:
            raise
        raise type(error)(f"{vary.key} = {show(value)}: {error}") from None


def _bands(state: _State, path: xarray.DataArray, given: Mapping[str, Any]) -> xarray.Dataset:
    """Bands along the path, and in the zone if asked for, with their gaps."""
    began, count = time.perf_counter(), given["count"]
    own = {"secant": given["secant"], **state.start}
    found = bands(
        state.cell, path, count, group_velocity=True, shape=True, polarization=True, **own
    )
    gaps = band_gaps(found)
    if given["zone"]:
        zone = bands(state.cell, state.cell.grid(given["zone"]), count, track=False, **own)
        both = [one["frequency"].reset_coords(drop=True).to_dataset() for one in (found, zone)]
        full = band_gaps(xarray.concat(both, "phase"))
        gaps = xarray.concat([full, gaps.isel(gap=gaps["direction"].values != ALL)], "gap")
        found["zone_frequency"] = ("zone", "band"), zone["frequency"].values
        found.coords["zone_wave_vector"] = ("zone", "period"), zone["wave_vector"].values
    still = np.zeros_like(state.cell.case.structure.nodes)
    about = own.get("state")
    moved = still if about is None else np.asarray(about.displacement, float)
    found["displacement"] = ("node", "axis"), moved
    found["position"] = ("node", "axis"), state.cell.case.structure.nodes + moved
    return found.assign_attrs(gaps=gaps, wall_seconds=time.perf_counter() - began)


def _joined(
    case: Case, states: Sequence[_State], found: Sequence[xarray.Dataset], vary: Varied | None
) -> xarray.Dataset:
    """One result of the bands of all states."""
    first = found[0]

    def over(values: Sequence[Any]) -> NDArray:
        return np.asarray(values[0]) if vary is None else np.stack(values)

    values = {name: over([one[name].values for one in found]) for name in OF_WAVES if name in first}
    values |= {name: over([one.attrs[of] for one in found]) for name, of in OF_STATE.items()}
    parts = [
        one.attrs["gaps"].assign(state=("gap", np.full(one.attrs["gaps"].sizes["gap"], k)))
        for k, one in enumerate(found)
    ]
    gaps = {
        name: np.concatenate([one[name.removeprefix("gap_")].values for one in parts])
        for name in GAPS
    }
    along: dict[str, Any] = {"band": ("band", first["band"].values, {"long_name": "band"})}
    along |= {name: first[name].variable for name in COORDINATES if name in first.coords}
    if vary is not None:
        word = vary.key.rpartition(".")[2]
        unit = unit_of(word, vary.values[0])
        text = {"key": vary.key, "long_name": word.replace("_", " ")}
        along["state"] = "state", np.array(vary.values), text | ({"units": unit} if unit else {})
    facts = {name: first.attrs[name] for name in ("ticks", "tick_labels", "tracked")}
    facts["wall_seconds"] = sum(one.attrs["wall_seconds"] for one in found)
    return bands_dataset(case, values, gaps, along, facts)
