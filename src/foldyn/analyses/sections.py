"""The tables of case files that all kinds of analysis share, with their keys and types.

The tables of each kind are in its file in `analyses`. Limits of values are here only if a message
should name the key; the objects that are built from the tables check the rest.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Annotated, Any, NamedTuple

from foldyn.analyses.keys import Tie, ties_of
from foldyn.analyses.pattern_section import PatternOf
from foldyn.analyses.ranges import SAMPLINGS, Varied, varied
from foldyn.arguments import Check, Placed, arguments
from foldyn.cases.air import Air
from foldyn.cases.contact import Contact
from foldyn.cases.damping import DampingSection
from foldyn.cases.decode import KindOf, law_from, laws_from
from foldyn.cases.directions import AXES, check_pairs
from foldyn.cases.loads import LOAD
from foldyn.cases.masses import MASS
from foldyn.cases.models import BARS_AND_HINGES, MODELS, SUPERELEMENTS
from foldyn.cases.selection import Nodes, check_nodes
from foldyn.cases.supports import SUPPORT
from foldyn.condensation import superelements
from foldyn.condensation.shapes import LEVELS
from foldyn.errors import InputError
from foldyn.materials import BAR_LAWS, HINGE_LAWS
from foldyn.plots import ANIMATIONS
from foldyn.shells import shell
from foldyn.structures import PRESETS, Sheet, discretize
from foldyn.structures.calibration import folds_given, per_crease
from foldyn.structures.rigid_plates import checked_panels
from foldyn.structures.structure import CALIBRATIONS, MEMBRANES, SCHEMES
from foldyn.tables import ListOf, Section, TableOf, check_table
from foldyn.values import (
    MOST,
    choice,
    indices,
    number,
    number_or_list,
    numbers,
    show,
    vector,
    whole,
)

RULES = [name for model in MODELS.values() for name in model.masses]
MOST_SHAPES = 12
"""Largest number of shapes or modes in one figure."""


def text(name: str, value: Any) -> str:
    """Return `value` if it is a text."""
    if not isinstance(value, str):
        raise InputError(f" = {show(value)}: must be text", name)
    return value


def result_file(name: str, value: Any) -> str:
    """Return `value` if it can be the path of a result."""
    if not isinstance(value, str) or not value:
        raise InputError(f" = {show(value)}: must be the path of a result, such as result.nc", name)
    return value


def switch(name: str, value: Any) -> bool:
    """Return `value` if it is true or false."""
    if not isinstance(value, bool):
        raise InputError(f" = {show(value)}: must be true or false", name)
    return value


def whole_number(name: str, value: Any, *, least: int = 1, most: int = MOST) -> int:
    """Return `value` if it is a whole number within bounds."""
    count = whole(name, value)
    number(name, count, least=least, most=most)
    return count


def some_shapes(
    name: str, value: Any, drawn: str, what: str, least: int = -MOST
) -> int | tuple[int, ...]:
    """Return the number of drawn shapes, or their numbers.

    drawn : name of the shapes in messages, such as "modes"
    what : name of a single shape, such as "mode"
    least : the smallest number
    """
    if isinstance(value, int) and not isinstance(value, bool):
        if not 1 <= value <= MOST_SHAPES:
            raise InputError(
                f" = {value}: give 1 to {MOST_SHAPES} {drawn}, or a list of {what} numbers", name
            )
        return value
    chosen = indices(name, value, what, f"or how many {drawn} to draw")
    if min(chosen) < least:
        raise InputError(f" = {show(value)}: {what}s are counted from {least}", name)
    if len(chosen) > MOST_SHAPES:
        raise InputError(f": {len(chosen)} {what}s; give at most {MOST_SHAPES}", name)
    return chosen


def _masses(name: str, value: Any, beside: Mapping[str, Any]) -> list[str]:
    names = value if isinstance(value, list) else [value]
    if not names:
        raise InputError(f" = []: give at least one of {', '.join(known_masses(beside))}", name)
    for i, one in enumerate(names):
        place = f"{name}[{i}]" if isinstance(value, list) else name
        check_mass(place, one, beside)
        if one in names[:i]:
            raise InputError(f" = {show(one)}: is listed twice", place)
    return names


def known_masses(beside: Mapping[str, Any]) -> list[str]:
    """Mass rules of the model, or of all models if the kind of model is invalid."""
    kinds = [beside["kind"] or BARS_AND_HINGES] if "kind" in beside else list(MODELS)
    return [name for kind in kinds for name in MODELS[kind].masses]


def check_mass(name: str, value: Any, beside: Mapping[str, Any]) -> str:
    """Return `value` if it is a mass rule of the model."""
    known = known_masses(beside)
    for kind, other in MODELS.items():
        if isinstance(value, str) and value in other.masses and value not in known:
            raise InputError(
                f" = {show(value)}: only for model.kind = {show(kind)}; choose one of "
                f"{', '.join(known)}",
                name,
            )
    return choice(name, value, known)


def still(name: str, value: Any, why: str) -> Any:
    """Refuse histories of planes in a contact table."""
    planes = value.get("planes", []) if isinstance(value, Mapping) else []
    for i, plane in enumerate(planes if isinstance(planes, list) else []):
        if isinstance(plane, Mapping) and "history" in plane:
            raise InputError(f" = {show(plane['history'])}: {why}", f"{name}.planes[{i}].history")
    return value


def _per_crease(name: str, value: Any) -> Any:
    """Return a number for all creases, a list with one for each, or a table by name."""
    given = value if isinstance(value, Mapping) else number_or_list(name, value, "crease")
    return per_crease(name, given)


def _folds(name: str, value: Any) -> Any:
    """Return the same for stiffness, with tables of strips."""
    return folds_given(name, value) if isinstance(value, Mapping) else _per_crease(name, value)


def _edges(name: str, value: Any) -> Any:
    return check_nodes(name, value) if isinstance(value, str) else check_pairs(name, value)


def _vary(value: Any, beside: Mapping[str, Any]) -> Any:
    return varied(value, beside.get("samples") is not None)


def one_of(known: Iterable[str]) -> Check:
    """Accept one of some words."""
    return Check(choice, known=known)


Text = Annotated[str, Check(text)]
Texts = Annotated[Sequence[str], ListOf(Check(text), "a list of texts")]
Anything = Annotated[Mapping[str, Any], Check(check_table)]
Switch = Annotated[bool, Check(switch)]
Positive = Annotated[float, Check(number, above=0.0)]
Count = Annotated[int, Check(whole_number)]
Whole = Annotated[int, Check(whole_number, least=-MOST)]
Seed = Annotated[int, Check(whole_number, least=0)]
Vector = Annotated[Sequence[float] | None, Check(vector)]
HingeLaw = Annotated[Any, KindOf(law_from, HINGE_LAWS, named=True, laws=HINGE_LAWS)]
FoldLaws = Annotated[Any, KindOf(laws_from, HINGE_LAWS, named=True, several=True, laws=HINGE_LAWS)]
BarLaw = Annotated[Any, KindOf(law_from, BAR_LAWS, named=True, laws=BAR_LAWS)]
PerCrease = Annotated[float | Sequence[float] | Mapping[str, float] | None, Check(_per_crease)]
Folds = Annotated[float | Sequence[float] | Mapping[str, Any] | None, Check(_folds)]
Edges = Annotated[str | Sequence[Sequence[int]] | None, Check(_edges)]
Animation = Annotated[str | None, one_of(ANIMATIONS)]


class Choice(NamedTuple):
    """The kind of model of a case file, and why not superelements if the file leaves it open."""

    kind: str
    why: str = ""
    open: bool = False

    @property
    def told(self) -> str:
        """What an open choice fell on, in words; "" if nobody asks."""
        name = MODELS[self.kind].name
        if self.kind == SUPERELEMENTS and self.open:
            return f"{name}, the default of linear analyses"
        return f"{name}, as superelements {self.why}" if self.why else ""


class ModelSection(Section):
    """[model]: arguments of `discretize`, `shell` or `superelements`, with their defaults.

    Parameters
    ----------
    kind : {"bars_and_hinges", "shell", "superelements"}, optional
        Kind of model; by default superelements for linear analyses of what they take, unless a key
        is given that only bars and hinges have, or a mass rule, and bars and hinges otherwise.
    mass : str or sequence of str
        Mass rule; a list compares several.
    """

    like = (discretize, shell, superelements)
    kind: Annotated[str | None, one_of(MODELS)] = None
    preset: Annotated[str | None, one_of(PRESETS)] = None
    scheme: Annotated[str | None, one_of(SCHEMES)] = None
    level: Annotated[int | None, Check(whole_number, most=len(LEVELS))] = None
    divisions: Count | None = None
    mass: Annotated[str | Sequence[str] | None, Check(_masses, words=RULES)] = None
    bar_law: BarLaw = None
    fold_law: FoldLaws = None
    bend_law: HingeLaw = None
    calibration: Annotated[str | None, one_of(CALIBRATIONS)] = None
    crease_stiffness: Folds = None
    crease_rest: PerCrease = None
    clamped: Edges = None
    rigid: Annotated[
        int | str | Sequence[int] | None,
        Placed(checked_panels, count=MOST, field="", words=("all",)),
    ] = None
    vertex_radius: Positive | None = None
    straight: Edges = None
    membrane: Annotated[str | None, one_of(MEMBRANES)] = None

    def agree(self) -> None:
        """Refuse keys of other models."""
        model = MODELS[self.kind or BARS_AND_HINGES]
        beyond = self.stated - {"kind", *model.keys}
        strange = [key for key in arguments(type(self)) if key in beyond]
        if strange:
            owner = next(kind for kind, other in MODELS.items() if strange[0] in other.keys)
            raise InputError(
                f": only for model.kind = {show(owner)}; {model.name} "
                f"{'has' if model.name.startswith('a ') else 'have'} no {', '.join(strange)}: "
                f"leave {'it' if len(strange) == 1 else 'them'} out",
                strange[0],
            )

    @property
    def open(self) -> bool:
        """Whether the analysis decides on the kind of model."""
        return self.stated <= shared_keys()

    def options(self, kind: str) -> dict[str, Any]:
        """Options of a kind of model that the file gives, without the mass rule."""
        given = self.stated - {"kind", "mass"}
        return {key: getattr(self, key) for key in MODELS[kind].keys if key in given}


def shared_keys() -> set[str]:
    """Keys of [model] that leave the kind open: those of bars and hinges and superelements."""
    return {*MODELS[BARS_AND_HINGES].keys} & {*MODELS[SUPERELEMENTS].keys} - {"mass"}


class AnalysisSection(Section):
    """[analysis]; each kind of analysis adds its keys."""

    kind: Text


class ShownSection(Section):
    """[output]: nodes that figures show, and the axis along which motion is shown.

    Parameters
    ----------
    nodes : int, sequence of int, or str
        Node numbers or a selection; by default the loaded, driven or moved nodes.
    axis : {"x", "y", "z"}, optional
        Component that figures show; by default the component with the largest motion.
    """

    nodes: Nodes | None = None
    axis: Annotated[str | None, one_of(AXES)] = None


class SweepSection(Section):
    """[sweep]: arguments of `sweep`.

    Parameters
    ----------
    vary : mapping
        Keys of the file in quotes, each with a range A:B:N, A:B:N:log or a list of values; with
        `samples` A:B or A:B:log.
    samples : int, optional
        Number of sampled points, instead of all combinations.
    method : {"latin_hypercube", "sobol", "saltelli"}
        Sampling method.
    seed : int
        Random seed of the samples.
    ties : mapping, optional
        Dependent keys, each with its expression.
    measures : sequence of str
        Measures of each result, such as "peak_frequency[8]".
    """

    samples: Count | None = None
    method: Annotated[str, one_of(SAMPLINGS)] = SAMPLINGS[0]
    seed: Seed = 0
    vary: Annotated[tuple[Varied, ...], Placed(_vary, given=Mapping[str, Any])]
    ties: Annotated[tuple[Tie, ...], Placed(ties_of, given=Mapping[str, str])] = ()
    measures: Texts = ()


class DesignSection(Section):
    """[design]: arguments of `design`.

    Parameters
    ----------
    bounds : mapping
        Keys of the file in quotes, each with its lower and upper bound.
    minimize, maximize : str, optional
        Expression of measures; give exactly one of `minimize` and `maximize`.
    subject_to : sequence of str
        Constraints, such as "frequency[1] >= 12".
    guess : mapping, optional
        Values to begin from; by default the file's.
    method : {"slsqp", "trust-constr", "mma", "cma"}
        Method of the search.
    searches : int
        Number of searches; all but the first start from random designs.
    seed : int
        Random seed of these designs.
    tolerance : float
        Relative change of the objective at which a search ends.
    slack : float
        Relative violation of a constraint that counts as none.
    max_evaluations : int
        Largest number of evaluations in each search.
    """

    bounds: Anything
    minimize: Text | None = None
    maximize: Text | None = None
    subject_to: Texts = ()
    guess: Anything | None = None
    method: Text = "slsqp"
    searches: Count = 1
    seed: Seed = 0
    tolerance: Positive = 1e-6
    slack: Positive = 1e-4
    max_evaluations: Count = 1000


def _amplitudes(name: str, value: Any) -> float | tuple[float, ...]:
    given = numbers(name, value)
    if given.ndim > 1 or not given.size:
        raise InputError(f" = {show(value)}: give a number (m), or a list with one a shape", name)
    return float(given) if given.ndim == 0 else tuple(given.tolist())


class ImperfectionSection(Section):
    """[imperfection]: vertices that are a little off; arguments of `imperfect`.

    Parameters
    ----------
    amplitude : float or sequence of float
        Standard deviation of a random field, or largest displacements of shapes (m).
    correlation : float, optional
        Length (m) over which a random field is alike.
    seed : int
        Of the random field.
    file : str, optional
        Result of buckling or of modes with shapes, relative to the case file.
    modes : int or sequence of int
        Numbers of its modes, from 1.
    """

    amplitude: Annotated[float | Sequence[float], Check(_amplitudes)]
    correlation: Positive | None = None
    seed: Seed = 0
    file: Annotated[str | None, Check(result_file)] = None
    modes: Annotated[int | Sequence[int], Check(some_shapes, drawn="modes", what="mode")] = 1

    def agree(self) -> None:
        """Require either a random field or shapes."""
        given = self.stated
        if ("correlation" in given) == ("file" in given):
            raise InputError(": give correlation (of a random field) or file (with shapes)")
        other = "seed" if "file" in given else "modes"
        if other in given:
            why = "shapes of a file" if other == "seed" else "a random field"
            raise InputError(f": is not for {why}; leave it out", other)


class NoOutput(Section):
    """[output] of a kind of analysis without such keys."""


class CaseSchema(Section):
    """The tables that every case file may have.

    Parameters
    ----------
    title : str
        Title of the page.
    """

    title: Text = ""
    pattern: Annotated[Mapping[str, Any], PatternOf()]
    imperfection: ImperfectionSection | None = None
    sheet: Annotated[Sheet, TableOf(Sheet)]
    model: ModelSection = ModelSection()
    damping: DampingSection = DampingSection()
    supports: Annotated[Sequence[Any], ListOf(SUPPORT)] = ()
    loads: Annotated[Sequence[Any], ListOf(LOAD)] = ()
    masses: Annotated[Sequence[Any], ListOf(MASS)] = ()
    contact: Annotated[Contact | None, TableOf(Contact)] = None
    air: Annotated[Air | None, TableOf(Air)] = None
    sweep: SweepSection | None = None
    design: DesignSection | None = None
    output: NoOutput = NoOutput()
