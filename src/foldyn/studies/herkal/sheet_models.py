"""Models of the case studies: the rows of every table. A further model is one entry of `MODELS`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from foldyn.analyses import CaseFile, read_case
from foldyn.cases import Case, Force, HalfSine
from foldyn.errors import InputError
from foldyn.shells import shell
from foldyn.structures import discretize
from foldyn.studies import find_case
from foldyn.values import choice

CASES = ("case1", "case2", "case3", "case4")
REFERENCE = "shell"
LOADS = ("file", "edge")


@dataclass(frozen=True)
class Variant:
    """What differs from the case file; by default nothing.

    Attributes
    ----------
    pulse : float or None
        Duration (s) of the half-sine pulse.
    loads : {"file", "edge"}
        "edge": the file's force on each of the nodes that the case reports, the whole edge.
    bend_law : {"linear", "superlinear"} or None
    calibration : {"standard", "merlin2"} or None
    """

    pulse: float | None = None
    loads: str = "file"
    bend_law: str | None = None
    calibration: str | None = None

    def __post_init__(self) -> None:
        """Check what can be checked without a case."""
        choice("loads", self.loads, LOADS)

    @property
    def name(self) -> str:
        """Part of file names; empty for the case file as it is."""
        pulse = "" if self.pulse is None else f"pulse{self.pulse:g}"
        loads = "" if self.loads == "file" else self.loads
        return "-".join(filter(None, (pulse, loads, self.bend_law, self.calibration)))

    @property
    def options(self) -> dict[str, str]:
        """Arguments of `discretize` that it changes."""
        given = {"bend_law": self.bend_law, "calibration": self.calibration}
        return {key: value for key, value in given.items() if value is not None}

    @property
    def of_shell(self) -> Variant:
        """What of it applies to the shell, which has neither bends nor their calibration."""
        return replace(self, bend_law=None, calibration=None)


AS_FILED = Variant()
"""The case file as it is."""


@dataclass(frozen=True)
class SheetModel:
    """A model of the sheet.

    Attributes
    ----------
    name, label : str
        In file names and in tables.
    structure : callable
        Makes the structure of a case file: ``structure(case_file, options, divisions)``; options
        are changed arguments of `discretize`.
    statics : str
        Models with the same name here differ in mass only and share their equilibria.
    paper : bool
        Whether it is one of the paper's.
    """

    name: str
    label: str
    structure: Callable[[CaseFile, Mapping[str, Any], int], Any]
    statics: str = "bars and hinges"
    paper: bool = False


def _bars_and_hinges(
    mass: str, case_file: CaseFile, options: Mapping[str, Any], divisions: int
) -> Any:
    """Structure of the case file with a mass rule; it has no use for `divisions`."""
    arguments = {**vars(case_file.case().structure.options), "mass": mass, **options}
    return discretize(case_file.pattern, case_file.sheet, **arguments)


def _shell(case_file: CaseFile, options: Mapping[str, Any], divisions: int) -> Any:
    """Shell with the creases of the case file; it has no use for `options`."""
    given = vars(case_file.case().structure.options)
    creases = {name: given[name] for name in ("fold_law", "crease_stiffness", "crease_rest")}
    return shell(case_file.pattern, case_file.sheet, divisions, **creases)


def _rule(name: str, label: str, paper: bool = False) -> SheetModel:
    return SheetModel(name, label, partial(_bars_and_hinges, name), paper=paper)


MODELS: Mapping[str, SheetModel] = {
    model.name: model
    for model in (
        SheetModel(REFERENCE, "shell", _shell, statics="shell"),
        _rule("equi_inertial", "equi-inertial", paper=True),
        _rule("panel", "panel", paper=True),
        _rule("centroid", "centroid", paper=True),
        _rule("circumcenter", "circumcenter", paper=True),
        _rule("consistent", "consistent", paper=True),
        _rule("mixed_voronoi", "mixed Voronoi"),
        _rule("inertia_exact", "inertia-exact"),
    )
}
"""The reference and what is compared with it, in the order of the tables."""

OTHERS: Mapping[str, SheetModel] = {
    "equi_inertial_acute": _rule("equi_inertial_acute", "equi-inertial, other corners"),
}
"""Models of the sensitivity alone."""


def model_of(name: str) -> SheetModel:
    """Model with this name."""
    known = {**MODELS, **OTHERS}
    return known[choice("model", name, known)]


def rules() -> tuple[str, ...]:
    """Names of the models that are compared with the reference."""
    return tuple(name for name in MODELS if name != REFERENCE)


def paper_rules() -> tuple[str, ...]:
    """Names of the paper's models."""
    return tuple(name for name, model in MODELS.items() if model.paper)


def case_study(name: str) -> CaseFile:
    """Shipped case file of a case study, "case1"."""
    return read_case(find_case(f"herkal/{name}"))


def label(name: str) -> str:
    """What tables call a model."""
    return model_of(name).label


def case_with(
    case_file: CaseFile, model: str, variant: Variant = AS_FILED, divisions: int = 16
) -> Case:
    """Case of a file with one of the models: same supports, loads and damping.

    Raises
    ------
    InputError
        No such model; the variant changes a pulse that the file does not have.
    """
    structure = model_of(model).structure(case_file, variant.options, divisions)
    loads = [_varied(load, case_file, variant) for load in case_file.case().loads]
    return replace(case_file.case(), structure=structure, loads=loads)


def _varied(load: Any, case_file: CaseFile, variant: Variant) -> Any:
    if not isinstance(load, Force):
        return load
    if variant.pulse is not None:
        if not isinstance(load.history, HalfSine):
            raise InputError(f"pulse = {variant.pulse}: {case_file.path.name} has no half-sine")
        load = replace(load, history=HalfSine(variant.pulse))
    if variant.loads == "edge":
        load = replace(load, nodes=case_file.output.nodes.tolist())
    return load
