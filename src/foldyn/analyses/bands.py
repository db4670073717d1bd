"""Bands of a repeated case: [analysis] of kind "bands", arguments of `UnitCell` and `bands`.

The case may be at rest, stretched, in a stored state, or in several states.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import pairwise
from typing import Annotated, Any

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn import plots
from foldyn.analyses.casefile import Analysis, Begun, CaseFile, Compute, counted
from foldyn.analyses.cells import (
    CellSchema,
    CellSection,
    CellState,
    cell_states,
    coordinate,
    in_all,
)
from foldyn.analyses.sections import Count, Text, whole_number
from foldyn.arguments import Check
from foldyn.cases import Case
from foldyn.errors import InputError, renamed
from foldyn.linear import UnitCell, attenuation, band_gaps, bands, damped_bands
from foldyn.linear.band_structure import ALL
from foldyn.report.album import Album, ByRule, computation
from foldyn.report.sections import Heading, Section, Table
from foldyn.report.sections import Text as PageText
from foldyn.results.dataset import result_dataset
from foldyn.results.quantities import BANDS, GAPS, variables

AROUND = {1: "G-X", 2: "G-X-M-Y-G", 3: "G-X-M-Y-G-Z-U-R-T-Z"}
"""Default paths around the zone, by its number of dimensions."""
MOST_ZONE = 200
MOST_LEVELS = 10_000
ABOVE = 1.05
"""Upper end of an attenuation spectrum, as a multiple of the highest frequency of the bands."""
COORDINATES = ("distance", "wave_vector", "zone_wave_vector", "leg")


class BandsSection(CellSection):
    """[analysis] of kind "bands".

    Parameters
    ----------
    path : str
        Points of the Brillouin zone, as "G-X-M-Y-G".
    points : int
        Wave vectors along the path.
    count : int
        Number of bands, from the lowest.
    zone : int, optional
        Wave vectors along each period of the whole zone, for exact full gaps.
    attenuation : int, optional
        Number of frequencies of an attenuation spectrum, along legs of the path that follow one
        period.
    """

    path: Text | None = None
    points: Count = 60
    count: Count = 6
    zone: Annotated[int | None, Check(whole_number, least=2, most=MOST_ZONE)] = None
    attenuation: Annotated[int | None, Check(whole_number, most=MOST_LEVELS)] = None
    check_model: bool = True


class BandsSchema(CellSchema):
    """A case file of kind "bands"."""

    analysis: BandsSection

    @property
    def solutions(self) -> tuple[float, str]:
        """See `VibrationSchema`; each wave vector counts."""
        own = self.analysis
        states = 1 if own.vary is None else len(own.vary.values)
        dimensions = 3 if np.shape(own.vectors) == (3, 3) else 2
        count = states * (own.points + (own.zone or 0) ** dimensions // 2)
        return count, f" at {count} wave vectors"


class BandsAnalysis(Analysis):
    """Frequencies of Bloch waves, in one state or in several."""

    kind = "bands"
    moving = True
    schema = BandsSchema
    needs_density = "bands need"
    takes = (
        "path", "points", "count", "zone", "attenuation", "stretch", "turn", "secant",
        "check_model",
    )  # fmt: skip
    files = ("bands", "bands-*")

    def prepare(self, case_file: CaseFile, mass: str, changes: Mapping[str, Any]) -> Compute:
        """See `Analysis`."""
        given = {**self.arguments, **changes}
        states = cell_states(case_file, mass, given)
        cell, points = states[0].cell, given["path"]
        with renamed({"points": "path", "count": "points"}):
            path = cell.path(AROUND[cell.dimensions] if points is None else points, given["points"])

        def compute(progress: bool, begun: Begun) -> xarray.Dataset:
            found = in_all(states, lambda state: _bands(state, path, given), progress, begun)
            return _joined(case_file.case(mass), states, found)

        return compute

    def line(self, name: str, result: xarray.Dataset) -> str:
        """Number of bands and gaps, and the time."""
        of = f" in {result.sizes['state']} states" if "state" in result.sizes else ""
        full = int((result["gap_direction"] == ALL).sum())
        return (
            f"  {name}: {counted(result.sizes['band'], 'band')} at {result.sizes['phase']} wave "
            f"vectors{of}, {counted(full, 'full gap')}, {result.attrs['wall_seconds']:.1f} s"
        )

    @staticmethod
    def sections(case_file: Any, results: ByRule, album: Album) -> Iterator[Section]:
        """See `Analysis`."""
        first = next(iter(results))
        result = results[first]
        yield from album.structure(case_file.case(first), "A cell with its nodes and supports.")
        yield Heading("The bands")
        for k in range(result.sizes.get("state", 1)):
            shown = result.isel(state=k) if "state" in result.dims else result
            of = f", {state_text(result, k)}" if "state" in result.dims else ""
            yield from album.figure(
                "bands" if k == 0 else f"bands-{k + 1}",
                f"Frequencies of Bloch waves along the path of the Brillouin zone{of}, mass rule "
                f"{first}. Full gaps are gray; the color is the share of motion along z.",
                partial(plots.plot_bands, shown),
            )
        yield Heading("The numbers")
        yield _gaps(results)
        yield computation(case_file, results, {
            "bands": lambda r: r.sizes["band"], "wave vectors": lambda r: r.sizes["phase"],
            "states": lambda r: r.sizes.get("state", 1),
        })  # fmt: skip
        yield PageText(_notes(result))


def _bands(state: CellState, path: xarray.DataArray, given: Mapping[str, Any]) -> xarray.Dataset:
    """All requested results in one state."""
    began, cell, count, own = time.perf_counter(), state.cell, given["count"], state.arguments()
    found = bands(
        cell, path, count=count, group_velocity=True, shape=True, polarization=True,
        check_model=given["check_model"], **own,
    )  # fmt: skip
    gaps = band_gaps(found)
    if given["zone"]:
        zone = cell.grid(given["zone"]).values
        values = _in_zone(cell, zone, given["zone"], count, own)
        every = np.concatenate([found["frequency"].values, values])
        full = band_gaps(xarray.Dataset({"frequency": (("phase", "band"), every)}))
        gaps = xarray.concat([full, gaps.isel(gap=gaps["direction"].values != ALL)], "gap")
        found["zone_frequency"] = ("zone", "band"), values
        found.coords["zone_wave_vector"] = ("zone", "period"), zone
    if given["attenuation"]:
        _attenuate(found, cell, given["attenuation"], own)
    if cell.case.damped:
        damped = damped_bands(cell, path, count=count, **own)
        found["damped_frequency"] = ("phase", "band"), damped["frequency"].values
        found["damped_ratio"] = ("phase", "band"), damped["damping_ratio"].values
    found["position"] = found["rest_position"] + found["displacement"]
    found["residual"] = (), found.attrs["residual"]
    return found.assign_attrs(gaps=gaps, wall_seconds=time.perf_counter() - began)


def _in_zone(
    cell: UnitCell, phases: NDArray, side: int, count: int, own: Mapping[str, Any]
) -> NDArray[np.float64]:
    """Frequencies (phase, band), Hz, at the phases of a grid; half of them by reciprocity."""
    shape = [side] * cell.dimensions
    places = np.indices(shape).reshape(cell.dimensions, -1)
    opposite = np.ravel_multi_index(tuple(-places % side), shape)  # index of -k
    half = np.flatnonzero(np.arange(len(opposite)) <= opposite)
    values = np.empty((len(phases), count))
    found = bands(cell, phases[half], count=count, track=False, check_model=False, **own)
    values[half] = values[opposite[half]] = found["frequency"].values
    return values


def _attenuate(found: xarray.Dataset, cell: Any, count: int, own: Mapping[str, Any]) -> None:
    """Add the attenuation along the legs of the path in the direction of one period."""
    names = found.attrs["tick_labels"].split("-")
    corners = np.searchsorted(found["distance"].values, found.attrs["ticks"] - 1e-9)
    levels = np.linspace(0.0, ABOVE * np.nanmax(found["frequency"].values), count + 1)[1:]
    legs: dict[str, NDArray] = {}
    for k, (a, b) in enumerate(pairwise(found["wave_vector"].values[corners])):
        along = np.flatnonzero(a != b)
        if len(along) == 1:
            other = {"phase": np.delete(a, along[0]).tolist()} if len(a) > 1 else {}
            spectrum = attenuation(cell, levels, along=int(along[0]), **other, **own)
            legs.setdefault(f"{names[k]}-{names[k + 1]}", spectrum["attenuation"].values)
    if not legs:
        raise InputError(
            ": no leg of the path follows one period, as G-X does; change the path or leave it out",
            "attenuation",
        )
    found["attenuation"] = ("leg", "level"), np.array(list(legs.values()))
    found["level_frequency"] = "level", levels
    found.coords["leg"] = "leg", np.array(list(legs))


def _joined(
    case: Case, states: Sequence[CellState], found: Sequence[xarray.Dataset]
) -> xarray.Dataset:
    """Join the bands of all states to one result."""
    first, vary = found[0], states[0].varied

    def over(values: Sequence[Any]) -> NDArray:
        return np.asarray(values[0]) if vary is None else np.stack(values)

    values = {name: over([one[name].values for one in found]) for name in BANDS if name in first}
    every = [one.attrs["gaps"] for one in found]
    parts = [own.assign(state=("gap", np.full(own.sizes["gap"], k))) for k, own in enumerate(every)]
    own = {name: name.removeprefix("gap_") for name in GAPS}
    gaps = {name: np.concatenate([one[key].values for one in parts]) for name, key in own.items()}
    along: dict[str, Any] = {"band": ("band", first["band"].values, {"long_name": "band"})}
    along |= {name: first[name].variable for name in COORDINATES if name in first.coords}
    if vary is not None:
        along["state"] = coordinate(vary)
    facts = {name: first.attrs[name] for name in ("ticks", "tick_labels", "tracked")}
    if "holds_to" in first.attrs:
        facts["holds_to"] = min(one.attrs["holds_to"] for one in found)
    facts["wall_seconds"] = sum(one.attrs["wall_seconds"] for one in found)
    data = variables(BANDS, () if vary is None else ("state",), values)
    return result_dataset("bands", case, data | variables(GAPS, "gap", gaps), along, facts)


MOST_GAPS = 200
"""Largest number of gaps in the table of the page."""
NUMBERS = ("gap_below", "gap_bottom", "gap_top", "gap_width", "gap_relative_width")


def state_text(result: xarray.Dataset, k: int) -> str:
    """The varied key with its value in a state: "dihedral 80 degrees"."""
    about = result["state"].attrs
    unit = f" {about['units']}" if "units" in about else ""
    return f"{about['long_name']} {result['state'].values[k]:g}{unit}"


def _gaps(results: ByRule) -> Table:
    several, by_state = len(results) > 1, False
    rows = []
    for rule, result in results.items():
        by_state = "state" in result.dims
        named = result[["gap_direction", *NUMBERS]]
        for k in range(named.sizes["gap"]):
            row = [named[name].values[k].item() for name in ("gap_direction", *NUMBERS)]
            where = [result["state"].values[int(result["gap_state"][k])]] if by_state else []
            rows.append([*([rule] if several else []), *where, *row])
    more = f"; the first {MOST_GAPS} of {len(rows)}" if len(rows) > MOST_GAPS else ""
    header = [*(["mass rule"] if several else []), *(["state"] if by_state else [])]
    header += ["direction", "below", "bottom (Hz)", "top (Hz)", "width (Hz)", "width / middle"]
    caption = (
        "Gaps between bands in the order of frequency: full ones, and those along one leg of the "
        f"path alone. Below: number of the band below the gap{more}"
    )
    if not rows:
        return Table(header, [], "No gaps between these bands")
    return Table(header, rows[:MOST_GAPS], caption)


def _notes(result: xarray.Dataset) -> str:
    """Notes on the numbers."""
    notes = [
        "Bands are small vibrations of a sheet of cells without end, as waves with a phase k per "
        "period: R cells away, nodes move as the Bloch mode times exp(i k R). The result carries "
        "the case of its cell. Curves follow the shapes of waves through crossings; gaps count "
        "bands in the order of frequency."
    ]
    if "damped_ratio" in result:
        notes.append(
            "Bands and gaps are those without damping; damping ratios are of the waves with it, in "
            "the order of their frequencies."
        )
    if "zone_frequency" not in result and result.sizes["period"] > 1:
        notes.append(
            "Full gaps are those at all wave vectors of the path. The greatest and least "
            "frequencies of bands may lie off it: analysis.zone computes the whole zone."
        )
    if "holds_to" in result.attrs:
        error = np.nanmax(result["frequency_error"] / result["frequency"].where(lambda f: f > 0.0))
        notes.append(
            "The panels are superelements. Frequencies are estimated to be within "
            f"{100.0 * error:.2g} % of a shell's on a fine mesh, and within 5 % up to "
            f"{result.attrs['holds_to']:.4g} Hz."
        )
    if "model_error" in result:
        error = np.abs(result["model_error"].values)
        notes.append(
            "At eight wave vectors frequencies were compared with those of superelements, in order "
            f"of frequency: they differ by up to {100.0 * np.nanmax(error, initial=0.0):.2g} %."
        )
    residual = float(np.max(result["residual"].values))
    if residual > 1e-6:
        notes.append(
            f"A state is no equilibrium: its residual is {residual:.2g} of the forces at play."
        )
    return "\n\n".join(notes)
