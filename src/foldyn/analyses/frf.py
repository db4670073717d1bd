"""Frequency responses: [analysis] of kind "frf", arguments of `frf` and options of its methods.

What shakes the structure stands under [[drive]].
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn.analyses.bars import bar
from foldyn.analyses.casefile import Analysis, Begun, CaseFile, Compute, arguments_of, movable
from foldyn.analyses.frf_page import frf_sections
from foldyn.analyses.motion import check_massless
from foldyn.analyses.sections import AnalysisSection, Positive, ShownSection, one_of
from foldyn.analyses.vibration import About, Internal, Secant, VibrationSchema, about, bar_closed
from foldyn.arguments import Check, arguments
from foldyn.cases import BaseMotion, Case, Force
from foldyn.cases.decode import PartOf
from foldyn.cases.directions import DIRECTIONS
from foldyn.cases.models import SHELL
from foldyn.dynamics import Progress
from foldyn.errors import InputError
from foldyn.linear import frf
from foldyn.linear.frf import METHODS, PER_FORCE
from foldyn.linear.internal_modes import check_internal
from foldyn.tables import ListOf, check_keys
from foldyn.values import number, show, whole

MOST_FREQUENCIES = 100_000
OPTIONS = frozenset(key for method in METHODS.values() for key in arguments(method.options))
"""Options of all methods."""


def _frequencies(name: str, value: Any) -> NDArray[np.float64]:
    if isinstance(value, dict):
        return _range(name, value)
    if not isinstance(value, list) or not value:
        raise InputError(
            f" = {show(value)}: must be {{ first = 1, last = 25, count = 241 }}, in Hz, or a list "
            "of frequencies",
            name,
        )
    listed = [number(f"{name}[{i}]", item, least=0.0) for i, item in enumerate(value)]
    for i in range(1, len(listed)):
        if listed[i] <= listed[i - 1]:
            raise InputError(
                f" = {show(value[i])}: must be greater than the frequency before it "
                f"({show(value[i - 1])})",
                f"{name}[{i}]",
            )
    return np.array(listed)


def _range(name: str, table: dict[str, Any]) -> NDArray[np.float64]:
    """Frequencies spaced evenly, first and last among them."""
    known = ("first", "last", "count")
    check_keys(table, known, name)
    for key in known:
        if key not in table:
            raise InputError(": missing; give first and last (Hz) and their count", f"{name}.{key}")
    first = number(f"{name}.first", table["first"], least=0.0)
    last = number(f"{name}.last", table["last"], above=first)
    count = whole(f"{name}.count", table["count"], least=2, most=MOST_FREQUENCIES)
    return np.linspace(first, last, count)


class FrfSection(*(method.options for method in METHODS.values()), AnalysisSection):
    """[analysis] of kind "frf"."""

    like = (frf,)
    frequencies: Annotated[Sequence[float] | Mapping[str, float], Check(_frequencies)]
    method: Annotated[str, one_of(METHODS)] = "direct"
    state: About = "rest"
    secant: Secant = None
    internal: Internal = 0
    amplitude: Positive = 1.0

    def agree(self) -> None:
        """Ask for what fits the method."""
        given, method = self.stated, METHODS[self.method]
        for key in sorted(given & OPTIONS):
            owners = [name for name, other in METHODS.items() if key in arguments(other.options)]
            if self.method not in owners:
                raise InputError(
                    f": only for method = {' or '.join(show(owner) for owner in owners)}; leave it "
                    "out",
                    key,
                )
        if "secant" in given and method.by_amplitude:
            raise InputError(
                f" = {show(self.secant)}: the method {self.method} goes by the amplitude of the "
                "drive; leave it out, and give amplitude",
                "secant",
            )
        if self.internal and method.by_amplitude:
            raise InputError(
                f" = {self.internal}: the method {self.method} goes by the amplitude of the drive, "
                'internal amplitudes are for small vibrations; take method = "direct" or "modal", '
                "or leave it out",
                "internal",
            )
        method.options(**self.options())

    def options(self) -> dict[str, Any]:
        """What the file says of the options of its method."""
        return {key: getattr(self, key) for key in OPTIONS & self.stated}


NO_HISTORY = (
    "a drive has an amplitude only, analysis.method says how it goes over time; leave it out"
)


class DriveOf(PartOf):
    """A table of [[drive]]: a force on nodes, or a motion of the base."""

    def _made(self, name: str, value: Any, folder: Path | None) -> Any:
        if isinstance(value, Mapping):
            number(f"{name}.displacement", value.get("displacement", 1.0), above=0.0)
            value = {**value, "history": {"kind": "constant"}}
        return super()._made(name, value, folder)


DRIVE = DriveOf(
    (Force, BaseMotion),
    "drive",
    "nodes and force, or base (the axis of a base that moves)",
    history=NO_HISTORY,
)


class FrfOutput(ShownSection):
    """[output] of a frequency response: what is shown.

    Parameters
    ----------
    axis : {"x", "y", "z", "-x", "-y", "-z"}, optional
        Direction that figures show; by default that of the drive.
    quantity : {"receptance", "mobility", "accelerance"}, optional
        What is shown: displacement, velocity or acceleration per force.
    """

    axis: Annotated[str | None, one_of(DIRECTIONS)] = None
    quantity: Annotated[str | None, one_of(PER_FORCE)] = None


class FrfSchema(VibrationSchema):
    """A case file of kind "frf"."""

    analysis: FrfSection
    drive: Annotated[Sequence[Any], ListOf(DRIVE, least=1)]
    output: FrfOutput = FrfOutput()

    def agree(self) -> None:
        """Let the integrator move the model, and a base drive alone."""
        super().agree()
        if self.model.kind == SHELL:
            check_massless(self, "integrator")
        bases = [i for i, one in enumerate(self.drive) if isinstance(one, BaseMotion)]
        if bases and len(self.drive) > 1:
            raise InputError(
                ": a base drives alone, along one axis; run a case file for each",
                f"drive[{bases[0]}]",
            )
        if bases and self.output.quantity is not None:
            raise InputError(
                f" = {show(self.output.quantity)}: a base drives, and what responds to it is shown "
                "as transmissibility; leave it out",
                "output.quantity",
            )


class FrfAnalysis(Analysis):
    """The response to a drive of each frequency about a state."""

    kind = "frf"
    moving = True
    schema = FrfSchema
    needs_density = "a frequency response needs"
    takes = (*arguments_of(frf), *sorted(OPTIONS))
    files = ("response", "nyquist")

    @classmethod
    def of(cls, schema: Any, case: Case) -> Self:
        """See `Analysis`."""
        section = schema.analysis
        given: dict[str, Any] = {
            key: getattr(section, key)
            for key in ("frequencies", "method", "secant", "internal", "amplitude")
        }
        given["state"] = None if section.state == "rest" else section.state
        return cls({**given, **section.options(), "drive": schema.drive})

    def prepare(self, case_file: CaseFile, mass: str, changes: Mapping[str, Any]) -> Compute:
        """See `Analysis`; `frf` refuses bad input before it tells of its first progress."""
        given = {**self.arguments, **about(case_file, mass), **changes}
        case = case_file.case(mass)
        check_internal(case.structure, given.get("internal", 0))

        def compute(progress: bool, begun: Begun) -> xarray.Dataset:
            def tell(now: Progress) -> None:
                if not reached.n:
                    reached.clear()
                    begun()
                reached.total = now.duration
                reached.update(now.time - reached.n)

            with bar_closed(_bar(progress)) as reached:
                return frf(case, progress=tell, **given)

        return compute

    def line(self, name: str, result: xarray.Dataset) -> str:
        """Method, frequencies and effort."""
        f = result["frequency"].values
        count = f"{len(f)} frequencies" if len(f) > 1 else "1 frequency"
        return (
            f"  {name}: {result.attrs['method']}, {count} from {f[0]:.4g} to {f[-1]:.4g} Hz, "
            f"{result.attrs['wall_seconds']:.1f} s"
        )

    def shown(self, case: Case) -> NDArray[np.int64]:
        """Nodes with a driving force, else all that can move."""
        forces = [
            one.loaded(case.structure, f"drive[{i}]")
            for i, one in enumerate(self.arguments["drive"])
            if isinstance(one, Force)
        ]
        return np.unique(np.concatenate(forces)) if forces else movable(case)

    sections = staticmethod(frf_sections)


def _bar(shown: bool) -> Any:
    """Bar of a response: what it counts depends on the method."""
    layout = "{desc}: {percentage:3.0f} %|{bar}| [{elapsed}<{remaining}]"
    return bar(shown, total=1.0, desc="response", bar_format=layout)
