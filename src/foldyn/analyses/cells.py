"""The cell of a repeated case in case files, in one state or in several."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Annotated, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from foldyn.analyses.bars import bar, bar_closed
from foldyn.analyses.casefile import Begun, CaseFile
from foldyn.analyses.ranges import Varied, varied
from foldyn.analyses.sections import AnalysisSection, Positive
from foldyn.analyses.vibration import About, Secant, VibrationSchema, about
from foldyn.arguments import Check, Placed
from foldyn.cases import Case, State
from foldyn.cases.loads import Actuate
from foldyn.cases.units import unit_of
from foldyn.errors import ComputationError, InputError, renamed
from foldyn.linear import UnitCell, modes, relaxed
from foldyn.patterns.screw import Screw
from foldyn.tables import TableOf
from foldyn.values import indices, number, number_or_list, one_or_each, show

R = TypeVar("R")
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


def in_all(
    states: Sequence[CellState], compute: Callable[[CellState], R], progress: bool, begun: Begun
) -> list[R]:
    """What a function finds in each state, with a progress bar."""
    found = []
    with bar_closed(bar(progress, total=len(states), desc="states")) as reached:
        for state in states:
            with state.placed():
                found.append(compute(state))
            begun()
            reached.update()
    return found


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
    unit = unit_of(word.partition("[")[0], vary.values[0])
    text = {"key": vary.key, "long_name": word.replace("_", " ")}
    return "state", np.array(vary.values), text | ({"units": unit} if unit else {})


class CellSection(AnalysisSection):
    """[analysis] of a repeated case.

    Parameters
    ----------
    stretch : float or sequence of float, optional
        Factor on the periods of the equilibrium: one for all periods, or one for each.
    turn : float, optional
        Turn (degrees) from cell to cell of a tube in equilibrium.
    periods : int or sequence of int, optional
        Periods of the pattern, by number, along which it repeats; all by default.
    vary : mapping, optional
        Several states: one key of the file, and its values or range.
    """

    like = (modes, UnitCell)
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
    vary: Annotated[Varied | None, Placed(one_key, given=Mapping[str, Any])] = None


class CellSchema(VibrationSchema):
    """Case files of repeated cases."""

    @property
    def beyond_rest(self) -> str:
        """See `VibrationSchema`."""
        stated = [key for key in STATED if getattr(self.analysis, key) is not None]
        return super().beyond_rest or (f"analysis.{stated[0]}" if stated else "")

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
