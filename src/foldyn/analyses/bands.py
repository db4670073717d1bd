"""Bands of a repeated case: [analysis] of kind "bands", arguments of `UnitCell` and `bands`.

The case may be at rest, stretched, in a stored state, or in several states.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Annotated, Any

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn import plots
from foldyn.analyses.bars import bar, bar_closed
from foldyn.analyses.casefile import Analysis, Begun, CaseFile, Compute, counted
from foldyn.analyses.ranges import Varied, varied
from foldyn.analyses.sections import AnalysisSection, Count, Positive, Text, whole_number
from foldyn.analyses.vibration import About, Secant, VibrationSchema, about
from foldyn.arguments import Check, Placed
from foldyn.cases import Case, State
from foldyn.cases.loads import Actuate
from foldyn.cases.units import unit_of
from foldyn.errors import ComputationError, InputError, renamed
from foldyn.linear import UnitCell, attenuation, band_gaps, bands, damped_bands, modes, relaxed
from foldyn.linear.band_structure import ALL
from foldyn.patterns.screw import Screw
from foldyn.report.album import Album, ByRule, by_mass_rule
from foldyn.report.sections import Heading, Table
from foldyn.report.sections import Section as PageSection
from foldyn.report.sections import Text as PageText
from foldyn.results.dataset import bands_dataset
from foldyn.results.quantities import BANDS, GAPS
from foldyn.tables import Section, TableOf
from foldyn.values import indices, number, number_or_list, one_or_each, show

AROUND = {1: "G-X", 2: "G-X-M-Y-G", 3: "G-X-M-Y-G-Z-U-R-T-Z"}
"""Default paths around the zone, by its number of dimensions."""
MOST_ZONE = 200
MOST_LEVELS = 10_000
ABOVE = 1.05
"""Upper end of an attenuation spectrum, as a multiple of the highest frequency of the bands."""
COORDINATES = ("distance", "wave_vector", "zone_wave_vector", "leg")


MOST_STATES = 200
ASIDE = ("analysis", "output", "sweep", "design", "title")
"""Tables that do not change the state."""
PERIODS = "periods"
STATED = ("stretch", "turn")
"""Keys of [analysis] that do change the state."""


def one_key(value: Any) -> Varied:
    """Check that a table names one key, which distinguishes the states, and return it."""
    one, *more = varied(value, sampled=False)
    if more:
        raise InputError(
            f" = {show(value)}: names {1 + len(more)} keys; give the one along which the states "
            "follow each other (foldyn sweep varies several)"
        )
    table, _, key = one.key.partition(".")
    if table in ASIDE and not (table == "analysis" and key.partition("[")[0] in STATED):
        raise InputError(f": {one.key} does not change the state; vary a key of another table")
    if not one.numeric or len(one.values) > MOST_STATES:
        raise InputError(f" = {show(value)}: give numbers, at most {MOST_STATES}")
    return one


@dataclass(frozen=True, eq=False)
class CellState:
    """A repeated case in one of the states that its file describes.

    Attributes
    ----------
    cell : UnitCell
    start : mapping
        Arguments of `bands` for a stored state; empty if the case has none.
    given : mapping
        Table [analysis].
    varied : Varied or None
        The varied key of the file; the attribute `value` is its value in this state.
    """

    cell: UnitCell
    start: Mapping[str, Any]
    given: Mapping[str, Any]
    varied: Varied | None = None
    value: Any = None

    def arguments(self) -> dict[str, Any]:
        """Arguments of `bands`: the state, the load factor and the secant amplitude.

        Raises
        ------
        InputError
            The number of stretch factors differs from the number of periods.
        ComputationError
            There is no equilibrium.
        """
        own = {"secant": self.given["secant"], **self.start}
        stretch, turn = self.given["stretch"], self.given["turn"]
        if stretch is None and turn is None and self.given["state"] == "rest":
            return own
        return own | {"state": self._relaxed(stretch, turn, own.get("state"))}

    def _relaxed(self, stretch: Any, turn: float | None, state: State | None) -> State:
        """Equilibrium of the cell with stretched or turned periods."""
        cell = self.cell
        factors = np.ones(cell.dimensions)
        if stretch is not None:
            factors = factors * one_or_each("stretch", stretch, cell.dimensions, "periods")
        if turn is not None and not any(motion.turns for motion in cell.motions):
            raise InputError(f" = {turn:g}: the cell repeats without a screw; leave it out", "turn")
        motions = [
            replace(
                motion, shift=factor * motion.shift,
                angle=turn if turn is not None and motion.turns else motion.angle,
            )
            for motion, factor in zip(cell.motions, factors, strict=True)
        ]  # fmt: skip
        return relaxed(cell, motions, state=state)

    @contextmanager
    def placed(self) -> Iterator[None]:
        """Prefix messages with the state, and with `initial` if a stored state is wrong."""
        own = {"state": "initial"} if self.start else {}
        with _placed(self.varied, self.value), renamed(own):
            yield


def cell_states(case_file: CaseFile, mass: str, given: Mapping[str, Any]) -> list[CellState]:
    """The states that a file describes, each with its repeated cell."""
    vary: Varied | None = given["vary"]
    states = []
    for value in (None,) if vary is None else vary.values:
        with _placed(vary, value):
            here, own = case_file, given
            if vary is not None:
                here = case_file.with_values({vary.key: value})
            if vary is not None and vary.key.startswith("analysis."):
                own = {**given, **{key: here.analysis.arguments[key] for key in STATED}}
            cell = _cell(here.case(mass), given)
            states.append(CellState(cell, about(here, mass), own, vary, value))
    if len({len(state.cell.case.structure.nodes) for state in states}) > 1:
        raise InputError(
            ": the states have different numbers of nodes, and a result has one cell; vary another "
            "key, or take foldyn sweep",
            "vary",
        )
    return states


def _cell(case: Case, given: Mapping[str, Any]) -> UnitCell:
    """The repeating cell of a case."""
    vectors, screw, tolerance = given["vectors"], given["screw"], given["tolerance"]
    if given["periods"] is None:
        return UnitCell(case, vectors, screw, tolerance)
    if vectors is not None or screw is not None:
        raise InputError(
            ": chooses among the periods of the pattern; leave out vectors and screw", PERIODS
        )
    motions = UnitCell(case, tolerance=tolerance).motions
    chosen = given["periods"]
    if not 0 <= min(chosen) <= max(chosen) < len(motions):
        raise InputError(
            f" = {show(chosen)}: the pattern has the periods 0 to {len(motions) - 1}", PERIODS
        )
    kept = [motions[k] for k in chosen]
    vectors = [motion.vector for motion in kept if not motion.turns]
    screw = next((motion for motion in kept if motion.turns), None)
    return UnitCell(case, np.array(vectors) if vectors else None, screw, tolerance)


@contextmanager
def _placed(vary: Varied | None, value: Any) -> Iterator[None]:
    if vary is None:
        yield
        return
    where = f"{vary.key} = {show(value)}"
    try:
        yield
    except InputError as error:
        reason = f"{error.reason} (with {where})"
        raise InputError(reason, error.field, error.file, error.others) from None
    except ComputationError as error:
        raise ComputationError(f"{where}: {error}") from None


def coordinate(vary: Varied) -> tuple[str, NDArray, dict[str, str]]:
    """Coordinate of the states."""
    word = vary.key.rpartition(".")[2]
    bare = word.partition("[")[0]
    unit = unit_of(bare, vary.values[0])
    text = {"key": vary.key, "long_name": word.replace("_", " ")}
    return "state", np.array(vary.values), text | ({"units": unit} if unit else {})


class BandsSection(AnalysisSection):
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
    vary : mapping, optional
        Several states: one key of the file, and its values or range.
    stretch : float or sequence of float, optional
        Factor on the periods of the equilibrium: one for all periods, or one for each.
    turn : float, optional
        Turn (degrees) from cell to cell of a tube in equilibrium.
    periods : int or sequence of int, optional
        Periods of the pattern, by number, along which it repeats; all by default.
    """

    like = (modes, UnitCell)
    path: Text | None = None
    points: Count = 60
    count: Count = 6
    zone: Annotated[int | None, Check(whole_number, least=2, most=MOST_ZONE)] = None
    attenuation: Annotated[int | None, Check(whole_number, most=MOST_LEVELS)] = None
    vary: Annotated[Varied | None, Placed(one_key, given=Mapping[str, Any])] = None
    check_model: bool = True
    state: About = "rest"
    stretch: Annotated[
        float | Sequence[float] | None, Check(number_or_list, what="period", above=0.0)
    ] = None
    turn: Annotated[float | None, Check(number)] = None
    secant: Secant = None
    periods: Annotated[
        int | Sequence[int] | None, Check(indices, what="period", alternative="of the pattern")
    ] = None
    vectors: Any = None
    screw: Annotated[Screw | None, TableOf(Screw)] = None
    tolerance: Positive = 1e-6


class BandsOutput(Section):
    """[output] of kind "bands"; it has no keys."""


class BandsSchema(VibrationSchema):
    """A case file of kind "bands"."""

    analysis: BandsSection
    output: BandsOutput = BandsOutput()

    @property
    def beyond_rest(self) -> str:
        """See `VibrationSchema`."""
        stated = [key for key in STATED if getattr(self.analysis, key) is not None]
        return super().beyond_rest or (f"analysis.{stated[0]}" if stated else "")

    @property
    def solutions(self) -> tuple[float, str]:
        """See `VibrationSchema`; each wave vector counts."""
        own = self.analysis
        states = 1 if own.vary is None else len(own.vary.values)
        dimensions = 3 if np.shape(own.vectors) == (3, 3) else 2
        count = states * (own.points + (own.zone or 0) ** dimensions // 2)
        return count, f" at {count} wave vectors"

    def agree(self) -> None:
        """Refuse loads other than folded creases, unless a stored state is given."""
        super().agree()
        for i, load in enumerate(self.loads):
            if self.initial is None and not isinstance(load, Actuate):
                raise InputError(
                    ": the equilibrium of a cell is computed only for folded creases and stretched "
                    "periods; leave it out, or compute a path and name its result in initial.file",
                    f"loads[{i}]",
                )


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
            found = []
            with bar_closed(bar(progress, total=len(states), desc="states")) as reached:
                for state in states:
                    with state.placed():
                        found.append(_bands(state, path, given))
                    begun()
                    reached.update()
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
    def sections(case_file: Any, results: ByRule, album: Album) -> Iterator[PageSection]:
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
        yield by_mass_rule(
            results,
            {"bands": lambda r: r.sizes["band"], "wave vectors": lambda r: r.sizes["phase"],
             "states": lambda r: r.sizes.get("state", 1), "time (s)": "wall_seconds"},
            f"{case_file.path.name}: the computation",
        )  # fmt: skip
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
        along["state"] = coordinate(vary)
    facts = {name: first.attrs[name] for name in ("ticks", "tick_labels", "tracked")}
    if "holds_to" in first.attrs:
        facts["holds_to"] = min(one.attrs["holds_to"] for one in found)
    facts["wall_seconds"] = sum(one.attrs["wall_seconds"] for one in found)
    return bands_dataset(case, values, gaps, along, facts)


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
