"""Computations of the case studies with other loads, bends, mass rules and stiffnesses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from foldyn.analyses import CaseFile
from foldyn.cases import Case, Force, HalfSine
from foldyn.errors import InputError
from foldyn.input_files import file_digest
from foldyn.linear.fidelity import MODELS
from foldyn.structures import discretize
from foldyn.studies.herkal.runs import BARS_AND_HINGES, REFERENCE, RULES, Job, shell_case
from foldyn.studies.herkal.study import StudyPlan
from foldyn.values import choice

LOADS = ("file", "edge")
# Labels of the models: all mass rules of the case files' bars and hinges, and other stiffnesses.
DISTRIBUTIONS: Mapping[str, str] = {
    **RULES,
    "mixed_voronoi": "mixed Voronoi",
    "inertia_exact": "inertia-exact",
}
STIFFNESSES: Mapping[str, str] = {"plate": "plate", "n5b8e": "n5b8e"}
OTHERS: Mapping[str, str] = {"equi_inertial_acute": "equi-inertial, other corners"}
LABELS: Mapping[str, str] = {REFERENCE: REFERENCE, **DISTRIBUTIONS, **STIFFNESSES, **OTHERS}


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


AS_FILED, LINEAR = Variant(), Variant(bend_law="linear")


def case_with(
    case_file: CaseFile, model: str, variant: Variant = AS_FILED, divisions: int = 16
) -> Case:
    """Case of a file with one of the models; supports, loads and damping are the same.

    Raises
    ------
    InputError
        The model does not exist, or the variant changes a pulse that the file does not have.
    """
    choice("model", model, LABELS)
    if model == REFERENCE:
        case = shell_case(case_file, divisions)
    else:
        own = MODELS[model] if model in STIFFNESSES else {"mass": model}
        options = {**vars(case_file.case().structure.options), **variant.options, **own}
        made = discretize(case_file.pattern, case_file.sheet, **options)
        case = replace(case_file.case(), structure=made)
    return replace(case, loads=[_varied(load, case_file, variant) for load in case.loads])


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


@dataclass(frozen=True)
class Varied(Job):
    """A computation with one of `LABELS` and a variant of the case file."""

    variant: Variant = AS_FILED

    @property
    def name(self) -> str:
        """Name of the computation."""
        return "-".join(filter(None, (super().name, self.variant.name)))

    @property
    def implicit(self) -> bool:
        """Whether motions use Newmark's method; edges of n5b8e have no mass of their own."""
        return self.model in (REFERENCE, "n5b8e")

    @property
    def secant(self) -> float | None:
        """Amplitude (degrees) of the hinges in modes; None for their slope at rest."""
        return None if self.model in STIFFNESSES else super().secant

    def settings(self) -> dict[str, Any]:
        """Everything on which the result depends."""
        return {**super().settings(), "models": SOURCE, "variant": asdict(self.variant)}

    def given(self, case_file: CaseFile) -> Case:
        """The case that is computed."""
        return case_with(case_file, self.model, self.variant, self.numerics.divisions)


SOURCE = file_digest(Path(__file__))


@dataclass(frozen=True)
class WiderPlan(StudyPlan):
    """The study with further mass rules and stiffnesses, and statics with linear bends."""

    models: Mapping[str, str] = field(default_factory=lambda: {**DISTRIBUTIONS, **STIFFNESSES})

    def job(self, case: str, model: str, kind: Any, variant: Variant = AS_FILED) -> Varied:
        """One computation."""
        return Varied(case, model, kind, self.numerics, variant)

    def paths(self, case: str) -> dict[str, Job]:
        """Static computations by the label of their stiffness, on which mass has no influence."""
        found = super().paths(case)
        bars = found[BARS_AND_HINGES].model
        found[f"{BARS_AND_HINGES}, linear bends"] = self.job(case, bars, "path", LINEAR)
        return found | {
            name: self.job(case, name, "path") for name in STIFFNESSES if name in self.models
        }
