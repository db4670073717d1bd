"""Models of the case studies: the rows of every table. A new model is one entry of `MODELS`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from foldyn.analyses import CaseFile, read_case
from foldyn.cases import Case, Force, HalfSine
from foldyn.errors import InputError
from foldyn.linear.fidelity import MODELS as STIFFNESSES
from foldyn.shells import shell
from foldyn.structures import discretize
from foldyn.studies import find_case
from foldyn.values import choice

CASES = ("case1", "case2", "case3", "case4")
REFERENCE = "shell"
BARS_AND_HINGES = "bars and hinges"
LOADS = ("file", "edge")


@dataclass(frozen=True)
class Variant:
    """Changes to the case file; by default none.

    Attributes
    ----------
    pulse : float or None
        Duration (s) of the half-sine pulse.
    loads : {"file", "edge"}
        "edge" puts the file's force on each of the nodes that the case reports, the whole edge.
    bend_law : {"linear", "superlinear"} or None
    calibration : {"standard", "merlin2"} or None
    """

    pulse: float | None = None
    loads: str = "file"
    bend_law: str | None = None
    calibration: str | None = None

    def __post_init__(self) -> None:
        """Check the fields that need no case."""
        choice("loads", self.loads, LOADS)

    @property
    def name(self) -> str:
        """Part of file names; empty for the unchanged case file."""
        pulse = "" if self.pulse is None else f"pulse{self.pulse:g}"
        loads = "" if self.loads == "file" else self.loads
        return "-".join(filter(None, (pulse, loads, self.bend_law, self.calibration)))

    @property
    def options(self) -> dict[str, str]:
        """Changed arguments of `discretize`."""
        given = {"bend_law": self.bend_law, "calibration": self.calibration}
        return {key: value for key, value in given.items() if value is not None}

    @property
    def of_shell(self) -> Variant:
        """Changes that apply to the shell, which has neither bends nor their calibration."""
        return replace(self, bend_law=None, calibration=None)


AS_FILED = Variant()  # the unchanged case file


@dataclass(frozen=True)
class SheetModel:
    """A model of the sheet.

    Attributes
    ----------
    name, label : str
        Names in files and in tables.
    structure : callable
        Builds the structure of a case file: ``structure(case_file, options, divisions)``; options
        are changed arguments of `discretize`.
    statics : str
        Models with the same value differ only in mass and share their equilibria.
    paper : bool
        Whether it is one of the paper's models.
    implicit : bool
        Whether its motions use Newmark's method with the study's time step.
    """

    name: str
    label: str
    structure: Callable[[CaseFile, Mapping[str, Any], int], Any]
    statics: str = BARS_AND_HINGES
    paper: bool = False
    implicit: bool = False

    @property
    def distribution(self) -> bool:
        """Whether it differs from the case file's model only in the distribution of mass."""
        return self.statics == BARS_AND_HINGES


def _bars_and_hinges(
    own: Mapping[str, Any], case_file: CaseFile, options: Mapping[str, Any], divisions: int
) -> Any:
    """Structure of the case file with changed options; `divisions` is unused."""
    arguments = {**vars(case_file.case().structure.options), **options, **own}
    return discretize(case_file.pattern, case_file.sheet, **arguments)


def _shell(case_file: CaseFile, options: Mapping[str, Any], divisions: int) -> Any:
    """Shell with the creases of the case file; `options` is unused."""
    given = vars(case_file.case().structure.options)
    creases = {name: given[name] for name in ("fold_law", "crease_stiffness", "crease_rest")}
    return shell(case_file.pattern, case_file.sheet, divisions=divisions, **creases)


def _rule(name: str, label: str, paper: bool = False) -> SheetModel:
    return SheetModel(name, label, partial(_bars_and_hinges, {"mass": name}), paper=paper)


def _stiffness(name: str, implicit: bool = False) -> SheetModel:
    """A model that `foldyn.fidelity` compares with the shell, with its own bends and mass."""
    structure = partial(_bars_and_hinges, STIFFNESSES[name])
    return SheetModel(name, name, structure, statics=name, implicit=implicit)


# The reference and the models compared with it, in the order of the tables.
MODELS: Mapping[str, SheetModel] = {
    model.name: model
    for model in (
        SheetModel(REFERENCE, "shell", _shell, statics="shell", implicit=True),
        _rule("equi_inertial", "equi-inertial", paper=True),
        _rule("panel", "panel", paper=True),
        _rule("centroid", "centroid", paper=True),
        _rule("circumcenter", "circumcenter", paper=True),
        _rule("consistent", "consistent", paper=True),
        _rule("mixed_voronoi", "mixed Voronoi"),
        _rule("inertia_exact", "inertia-exact"),
        _stiffness("plate"),
        _stiffness("n5b8e", implicit=True),  # its edges have no mass of their own
    )
}

# Models used only for the sensitivity.
OTHERS: Mapping[str, SheetModel] = {
    "equi_inertial_acute": _rule("equi_inertial_acute", "equi-inertial, other corners")
}


def model_of(name: str) -> SheetModel:
    """Model with this name."""
    known = {**MODELS, **OTHERS}
    return known[choice("model", name, known)]


def compared() -> tuple[str, ...]:
    """Names of the models compared with the reference."""
    return tuple(name for name in MODELS if name != REFERENCE)


def rules() -> tuple[str, ...]:
    """Names of the models that differ only in the distribution of mass."""
    return tuple(name for name, model in MODELS.items() if model.distribution)


def paper_rules() -> tuple[str, ...]:
    """Names of the paper's models."""
    return tuple(name for name, model in MODELS.items() if model.paper)


def case_study(name: str) -> CaseFile:
    """Shipped case file of a case study, "case1"."""
    return read_case(find_case(f"herkal/{name}"))


def label(name: str) -> str:
    """Label of a model in tables."""
    return model_of(name).label


def case_with(
    case_file: CaseFile, model: str, variant: Variant = AS_FILED, divisions: int = 16
) -> Case:
    """Case of a file with one of the models; supports, loads and damping are the same.

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
