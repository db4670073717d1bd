"""The case file's contract: the sections that all kinds of analysis share, their keys and types.

Each kind's own sections are in its file of `analyses`. Limits of values live here only where a
message should name the key; everything else is checked by the objects that are built from the
sections. Validators raise InputError with a text that continues the key's path (" = -1: must be
...", ".kind: missing ...").
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import MISSING
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    PlainValidator,
    ValidationInfo,
    create_model,
    model_validator,
)

from foldyn.analyses.pattern_section import checked_pattern
from foldyn.analyses.ranges import SAMPLINGS, varied
from foldyn.analyses.ties import ties_of
from foldyn.arguments import Argument, Checked, arguments
from foldyn.cases.air import air_from
from foldyn.cases.contact import contact_from
from foldyn.cases.damping import (
    CreaseDamping,
    Damping,
    ModalDamping,
    Rayleigh,
    StrainDamping,
    dampings,
    dampings_of,
)
from foldyn.cases.decode import law_from
from foldyn.cases.directions import AXES, check_pairs
from foldyn.cases.loads import load_from
from foldyn.cases.masses import mass_from
from foldyn.cases.models import BARS_AND_HINGES, MODELS
from foldyn.cases.selection import check_nodes
from foldyn.cases.supports import support_from
from foldyn.errors import InputError, within
from foldyn.materials import BAR_LAWS, HINGE_LAWS
from foldyn.plots import ANIMATIONS
from foldyn.structures import PRESETS, PanelSheet, Sheet
from foldyn.structures.creases import per_crease
from foldyn.structures.rigid_plates import checked_panels
from foldyn.structures.structure import CALIBRATIONS, MEMBRANES, SCHEMES
from foldyn.values import MOST, choice, indices, number_or_list, numbers, show, vector

MOST_SHAPES = 12
"""Deformed shapes or modes that one figure shows at most."""


class Section(BaseModel):
    """A table of the case file: no unknown keys, no coercion, no NaN or infinity."""

    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)


def section_of(kind: type[Checked]) -> Any:
    """Section whose keys are the arguments of a data class, with the checks declared there."""
    keys: dict[str, Any] = {
        one.key: (Annotated[Any, _validator(one)], ... if one.default is MISSING else one.default)
        for one in arguments(kind).values()
    }
    return create_model(f"_{kind.__name__}", __base__=Section, **keys)


def _validator(argument: Argument) -> PlainValidator:
    return PlainValidator(lambda value: argument.checked("", value))


def one_of(known: Iterable[str]) -> PlainValidator:
    """Accept one of the known words."""
    return PlainValidator(lambda value: choice("", value, known))


def some_shapes(drawn: str, what: str, least: int = -MOST) -> PlainValidator:
    """Accept how many shapes are drawn, or their numbers.

    drawn : their name in messages, "modes"
    what : what the numbers count, "mode"
    least : the least of these numbers
    """

    def count_or_numbers(value: Any) -> int | tuple[int, ...]:
        if isinstance(value, int) and not isinstance(value, bool):
            if not 1 <= value <= MOST_SHAPES:
                raise InputError(
                    f" = {value}: give 1 to {MOST_SHAPES} {drawn}, or a list of {what} numbers"
                )
            return value
        chosen = indices("", value, what, f"or how many {drawn} to draw")
        if min(chosen) < least:
            raise InputError(f" = {show(value)}: {what}s are counted from {least}")
        if len(chosen) > MOST_SHAPES:
            raise InputError(f": {len(chosen)} {what}s; give at most {MOST_SHAPES}")
        return chosen

    return PlainValidator(count_or_numbers)


def _masses(value: Any, info: ValidationInfo) -> list[str]:
    names = value if isinstance(value, list) else [value]
    known = known_masses(info)
    if not names:
        raise InputError(f" = []: give at least one of {', '.join(known)}")
    for i, name in enumerate(names):
        check_mass(f"[{i}]" if isinstance(value, list) else "", name, info)
        if name in names[:i]:
            raise InputError(f"[{i}] = {show(name)}: is listed twice")
    return names


def known_masses(info: ValidationInfo) -> list[str]:
    """Distributions of mass of the model, or of all models where its kind is wrong."""
    kinds = [info.data["kind"]] if "kind" in info.data else list(MODELS)
    return [name for kind in kinds for name in MODELS[kind].masses]


def check_mass(place: str, name: Any, info: ValidationInfo) -> str:
    """Return a distribution of mass that the model has."""
    known = known_masses(info)
    for kind, other in MODELS.items():
        if isinstance(name, str) and name in other.masses and name not in known:
            raise InputError(
                f"{place} = {show(name)}: only for model.kind = {show(kind)}; choose one of "
                f"{', '.join(known)}"
            )
    return choice(place, name, known)


def part(read: Callable[[Any, Path | None], Any], **why: str) -> PlainValidator:
    """Accept the table of a load or support; some keys may be refused, each for a reason."""

    def read_part(value: Any, info: ValidationInfo) -> Any:
        for key in why:
            if isinstance(value, Mapping) and key in value:
                raise InputError(f" = {show(value[key])}: {why[key]}", f".{key}")
        return read(value, (info.context or {}).get("folder"))

    return PlainValidator(read_part)


def contact_part(history: str = "") -> PlainValidator:
    """Accept the table of contact; histories of planes may be refused, for a reason."""

    def read(value: Any, folder: Path | None) -> Any:
        planes = value.get("planes", []) if isinstance(value, Mapping) else []
        for i, plane in enumerate(planes if isinstance(planes, list) else []):
            if history and isinstance(plane, Mapping) and "history" in plane:
                given = show(plane["history"])
                raise InputError(f" = {given}: {history}", f".planes[{i}].history")
        return contact_from(value, folder)

    return part(read)


def _per_crease(value: Any) -> Any:
    """Accept a number for all creases, one for each, or a table by name."""
    return per_crease(
        "", value if isinstance(value, Mapping) else number_or_list("", value, "crease")
    )


Positive = Annotated[float, Field(gt=0)]
Count = Annotated[int, Field(ge=1, le=MOST)]
Whole = Annotated[int, Field(ge=-MOST, le=MOST)]
Nodes = Annotated[Any, PlainValidator(lambda value: check_nodes("", value))]
Vector = Annotated[Any, PlainValidator(lambda value: vector("", value))]
BarLawSpec = Annotated[Any, PlainValidator(lambda value: law_from(value, BAR_LAWS))]
HingeLawSpec = Annotated[Any, PlainValidator(lambda value: law_from(value, HINGE_LAWS))]
PerCrease = Annotated[Any, PlainValidator(_per_crease)]
Edges = Annotated[Any, PlainValidator(lambda value: _edges(value))]
Rigid = Annotated[Any, PlainValidator(lambda value: checked_panels(value, MOST, ""))]
Animation = Annotated[str, one_of(ANIMATIONS)]


def _edges(value: Any) -> Any:
    return check_nodes("", value) if isinstance(value, str) else check_pairs("", value)


class PanelsSection(section_of(PanelSheet)):
    """[[sheet.panels]]: arguments of `PanelSheet`."""


class SheetSection(section_of(Sheet)):
    """[sheet]: arguments of `Sheet`."""

    panels: list[PanelsSection] = []


class ModelSection(Section):
    """[model]: arguments of `discretize` or `shell`; what is left out has its default there."""

    kind: Annotated[str, one_of(MODELS)] = BARS_AND_HINGES
    preset: Annotated[Any, one_of(PRESETS)] = None
    scheme: Annotated[Any, one_of(SCHEMES)] = None
    divisions: Count | None = None
    mass: Annotated[list[str] | None, PlainValidator(_masses)] = None
    bar_law: BarLawSpec = None
    fold_law: HingeLawSpec = None
    bend_law: HingeLawSpec = None
    calibration: Annotated[Any, one_of(CALIBRATIONS)] = None
    crease_stiffness: PerCrease = None
    crease_rest: PerCrease = None
    clamped: Edges = None
    rigid: Rigid = None
    vertex_radius: Positive | None = None
    straight: Edges = None
    membrane: Annotated[Any, one_of(MEMBRANES)] = None

    @model_validator(mode="after")
    def _fits_the_kind(self) -> Self:
        model = MODELS[self.kind]
        strange = [
            key
            for key in type(self).model_fields
            if key in self.model_fields_set - {"kind"} and key not in model.keys
        ]
        if strange:
            owner = next(kind for kind, other in MODELS.items() if strange[0] in other.keys)
            raise InputError(
                f".{strange[0]}: only for model.kind = {show(owner)}; {model.name} "
                f"{'have' if self.kind == BARS_AND_HINGES else 'has'} no {', '.join(strange)}: "
                f"leave {'it' if len(strange) == 1 else 'them'} out"
            )
        return self

    @property
    def options(self) -> dict[str, Any]:
        """What the file says of the options of its model, but for the mass."""
        given = self.model_fields_set - {"kind", "mass"}
        return {key: getattr(self, key) for key in MODELS[self.kind].keys if key in given}


class ShownSection(Section):
    """[output]: nodes that figures show, and the axis along which they do."""

    nodes: Nodes = None
    axis: Annotated[Any, one_of(AXES)] = None


def _ratios(value: Any) -> list[list[float]]:
    array = numbers("", value)
    if array.shape != (2, 2):
        raise InputError(
            f" = {show(value)}: must be two pairs of a frequency (Hz) and the damping ratio there, "
            "as in [[9.3, 0.135], [16.7, 0.09]]"
        )
    return array.tolist()


def _dampings(kind: Any) -> PlainValidator:
    """Accept what stands under the key of a kind of damping."""
    return PlainValidator(lambda value: dampings_of(kind, value))


class DampingSection(section_of(Rayleigh)):
    """[damping]: Rayleigh coefficients, or two damping ratios; modes, creases, strain rates."""

    ratios: Annotated[Any, PlainValidator(_ratios)] = None
    modal: Annotated[Any, _dampings(ModalDamping)] = ()
    creases: Annotated[Any, _dampings(CreaseDamping)] = ()
    strain: Annotated[Any, _dampings(StrainDamping)] = ()

    @model_validator(mode="after")
    def _either(self) -> Self:
        if self.ratios is not None and self.model_fields_set & {"alpha", "beta"}:
            raise InputError(
                f" = {show(self.ratios)}: they give alpha and beta; leave those out, or ratios",
                ".ratios",
            )
        return self

    def made(self) -> Damping | tuple[Damping, ...]:
        """The damping."""
        others = [*self.modal, *self.creases, *self.strain]
        if others and not self.model_fields_set & {"alpha", "beta", "ratios"}:
            return dampings(others)
        return dampings([self._rayleigh(), *others])

    def _rayleigh(self) -> Rayleigh:
        if self.ratios is None:
            return Rayleigh(self.alpha, self.beta, self.state)
        (f1, z1), (f2, z2) = self.ratios
        with within(f".ratios = {show(self.ratios)}: "):
            return Rayleigh.from_ratios(f1, z1, f2, z2, self.state)


class SweepSection(Section):
    """[sweep]: arguments of `sweep`."""

    samples: Count | None = None
    method: Annotated[str, one_of(SAMPLINGS)] = SAMPLINGS[0]
    seed: Annotated[int, Field(ge=0, le=MOST)] = 0
    vary: Annotated[
        Any, PlainValidator(lambda v, info: varied(v, info.data.get("samples") is not None))
    ]
    ties: Annotated[Any, PlainValidator(ties_of)] = ()
    measures: list[str] = []


class DesignSection(Section):
    """[design]: arguments of `design`."""

    bounds: dict[str, Any]
    minimize: str | None = None
    maximize: str | None = None
    subject_to: list[str] = []
    start: dict[str, Any] = {}
    method: str = "slsqp"
    starts: Count = 1
    seed: Annotated[int, Field(ge=0, le=MOST)] = 0
    tolerance: Positive = 1e-6
    slack: Positive = 1e-4
    max_evaluations: Count = 1000


class CaseSchema(Section):
    """The sections that every case file may have."""

    title: str = ""
    pattern: Annotated[dict[str, Any], PlainValidator(checked_pattern)]
    sheet: SheetSection
    model: ModelSection = ModelSection()
    damping: DampingSection = DampingSection()
    supports: list[Annotated[Any, part(support_from)]] = []
    loads: list[Annotated[Any, part(load_from)]] = []
    masses: list[Annotated[Any, part(mass_from)]] = []
    contact: Annotated[Any, contact_part()] = None
    air: Annotated[Any, part(air_from)] = None
    sweep: SweepSection | None = None
    design: DesignSection | None = None
