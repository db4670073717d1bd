"""The case file's contract for small vibrations: modes and frequency responses.

They are about one state: supports and loads are preloads, which act in full in its equilibrium and
have no history. What shakes the structure in a frequency response stands under [[drive]].
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Annotated, Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, PlainValidator, model_validator

from foldyn.cases.analyses import (
    ANIMATIONS,
    AXES,
    METHODS,
    MOST_SHAPES,
    PathStart,
    check_implicit,
)
from foldyn.cases.decode import check_keys
from foldyn.cases.models import SHELL
from foldyn.cases.schema import (
    CaseSchema,
    Count,
    LoadSection,
    Nodes,
    Positive,
    Section,
    SupportSection,
    Vector,
)
from foldyn.cases.supports import check_axis
from foldyn.errors import InputError
from foldyn.values import MOST, choice, indices, number, show, whole

STATES = ("rest", "equilibrium")
"""States about which a case file may have its structure vibrate, beside a stored one."""
_INTEGRATION = ("integrator", "dt", "tolerance")
_TRANSIENT = ("duration", "every", "window_rate")
FRF_METHODS: Mapping[str, tuple[str, ...]] = {
    "direct": (),
    "modal": ("count", "static_correction"),
    "harmonic": ("tolerance", "iterations"),
    "impulse": (*_INTEGRATION, "pulse", *_TRANSIENT),
    "stepped_sine": (*_INTEGRATION, "cycles", "settled", "most_cycles", "sweep"),
    "burst_random": (
        *_INTEGRATION, "averages", "seed", "burst", "estimator", *_TRANSIENT,
    ),
}  # fmt: skip
"""Ways to a frequency response that a case file may name, and the keys that are theirs alone."""
LINEAR_METHODS = ("direct", "modal")
"""Those that give the same at every amplitude, for the slopes of a secant."""
SWEEPS = ("up", "down")
ESTIMATORS = ("h1", "h2")
QUANTITIES = ("receptance", "mobility", "accelerance")
"""What figures of a frequency response may show."""
MOST_FREQUENCIES = 100_000


def _timeless(value: Any) -> None:
    raise InputError(
        f" = {show(value)}: small vibrations are about one state, in which loads and displacements "
        "act in full; leave it out"
    )


def _no_base(value: Any) -> None:
    raise InputError(
        f" = {show(value)}: a base moves over time, and small vibrations are about one state; "
        'leave it out (what a moving base does: analysis.kind = "frf" with [[drive]] and base)'
    )


def _drive_history(value: Any) -> None:
    raise InputError(
        f" = {show(value)}: a drive has an amplitude only, analysis.method says how it goes over "
        "time; leave it out"
    )


def _shapes(value: Any) -> int | tuple[int, ...]:
    if isinstance(value, int) and not isinstance(value, bool):
        if not 1 <= value <= MOST_SHAPES:
            raise InputError(
                f" = {value}: give 1 to {MOST_SHAPES} modes, or a list of their numbers"
            )
        return value
    chosen = indices("", value, "mode", "or how many modes to draw")
    for number_of_mode in chosen:
        if number_of_mode < 1:
            raise InputError(f" = {show(value)}: modes are counted from 1")
    if len(chosen) > MOST_SHAPES:
        raise InputError(f": {len(chosen)} modes; give at most {MOST_SHAPES}")
    return chosen


def _frequencies(value: Any) -> NDArray[np.float64]:
    if isinstance(value, dict):
        return _range(value)
    if not isinstance(value, list) or not value:
        raise InputError(
            f" = {show(value)}: must be {{ first = 1, last = 25, count = 241 }}, in Hz, or a list "
            "of frequencies"
        )
    listed = [number(f"[{i}]", item, least=0.0) for i, item in enumerate(value)]
    for i in range(1, len(listed)):
        if listed[i] <= listed[i - 1]:
            raise InputError(
                f"[{i}] = {show(value[i])}: must be greater than the frequency before it "
                f"({show(value[i - 1])})"
            )
    return np.array(listed)


def _range(table: dict[str, Any]) -> NDArray[np.float64]:
    """Frequencies spaced evenly, first and last among them."""
    known = ("first", "last", "count")
    check_keys(table, known)
    for key in known:
        if key not in table:
            raise InputError(f".{key}: missing; give first and last (Hz) and their count")
    first = number(".first", table["first"], least=0.0)
    last = number(".last", table["last"], above=first)
    count = whole(".count", table["count"], least=2, most=MOST_FREQUENCIES)
    return np.linspace(first, last, count)


def _one_of(known: Iterable[str]) -> PlainValidator:
    return PlainValidator(lambda value: choice("", value, known))


Secant = Annotated[float, Field(gt=0, le=180)] | None


class ModesSection(Section):
    """[analysis] of kind "modes": arguments of `modes`."""

    kind: str
    count: Count = 6
    state: Annotated[str, _one_of(STATES)] = "rest"
    secant: Secant = None


class FrfSection(Section):
    """[analysis] of kind "frf": arguments of `frf`, and the options of its methods."""

    kind: str
    frequencies: Annotated[Any, PlainValidator(_frequencies)]
    method: Annotated[str, _one_of(FRF_METHODS)] = "direct"
    state: Annotated[str, _one_of(STATES)] = "rest"
    secant: Secant = None
    amplitude: Positive = 1.0
    count: Count | None = None
    static_correction: bool = True
    integrator: Annotated[str | None, _one_of(METHODS)] = None
    dt: Positive | None = None
    tolerance: Positive | None = None
    iterations: Annotated[int, Field(ge=2, le=MOST)] = 300
    pulse: Positive | None = None
    duration: Positive | None = None
    every: Positive | None = None
    window_rate: Annotated[float, Field(ge=0)] = 0.0
    cycles: Annotated[int, Field(ge=2, le=MOST)] = 4
    settled: Positive = 1e-3
    most_cycles: Count = 400
    sweep: Annotated[str, _one_of(SWEEPS)] = "up"
    averages: Annotated[int, Field(ge=2, le=MOST)] = 8
    seed: Annotated[int, Field(ge=0, le=MOST)] = 0
    burst: Annotated[float, Field(gt=0, lt=1)] = 0.5
    estimator: Annotated[str, _one_of(ESTIMATORS)] = "h1"

    @model_validator(mode="after")
    def _fits_the_method(self) -> Self:
        given = self.model_fields_set
        for key in sorted(given - set(FRF_METHODS[self.method])):
            owners = [name for name, keys in FRF_METHODS.items() if key in keys]
            if owners:
                raise InputError(
                    f".{key}: only for method = {' or '.join(show(owner) for owner in owners)}; "
                    "leave it out"
                )
        if "secant" in given and self.method not in LINEAR_METHODS:
            raise InputError(
                f".secant = {show(self.secant)}: the method {self.method} goes by the amplitude of "
                "the drive; leave it out, and give amplitude"
            )
        return self

    def options(self) -> dict[str, Any]:
        """What the file says of the options of its method."""
        return {
            key: getattr(self, key)
            for key in FRF_METHODS[self.method]
            if key in self.model_fields_set
        }


class DriveSection(Section):
    """One of [[drive]]: a force on nodes, or a motion of the base."""

    nodes: Nodes = None
    force: Vector = None
    base: Annotated[Any, PlainValidator(lambda value: check_axis("", value))] = None
    displacement: Positive = 1.0
    history: Annotated[Any, PlainValidator(_drive_history)] = None

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        given = self.model_fields_set
        if "base" in given and given & {"nodes", "force"}:
            raise InputError(
                ".base: moves all nodes that supports hold along its axis; leave out nodes and "
                "force"
            )
        if "base" in given:
            return self
        if "displacement" in given:
            raise InputError(
                '.displacement: is that of a base, as in base = "x"; leave it out, or give base'
            )
        if not given:
            raise InputError(": give nodes and force, or base (the axis of a base that moves)")
        for key in ("nodes", "force"):
            if key not in given:
                raise InputError(f".{key}: missing; give its value")
        return self


class VibrationSupport(SupportSection):
    """One of the [[supports]] of small vibrations: nodes held, at rest or where they were moved."""

    base: Annotated[Any, PlainValidator(_no_base)] = None
    history: Annotated[Any, PlainValidator(_timeless)] = None


class VibrationLoad(LoadSection):
    """One of the [[loads]] of small vibrations, which act in full in their state."""

    history: Annotated[Any, PlainValidator(_timeless)] = None


class ModesOutput(Section):
    """[output] of modes: what is shown, and along which axis and at which nodes it is judged."""

    nodes: Nodes = None
    axis: Annotated[Any, _one_of(AXES)] = None
    shapes: Annotated[int | tuple[int, ...], PlainValidator(_shapes)] = 6
    animation: Annotated[str, _one_of(ANIMATIONS)] = "gif"


class FrfOutput(Section):
    """[output] of a frequency response: what is shown."""

    nodes: Nodes = None
    axis: Annotated[Any, _one_of(AXES)] = None
    quantity: Annotated[Any, _one_of(QUANTITIES)] = None


class VibrationSchema(CaseSchema):
    """What case files of small vibrations share."""

    supports: list[VibrationSupport] = Field(default_factory=list)
    loads: list[VibrationLoad] = Field(default_factory=list)
    initial: PathStart | None = None
    analysis: ModesSection | FrfSection

    @model_validator(mode="after")
    def _knows_the_model(self) -> Self:
        if self.model.kind == SHELL and "secant" in self.analysis.model_fields_set:
            raise InputError(
                f"analysis.secant = {show(self.analysis.secant)}: is for superlinear bends, which "
                "a shell has not; leave it out"
            )
        return self

    @model_validator(mode="after")
    def _has_one_state(self) -> Self:
        stated = "state" in self.analysis.model_fields_set
        if self.initial is not None and stated:
            raise InputError(
                f"analysis.state = {show(self.analysis.state)}: the state is that of initial.file; "
                "leave out one of the two"
            )
        if self.initial is not None or self.analysis.state != "rest":
            return self
        remedy = 'write state = "equilibrium" under [analysis], or leave it out'
        if self.loads:
            raise InputError(f"loads[0]: does not act in the state of rest; {remedy}")
        for i, support in enumerate(self.supports):
            if support.axis is not None:
                raise InputError(
                    f"supports[{i}]: moves nothing in the state of rest; {remedy}, or hold its "
                    "nodes by axes"
                )
        return self


class ModesSchema(VibrationSchema):
    """A case file of kind "modes"."""

    analysis: ModesSection
    output: ModesOutput = ModesOutput()


class FrfSchema(VibrationSchema):
    """A case file of kind "frf"."""

    analysis: FrfSection
    drive: list[DriveSection] = Field(min_length=1)
    output: FrfOutput = FrfOutput()

    @model_validator(mode="after")
    def _moves_the_model(self) -> Self:
        if self.model.kind == SHELL:
            check_implicit("integrator", self.analysis.integrator)
        return self

    @model_validator(mode="after")
    def _drives_alike(self) -> Self:
        bases = [i for i, item in enumerate(self.drive) if item.base is not None]
        if bases and len(self.drive) > 1:
            raise InputError(
                f"drive[{bases[0]}]: a base drives alone, along one axis; run a case file for each"
            )
        if bases and self.output.quantity is not None:
            raise InputError(
                f"output.quantity = {show(self.output.quantity)}: a base drives, and what responds "
                "to it is shown as transmissibility; leave it out"
            )
        return self
