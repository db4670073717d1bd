"""The case file's contract for motions and paths: what each takes, and what its output may be.

A path has no time: what only a motion can use (histories, moving bases, spectra, lists of mass
rules) is refused, as it would be left out without a word otherwise.
"""

from __future__ import annotations

from typing import Annotated, Any, Self

from pydantic import Field, PlainValidator, ValidationInfo, model_validator

from foldyn.cases.models import MASSLESS_METHODS, SHELL
from foldyn.cases.schema import (
    CaseSchema,
    Count,
    LoadSection,
    ModelSection,
    Nodes,
    Positive,
    Section,
    SupportSection,
    Vector,
    Whole,
    check_mass,
)
from foldyn.cases.supports import check_axis
from foldyn.errors import InputError
from foldyn.values import choice, indices, number, show, whole

AXES = ("x", "y", "z")
DIRECTIONS = (*AXES, "-x", "-y", "-z")
METHODS = (
    "rk4",
    "central_difference",
    "dormand_prince",
    "newmark",
    "generalized_alpha",
    "energy_momentum",
)
"""Integrators that a case file may name, beside "auto"."""
PATH_METHODS = ("newton", "displacement", "mgdcm", "arc_length")
"""Methods of following a path that a case file may name."""
ANIMATIONS = ("gif", "mp4")
"""Kinds of animation that a case file may name."""
MOST_SHAPES = 12
"""Deformed shapes that one figure shows at most."""


def _every(value: Any) -> int | float:
    if isinstance(value, int) and not isinstance(value, bool):
        return whole("", value, least=1, what="steps")
    return number("", value, above=0.0)


def _result_file(value: Any) -> str:
    if not isinstance(value, str) or not value:
        raise InputError(f" = {show(value)}: must be the path of a result, as result.nc")
    return value


def _one_mass(value: Any, info: ValidationInfo) -> list[str]:
    if isinstance(value, list):
        raise InputError(
            f" = {show(value)}: a path is computed once; give one rule, or none: only gravity and "
            "inertia relief use the mass"
        )
    return [check_mass("", value, info)]


def _timeless(value: Any) -> None:
    raise InputError(
        f" = {show(value)}: a path has no time; leave it out: what loads and moves the structure "
        "grows with the load factor (or is named in analysis.constant)"
    )


def _no_base(value: Any) -> None:
    raise InputError(
        f" = {show(value)}: a base moves over time, which a path has not; give nodes, axis and "
        "displacement instead"
    )


def _constant(value: Any) -> str | tuple[int, ...]:
    if value == "gravity":
        return "gravity"
    if isinstance(value, str):
        raise InputError(f' = {show(value)}: give "gravity", or numbers of [[loads]], as in [0]')
    return indices("", value, "load", 'or "gravity"')


def _load_factors(value: Any) -> list[float]:
    if not isinstance(value, list) or not value:
        raise InputError(f" = {show(value)}: must be a list of numbers, as in [0, 0.5, 1]")
    return [number(f"[{i}]", item) for i, item in enumerate(value)]


def _shapes(value: Any) -> int | tuple[int, ...]:
    if isinstance(value, int) and not isinstance(value, bool):
        if not 1 <= value <= MOST_SHAPES:
            raise InputError(f" = {value}: give 1 to {MOST_SHAPES} shapes, or a list of points")
        return value
    chosen = indices("", value, "point", "or how many shapes to draw")
    if len(chosen) > MOST_SHAPES:
        raise InputError(f": {len(chosen)} points; give at most {MOST_SHAPES}")
    return chosen


def _animation() -> PlainValidator:
    return PlainValidator(lambda value: choice("", value, ANIMATIONS))


class DynamicsSection(Section):
    """[analysis] of kind "dynamics": arguments of `simulate`."""

    kind: str
    duration: Positive
    method: Annotated[str, PlainValidator(lambda value: choice("", value, ("auto", *METHODS)))] = (
        "rk4"
    )
    dt: Positive | None = None
    force: bool = False
    tolerance: Positive | None = None
    start: float = 0.0
    spectral_radius: Annotated[float, Field(ge=0.0, le=1.0)] | None = None


class UntilSection(Section):
    """Where a path ends: a node's displacement along an axis reaches a value."""

    node: Whole
    axis: Annotated[str, PlainValidator(lambda value: check_axis("", value))]
    displacement: Annotated[float, PlainValidator(lambda value: number("", value))]

    @model_validator(mode="after")
    def _moves(self) -> Self:
        if self.displacement == 0.0:
            raise InputError(".displacement = 0: the path begins there; give where it shall end")
        return self


class StaticsSection(Section):
    """[analysis] of kind "statics": arguments of `trace` and of its settings."""

    kind: str
    method: Annotated[str, PlainValidator(lambda value: choice("", value, PATH_METHODS))] = "newton"
    load_factors: Annotated[list[float] | None, PlainValidator(_load_factors)] = None
    steps: Count | None = None
    first_step: float | None = None
    constant: Annotated[str | tuple[int, ...], PlainValidator(_constant)] = ()
    until: UntilSection | None = None
    inertia_relief: bool = False
    tolerance: Annotated[float, Field(ge=1e-14, le=1e-2)] = 1e-9
    largest_turn: Positive = 10.0
    stability: bool = True


class MotionStart(Section):
    """[initial] of a motion: a rigid motion, or a stored state."""

    velocity: Vector = None
    spin: Vector = None
    file: Annotated[Any, PlainValidator(_result_file)] = None
    at: Whole = -1

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        given = self.model_fields_set
        rigid = sorted(given & {"velocity", "spin"})
        if not given:
            raise InputError(": give velocity or spin or both, or file (a result)")
        if "file" in given and rigid:
            raise InputError(
                f".file: holds the velocities too; leave out {' and '.join(reversed(rigid))}"
            )
        if "at" in given and "file" not in given:
            raise InputError(".at: is the number of a sample of a result; give file too")
        return self


class PathStart(Section):
    """[initial] of a path: the stored state near which its first point is sought."""

    file: Annotated[str, PlainValidator(_result_file)]
    at: Whole = -1


class MotionOutput(Section):
    """[output] of a motion: what is kept and shown."""

    nodes: Nodes = None
    axis: Annotated[Any, PlainValidator(lambda value: choice("", value, AXES))] = None
    every: Annotated[Any, PlainValidator(_every)] = None
    max_frequency: Positive | None = None
    animation: Annotated[str, _animation()] = "gif"


class PathOutput(Section):
    """[output] of a path: what is shown."""

    nodes: Nodes = None
    axis: Annotated[Any, PlainValidator(lambda value: choice("", value, DIRECTIONS))] = None
    shapes: Annotated[int | tuple[int, ...], PlainValidator(_shapes)] = 4
    animation: Annotated[str, _animation()] = "gif"


class PathModel(ModelSection):
    """[model] of a path, with one mass rule at most."""

    mass: Annotated[list[str] | None, PlainValidator(_one_mass)] = None


class PathSupport(SupportSection):
    """One of the [[supports]] of a path: nodes held, or moved with the load factor."""

    base: Annotated[Any, PlainValidator(_no_base)] = None
    history: Annotated[Any, PlainValidator(_timeless)] = None


class PathLoad(LoadSection):
    """One of the [[loads]] of a path, which grow with the load factor."""

    history: Annotated[Any, PlainValidator(_timeless)] = None


class MotionSchema(CaseSchema):
    """A case file of kind "dynamics"."""

    initial: MotionStart | None = None
    analysis: DynamicsSection
    output: MotionOutput = MotionOutput()

    @model_validator(mode="after")
    def _moves_the_model(self) -> Self:
        if self.model.kind == SHELL:
            if "method" not in self.analysis.model_fields_set:
                self.analysis.method = "auto"
            check_implicit("method", self.analysis.method, ("auto", *MASSLESS_METHODS))
        return self


def check_implicit(key: str, method: str | None, fit: tuple[str, ...] = MASSLESS_METHODS) -> None:
    """Refuse an integrator that a shell cannot have."""
    if method is not None and method not in fit:
        raise InputError(
            f"analysis.{key} = {show(method)}: needs mass everywhere, and the rotations of a shell "
            f"have none; choose one of {', '.join(fit)}, or leave it out"
        )


class PathSchema(CaseSchema):
    """A case file of kind "statics"."""

    model: PathModel = PathModel()
    supports: list[PathSupport] = Field(default_factory=list)
    loads: list[PathLoad] = Field(default_factory=list)
    initial: PathStart | None = None
    analysis: StaticsSection
    output: PathOutput = PathOutput()
