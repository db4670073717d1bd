"""Shared parts of small-vibration analyses: the state about which a structure vibrates.

Supports and loads are preloads: they act in full in the equilibrium and have no history.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any, ClassVar, Self

import xarray

from foldyn.analyses.bars import bar, bar_closed
from foldyn.analyses.casefile import Analysis, Begun, CaseFile, Compute
from foldyn.analyses.sections import CaseSchema, one_of
from foldyn.analyses.start import StoredStart
from foldyn.arguments import Check
from foldyn.cases import Case, Impose
from foldyn.cases.loads import LOAD
from foldyn.cases.models import BARS_AND_HINGES, MODELS
from foldyn.cases.supports import SUPPORT
from foldyn.errors import InputError
from foldyn.tables import ListOf
from foldyn.values import number, show

STATES = ("rest", "equilibrium")
"""States of vibration that case files name; a stored state is also possible."""
About = Annotated[str, one_of(STATES)]
Secant = Annotated[float | None, Check(number, above=0.0, most=180.0)]
GONE = {
    "internal": "internal amplitudes are no more, as superelements have the modes of panels; leave "
    'it out, and take model.kind = "superelements"'
}
TIMELESS = (
    "small vibrations are about one state, in which loads and displacements act in full; leave it "
    "out"
)
NO_BASE = (
    "a base moves over time, and small vibrations are about one state; leave it out (what a moving "
    'base does: analysis.kind = "frf" with [[drive]] and base)'
)


class VibrationSchema(CaseSchema):
    """Case files of small vibrations."""

    supports: Annotated[Sequence[Any], ListOf(SUPPORT.without(base=NO_BASE, history=TIMELESS))] = ()
    loads: Annotated[Sequence[Any], ListOf(LOAD.without(history=TIMELESS))] = ()
    initial: StoredStart | None = None
    analysis: Any

    @property
    def beyond_rest(self) -> str:
        """The key that asks for more than small vibrations about rest; "" if none does."""
        if self.initial is not None:
            return "initial"
        own = self.analysis
        return "analysis.state" if own.state != "rest" else "analysis.secant" if own.secant else ""

    @property
    def solutions(self) -> tuple[float, str]:
        """Work relative to that of modes, and the words for it."""
        return 1.0, ""

    def agree(self) -> None:
        """Refuse options that the model does not have, and contradictory states."""
        kind = self.model.kind or BARS_AND_HINGES
        if kind != BARS_AND_HINGES and "secant" in self.analysis.stated:
            raise InputError(
                f" = {show(self.analysis.secant)}: is for superlinear bends, which "
                f"{MODELS[kind].name} cannot have; leave it out",
                "analysis.secant",
            )
        if self.initial is not None and "state" in self.analysis.stated:
            raise InputError(
                f" = {show(self.analysis.state)}: initial.file gives the state already; leave out "
                "one of the two",
                "analysis.state",
            )
        if self.initial is not None or self.analysis.state != "rest":
            return
        remedy = 'write state = "equilibrium" under [analysis], or leave it out'
        if self.loads:
            raise InputError(f": does not act in the state of rest; {remedy}", "loads[0]")
        for i, support in enumerate(self.supports):
            if isinstance(support, Impose):
                raise InputError(
                    f": moves nothing in the state of rest; {remedy}, or hold its nodes by axes",
                    f"supports[{i}]",
                )


class Vibration(Analysis):
    """An analysis by a function of a case and a state, whose progress is unknown.

    Attributes
    ----------
    function : callable
    """

    function: ClassVar[Callable[..., xarray.Dataset]]

    @classmethod
    def of(cls, schema: Any, case: Case) -> Self:
        """See `Analysis`."""
        own = super().of(schema, case)
        if own.arguments["state"] == "rest":
            own.arguments["state"] = None
        return own

    def prepare(self, case_file: CaseFile, mass: str, changes: Mapping[str, Any]) -> Compute:
        """See `Analysis`."""
        given = {**self.arguments, **about(case_file, mass), **changes}
        case, what = case_file.case(mass), self.function.__name__.replace("_", " ")

        def compute(progress: bool, begun: Begun) -> xarray.Dataset:
            with bar_closed(bar(progress, bar_format=f"{what} with mass rule {mass}")):
                result = self.function(case, **given)
            begun()
            return result

        return compute


def slope_notes(result: xarray.Dataset) -> list[str]:
    """Notes on superlinear hinges in small vibrations, for pages."""
    notes, soft = [], int(result.attrs.get("soft_hinges", 0))
    if soft:
        notes.append(
            f"{soft} hinges of the superlinear law stand at their rest angle, where their slope "
            "vanishes: they count without stiffness, and motions that only they resist have the "
            "frequency zero. With a secant amplitude they have the slope of an oscillation of that "
            'amplitude; the preset "plate" has linear bends.'
        )
    if "secant" in result.attrs:
        notes.append(
            "Superlinear hinges have the slope that is equivalent to an oscillation by "
            f"{result.attrs['secant']:g} degrees: the numbers are those of that amplitude."
        )
    return notes


def about(case_file: CaseFile, mass: str) -> dict[str, Any]:
    """Arguments for the stored state of a case file; empty if it has none."""
    start = case_file.start(mass)._asdict()
    return {key: value for key, value in start.items() if value is not None}
