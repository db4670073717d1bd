"""`sensitivity`: measures of a result, and their exact gradients."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from inspect import signature
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import sparse

from foldyn.analyses import CaseFile
from foldyn.analyses.keys import replaced
from foldyn.analyses.model_choice import ANEW
from foldyn.analyses.reading import case_of_document, read_document
from foldyn.analyses.sections import Choice
from foldyn.cases import Case
from foldyn.cases.models import BARS_AND_HINGES
from foldyn.dynamics import simulate
from foldyn.dynamics.inertia import is_lumped
from foldyn.errors import InputError, within
from foldyn.gradients.cells import CellGradient
from foldyn.gradients.chain import Chain, Wanted, beside
from foldyn.gradients.expressions import parse
from foldyn.gradients.measures import Derivative, Seeds, derivative_of, one_number
from foldyn.gradients.motion import MotionGradient
from foldyn.gradients.parameters import Differentiated, Gradient, Parameters, Slope, Values, checked
from foldyn.gradients.path import PathGradient
from foldyn.gradients.vibrations import FrfGradient, ModesGradient
from foldyn.input_files import path_of
from foldyn.linear import effective, frf, modes
from foldyn.statics import trace
from foldyn.structures import Structure
from foldyn.structures.discretized import Discretized
from foldyn.sweeps.cell_measures import EFFECTIVE
from foldyn.sweeps.job import ASIDE
from foldyn.sweeps.measure import of_callable
from foldyn.values import choice, listed, of_kind, show

KINDS: Mapping[str, Callable[[Any, Mapping[str, Any]], Differentiated]] = {
    "modes": ModesGradient,
    "dynamics": MotionGradient,
    "statics": PathGradient,
    "frf": FrfGradient,
    "effective": CellGradient,
}
"""Analyses with gradients, by their kind in case files."""
FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    "modes": modes, "frf": frf, "dynamics": simulate, "statics": trace, "effective": effective,
}  # fmt: skip
"""Function of each analysis; its signature defines the arguments of the analysis."""
LENGTH = "bar_length"
ARRAYS = (
    "fold_stiffness", "fold_rest", "bend_stiffness", "bend_rest", "bar_area", LENGTH,
    "node_mass",
)  # fmt: skip
"""Arrays of a structure that can themselves be parameters."""
Source = Callable[..., Case] | Case | str | os.PathLike[str]
Own = tuple[Callable[..., float], Callable[..., Seeds]]


def sensitivity(
    build: Source,
    parameters: Values | Sequence[str],
    *,
    measures: str | Sequence[str] | Mapping[str, Own],
    analysis: Mapping[str, Any] | None = None,
    sizes: Values | None = None,
    along: Values | None = None,
) -> xr.Dataset:
    """Values of measures of a result, and their exact gradients.

    Parameters
    ----------
    build : callable, Case or path
        ``build(**parameters)`` returns the case; or a case file, with parameters named by keys of
        the file, such as "pattern.panel_angle"; or a case, with arrays of its structure as
        parameters:
        `fold_stiffness` and `bend_stiffness` (N m/rad, of whole hinges), `fold_rest` and
        `bend_rest` (rad), `bar_area` (m2), `bar_length` (m, the cut length: bars that do not fit
        are strained at rest), `node_mass` (kg).
    parameters : mapping, or names of arrays of a case
        Values at which the gradient is taken: numbers, or arrays of one dimension, in which each
        entry is a parameter. Arrays of a case that are given by name alone keep their values.
    measures : str, sequence of str, or mapping
        Measures as in a sweep, such as "frequency[2]", and expressions of measures, such as
        "-frequency[2] / frequency[1]". Or a mapping from names to your own measures, each a pair of
        functions of the result and the case: one returns the measure, the other its derivatives
        with respect to variables of the result, by name.
    analysis : mapping, optional
        The analysis: its kind, "modes", "statics", "dynamics", "frf" or "effective", and arguments
        of `fd.modes`, `fd.trace`, `fd.simulate`, `fd.frf` or `fd.effective`; for the last, `build`
        returns a `UnitCell`. A case file contains its own analysis.
    sizes : mapping, optional
        Sizes of parameters that are 0 where the gradient is taken: differences change a parameter
        by a thousandth of its size.
    along : mapping, optional
        A direction, as rates of the parameters. The result then contains one derivative, in this
        direction; it exists also for modes of equal frequency.

    Returns
    -------
    xarray.Dataset
        `value` (measure,), and for each parameter `gradient_<name>` (measure,), or for an array
        (measure, <name>_entry), per unit of the parameter; with `along`, `derivative` (measure,)
        instead of gradients. Attributes: the kind of the analysis and the total time.

    Raises
    ------
    InputError
        A measure or a parameter has no derivative at these values; the message gives the reason and
        a remedy.
    ComputationError
        The analysis fails.

    Warns
    -----
    FoldynWarning
        Numbers of the case have a kink at these values: the gradient is the mean of both sides.

    Notes
    -----
    Derivatives of the mechanics are analytic, but for stresses, moments of creases, margins and
    effective properties, which are differenced. Derivatives of a case's numbers with respect to the
    parameters are central differences of fourth order, for which no equations are solved. Motions
    are differentiated as computed, step by step, with fixed steps: give `dt` if the step should not
    depend on the case.

    Examples
    --------
    >>> import foldyn as fd
    >>> def build(panel_angle):
    ...     pattern = fd.patterns.miura(panel_angle=panel_angle)
    ...     sheet = fd.Sheet(1e6, 0.25, 0.01, 1000.0)
    ...     return fd.Case(fd.discretize(pattern, sheet), [fd.Fix("xmin")])
    >>> found = fd.sensitivity(
    ...     build, {"panel_angle": 62.0}, measures="frequency[1]",
    ...     analysis={"kind": "modes", "count": 3},
    ... )
    >>> found["gradient_panel_angle"].dims
    ('measure',)
    """
    began = time.perf_counter()
    source = source_of(build, parameters, analysis)
    unsized = sizes is None or (isinstance(sizes, Mapping) and not sizes)
    own_sizes = {} if unsized else checked(sizes, "sizes")  # type: ignore[arg-type]
    design = Parameters(source.build, source.values, own_sizes)
    wanted = _wanted(measures, source.kind)
    case = design.case()
    found = source.analyse(case)
    slopes = design.slopes(found.numbers)
    if cut := isinstance(build, Case) and LENGTH in slopes:
        slopes[LENGTH] = _by_lengths(slopes[LENGTH], found.numbers(case).numbers)
    direction = None if along is None else _direction(along, design)
    if direction is not None and isinstance(found, ModesGradient):
        found = found.along(
            lambda gradient: sum(
                float(rate @ slopes[name].pulled(gradient)) for name, rate in direction.items()
            )
        )
    shared: dict[Any, Any] = {}
    apart = beside(found, case, design, wanted, shared)
    chain = Chain(found, case, design, slopes, cut, shared, apart)
    values, gradients = zip(*(chain.of(one) for one in wanted), strict=True)
    data: dict[str, Any] = {"value": ("measure", np.array(values))}
    if direction is None:
        for name, value in design.values.items():
            rows = np.stack([gradient[name] for gradient in gradients])
            alone = value.ndim == 0
            dims = ("measure",) if alone else ("measure", f"{name}_entry")
            data[f"gradient_{name}"] = dims, rows[:, 0] if alone else rows
    else:
        rates = [sum(float(direction[n] @ g[n]) for n in direction) for g in gradients]
        data["derivative"] = ("measure", np.array(rates))
    names = [one.text for one in wanted]
    facts = {"analysis": source.kind, "wall_seconds": time.perf_counter() - began}
    return xr.Dataset(data, {"measure": names}, facts)


class Sourced(NamedTuple):
    """What to differentiate: how a case is built, the parameters, and the analysis."""

    build: Callable[..., Case]
    values: dict[str, NDArray]
    kind: str
    arguments: Mapping[str, Any]

    def analyse(self, case: Case) -> Differentiated:
        """Run the analysis; the result can be differentiated."""
        try:
            return KINDS[self.kind](case, self.arguments)
        except InputError as error:
            raise error.within(f"analysis{'.' if error.field else ': '}") from None


def source_of(build: Source, parameters: Any, analysis: Mapping[str, Any] | None) -> Sourced:
    """Check the case source, parameters and analysis of `sensitivity`."""
    if isinstance(build, Case):
        build, values = _of_arrays(build, parameters)
    elif isinstance(build, str | os.PathLike):
        build, values, own = _of_file(build, parameters, analysis)
        analysis = {**own, **(analysis or {})}
    elif callable(build):
        values = checked(parameters)
    else:
        raise InputError(f" = {show(build)}: give a function, a case or a case file", "build")
    kind = kind_of(analysis)
    arguments = {name: value for name, value in (analysis or {}).items() if name != "kind"}
    known = [*signature(FUNCTIONS[kind]).parameters.values()][1:]
    if all(one.kind is not one.VAR_KEYWORD for one in known):  # `frf` takes options of methods
        for name in arguments:
            choice("analysis", name, [one.name for one in known])
    return Sourced(build, values, kind, arguments)


def kind_of(analysis: Any) -> str:
    """Kind of an analysis, of those that have derivatives."""
    if not isinstance(analysis, Mapping) or "kind" not in analysis:
        raise InputError(
            f' = {show(analysis)}: say what is computed, such as {{"kind": "modes", "count": 4}}',
            "analysis",
        )
    if analysis["kind"] == "bands":
        raise InputError(
            ' = "bands": bands have no derivatives; sweep the parameters (foldyn.sweep), or search '
            'a case file with foldyn.design and method = "cma", which needs none',
            "analysis.kind",
        )
    return choice("analysis.kind", analysis["kind"], KINDS)


def _by_lengths(areas: Slope, numbers: Gradient) -> Slope:
    """Derivatives of numbers with respect to the cut lengths of bars, given those to EA / L0.

    A bar of length l that is cut to the length L has the excess x = (l^2 - L^2) / L^2 and the
    stiffness EA / L.
    """
    name = next(key for key in numbers if key.endswith("bar_stiffness"))
    prefix = name.removesuffix("bar_stiffness")
    inverse, excess = f"{prefix}bar_per_length2", f"{prefix}bar_excess"
    length = numbers[inverse] ** -0.5
    by = {name: -numbers[name] / length, inverse: -2.0 / length**3, excess: -2.0 / length}
    own = areas.by[name].astype(bool)
    return Slope({key: sparse.diags_array(each) @ own for key, each in by.items()}, areas.count)


def _of_arrays(case: Case, names: Any) -> tuple[Callable[..., Case], dict[str, NDArray]]:
    """A function that returns the case with other arrays of its structure, and their values."""
    given = names
    if not isinstance(names, Mapping):
        given = dict.fromkeys(listed("parameters", names, "names of arrays"))
    values = {}
    for name, value in given.items():
        choice("parameters", name, ARRAYS)
        _check_acts(case.structure, name)
        own = getattr(case.structure, name)
        if own is None:  # masses from a rule
            own = case.structure.mass.sum(axis=1)
        values[name] = own if value is None else value
        if np.shape(values[name]) != np.shape(own):
            raise InputError(
                f" has the shape {np.shape(values[name])}; the structure has {np.shape(own)}",
                f"parameters.{name}",
            )

    def build(**arrays: NDArray) -> Case:
        bars: Any = case.structure
        if LENGTH in arrays:  # structures cannot hold bars that do not fit: see `_by_lengths`
            share = arrays.pop(LENGTH) / bars.bar_length
            arrays["bar_area"] = arrays.get("bar_area", bars.bar_area) * share
        return replace(case, structure=replace(bars, **arrays))

    return build, checked(values)


def _check_acts(structure: Discretized, name: str) -> None:
    """Refuse an array of numbers that has no effect in a structure."""
    if not isinstance(structure, Structure):
        raise InputError(
            ": only bars and hinges have such arrays; give a function that builds the case", name
        )
    if name == "node_mass" and not is_lumped(structure.mass):
        raise InputError(
            f": the mass rule {show(structure.options.mass)} couples nodes; take a rule that lumps "
            'the mass, as mass = "mixed_voronoi"',
            name,
        )
    if name.startswith("bar") and structure.membranes:
        raise InputError(
            ": the panels of this structure resist as membranes, and its bars do not; give a "
            'function that builds it, or take membrane = "bars"',
            name,
        )
    if name.startswith("bend") and structure.edge_plates is not None:
        raise InputError(
            ": panels of the scheme n5b8e bend as plates, without hinges; give a function that "
            "builds it",
            name,
        )


OPEN = Choice(BARS_AND_HINGES, ANEW, open=True)
"""The model of case files that leave it open."""


def case_file_at(place: Path, document: dict[str, Any], values: Mapping[str, Any]) -> CaseFile:
    """A case file with other values for some keys, of a model that has gradients."""
    plain = {key: np.asarray(value).tolist() for key, value in values.items()}
    kept = {key: value for key, value in replaced(document, plain).items() if key not in ASIDE}
    return case_of_document(place, kept, choice=OPEN)


def _of_file(
    path: str | os.PathLike[str], parameters: Any, analysis: Mapping[str, Any] | None
) -> tuple[Callable[..., Case], dict[str, NDArray], dict[str, Any]]:
    """A function that returns the case for other values of keys, the values, and the analysis."""
    of_kind("analysis", {} if analysis is None else analysis, Mapping)
    place = path_of(path, "build")
    document = read_document(place)

    own = case_file_at(place, document, {})
    if own.start_keys:
        raise InputError(
            ": there are no gradients of motions from a given state; leave the table out, or give "
            "a function that builds the case",
            "initial",
            place,
        )
    kind = own.analysis.kind
    asked = (analysis or {}).get("kind", kind)
    whole = asked == EFFECTIVE  # the file says how its cell repeats, and in which state
    if whole and (kind != EFFECTIVE or {*(analysis or {})} - {"kind"}):
        raise InputError(
            ": effective properties of a case file are those of its own [analysis]; give kind = "
            '"effective" and the other keys there',
            "analysis",
        )

    def build(**values: Any) -> Any:
        made = case_file_at(place, document, values)
        return made if whole else made.case()

    arguments = own.analysis.arguments if asked == kind and not whole else {}
    return build, checked(parameters), {"kind": kind, **arguments}


# ------------------------------------------------------------------ measures
def _wanted(measures: Any, kind: str) -> list[Wanted]:
    """Quantities to differentiate, from the argument `measures`."""
    if isinstance(measures, Mapping):
        return [_own(name, pair) for name, pair in measures.items()]
    texts = [measures] if isinstance(measures, str) else listed("measures", measures, "measures")
    found = []
    for k, text in enumerate(texts):
        with within(f"measures[{k}]"):
            expression, own = parse(text), {}
            for name in expression.measures:
                one = one_number(name, kind)
                own[name] = one, derivative_of(one)
            found.append(Wanted(text, expression, own))
    if not found:
        raise InputError(': none; give at least one, such as "frequency[1]"', "measures")
    return found


def _own(name: str, pair: Any) -> Wanted:
    """A user's own quantity: a function and its derivative."""
    if not isinstance(pair, tuple) or len(pair) != 2 or not all(map(callable, pair)):
        raise InputError(
            f" = {show(pair)}: give a pair of a function and its derivative", f"measures.{name}"
        )
    function, seeds = pair
    frozen = Derivative(seeds, lambda result, case: lambda other: float(function(result, other)))
    return Wanted(name, parse(name), {name: (of_callable(name, function), frozen)})


# ------------------------------------------------------------------ directions
def _direction(along: Values, design: Parameters) -> dict[str, NDArray]:
    """Rates (count,) of the parameters in a direction."""
    found = {}
    for name, rate in checked(along, "along").items():
        if name not in design.values:
            raise InputError(f".{name}: there is no such parameter", "along")
        value = design.values[name]
        found[name] = np.broadcast_to(rate, value.shape).ravel() if value.ndim else rate.ravel()
    return found
