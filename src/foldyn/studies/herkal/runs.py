"""Models of the case studies, and their computations, each kept in its own file.

A new model is one entry of `MODELS`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, Literal

import xarray

from foldyn import store
from foldyn.analyses import CaseFile, read_case
from foldyn.cases import Case, Force, HalfSine
from foldyn.dynamics import simulate
from foldyn.errors import InputError
from foldyn.input_files import file_digest
from foldyn.linear import modes
from foldyn.linear.fidelity import MODELS as STIFFNESSES
from foldyn.results import load, save
from foldyn.shells import shell
from foldyn.statics import trace
from foldyn.structures import discretize
from foldyn.studies import find_case
from foldyn.studies.herkal.metric import UP_TO
from foldyn.studies.pool import Task, datasets
from foldyn.values import choice

CASES = ("case1", "case2", "case3", "case4")
REFERENCE = "shell"
BARS_AND_HINGES = "bars and hinges"
LOADS = ("file", "edge")


@dataclass(frozen=True)
class Variant:
    """Changes to the case file; by default nothing is changed.

    Attributes
    ----------
    pulse : float or None
        Duration (s) of the half-sine pulse.
    loads : {"file", "edge"}
        "edge" puts the file's force on each node that the case reports, which together are the
        whole edge.
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
        """Part of file names that names the changes; empty for the unchanged case file."""
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
        """Changes that apply to the shell, which has neither bends nor a calibration of them."""
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
        Name of the stiffness: models with the same name differ only in mass and share equilibria.
    paper : bool
        Whether the paper has this model.
    implicit : bool
        Whether motions of this model use Newmark's method with the study's time step.
    """

    name: str
    label: str
    structure: Callable[[CaseFile, Mapping[str, Any], int], Any]
    statics: str = BARS_AND_HINGES
    paper: bool = False
    implicit: bool = False

    @property
    def distribution(self) -> bool:
        """Whether the model differs from the case file's model only in the distribution of mass."""
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
    """Shipped case file of a case study, such as "case1"."""
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
        The model does not exist, or the variant changes a pulse that the file does not have.
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


# Files on which results of the case studies depend, in addition to the solvers.
COMPUTING = tuple(f"studies/herkal/{name}.py" for name in ("runs", "metric", "sensitivity"))
INTERVAL = 0.01  # s, between samples, unless the case file sets it
STEPS = 10  # number of load steps of a path
# number of modes of the reference; number of candidates for their partners
SHELL_MODES, RULE_MODES = 5, 12
SECANT = 1.0  # degrees, amplitude of the hinges: superlinear bends have no slope at rest


@dataclass(frozen=True)
class Numerics:
    """Numerical resolution.

    Attributes
    ----------
    divisions : int
        Divisions of the shell.
    dt : float
        Time step (s) for the shell and other implicit models.
    duration : float
        Duration of motions (s).
    """

    divisions: int = 16
    dt: float = 0.005
    duration: float = 10.0


@dataclass(frozen=True)
class Job(Task):
    """One computation.

    Attributes
    ----------
    case : str
        Name of a shipped case study, such as "case1".
    model : str
        One of `foldyn.studies.herkal.runs.MODELS`.
    kind : {"path", "modes", "motion"}
    numerics : Numerics
    variant : Variant
    """

    case: str
    model: str
    kind: Literal["path", "modes", "motion"]
    numerics: Numerics = field(default_factory=Numerics)
    variant: Variant = AS_FILED
    store = datasets(load, save)

    @property
    def name(self) -> str:
        """Name of the computation."""
        return "-".join(filter(None, (self.case, self.model, self.kind, self.variant.name)))

    def settings(self) -> dict[str, Any]:
        """Everything on which the result depends."""
        numerics = {} if self.kind != "motion" else {"duration": self.numerics.duration}
        if self.model == REFERENCE:  # other models have no mesh
            numerics["divisions"] = self.numerics.divisions
        if self.kind == "motion" and model_of(self.model).implicit:
            numerics["dt"] = self.numerics.dt
        return {
            "case": self.case,
            "case_file": case_file_digest(self.case),
            "program": program(),
            "model": self.model,
            "kind": self.kind,
            "variant": asdict(self.variant),
            **numerics,
        }

    def compute(self, folder: Path) -> xarray.Dataset:
        """Run the computation; the result covers the pattern's vertices, which all models share."""
        return compute(self)


def program() -> str:
    """Digest of the program that computes the case studies."""
    return store.program(*COMPUTING)


def case_file_digest(case: str) -> str:
    """Digest of a shipped case file."""
    return file_digest(find_case(f"herkal/{case}"))


def reported(case: str) -> tuple[list[int], str, float]:
    """Nodes and axis that a case study reports, and the upper end of its spectra (Hz)."""
    output = case_study(case).output
    return output.nodes.tolist(), output.axis or "x", output.max_frequency or UP_TO


def compute(job: Job) -> xarray.Dataset:
    """Run a computation; the result covers the pattern's vertices, which all models share."""
    case_file = case_study(job.case)
    case = case_with(case_file, job.model, job.variant, job.numerics.divisions)
    model, of_shell = model_of(job.model), job.model == REFERENCE
    if job.kind == "path":
        found = trace(case, steps=STEPS)
    elif job.kind == "modes":
        count, secant = SHELL_MODES if of_shell else RULE_MODES, SECANT
        found = modes(
            replace(case, loads=()), count, secant=secant if model.distribution else None,
            check_model=False,
        )  # fmt: skip
    else:
        own = {"method": "newmark", "dt": job.numerics.dt} if model.implicit else {}
        given = {"interval": INTERVAL, **case_file.analysis.arguments, **own}
        found = simulate(case, **{**given, "duration": job.numerics.duration})
    kept = found.drop_vars("velocity", errors="ignore")
    kept = kept.sel(node=range(len(case_file.pattern.vertices)))
    kept.attrs |= {
        "rerunnable": 0,
        "not_rerunnable_because": "a study keeps what happens at the pattern's vertices only",
    }
    return kept
