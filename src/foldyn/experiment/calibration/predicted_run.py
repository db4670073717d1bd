"""Runs of a fit: computations that predict measurements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from xarray import Variable

from foldyn.analyses import CaseFile
from foldyn.analyses.sections import Choice
from foldyn.cases import Case, State
from foldyn.dynamics.methods import method_of
from foldyn.dynamics.motion import Motion
from foldyn.errors import InputError
from foldyn.experiment.calibration.measured import Measured
from foldyn.experiment.calibration.measurement import Measurement
from foldyn.experiment.calibration.modal import FrequencyResponse, ModalParameters, ModeShapes
from foldyn.gradients.neighbors import Asked, equilibria, modes, motions, responses
from foldyn.linear.modes import of_spectrum, spectrum_of
from foldyn.patterns import Pattern
from foldyn.values import show

STEADY = "generalized_alpha"  # integrator of a fit if the case file does not choose one
# Iterations for differences of motions end at this relative change: during a search, after it.
SHARES = 1e-4, 1e-6
# Analyses whose neighboring results are computed more accurately than the result itself. The result
# is then recomputed like a neighbor.
REFINED = "statics", "modes"
# With more coordinates, computing modes anew is as fast as computing differences to neighbors.
MANY = 2000


@dataclass(frozen=True, eq=False)
class PredictedRun:
    """One computation (path, motion, modes or frequency response) that predicts some measurements.

    Attributes
    ----------
    path : Path
        Case file of the run.
    document : dict
        Content of the case file, with the changes of these measurements.
    members : tuple of int
        Numbers of the measurements.
    patterns : list of Pattern
        The pattern, once it is generated, for all parameter values that do not change it.
    starts : list of State or None
        The stored initial state, once it is read.
    choices : list of Choice
        The model, once it is decided, for all parameter values.
    """

    path: Path
    document: dict[str, Any]
    members: tuple[int, ...]
    patterns: list[Pattern] = field(repr=False, default_factory=list)
    starts: list[State | None] = field(repr=False, default_factory=list)
    choices: list[Choice] = field(repr=False, default_factory=list)

    @property
    def kind(self) -> str:
        """Kind of analysis of the run."""
        return self.document["analysis"]["kind"]

    def those_of(self, measurements: Sequence[Measurement]) -> list[Measurement]:
        """Select the measurements of this run from all measurements."""
        return [measurements[i] for i in self.members]

    def start(self, case_file: CaseFile) -> State | None:
        """Initial state of the case of this run."""
        if "file" not in self.document.get("initial", ()):
            return case_file.initial()
        if not self.starts:
            self.starts.append(case_file.initial())
        return self.starts[0]


def computed(run: PredictedRun, case_file: CaseFile, members: Sequence[Measurement]) -> Any:
    """Result of a case file at the measured load factors, modes or frequencies."""
    return case_file.computation(**_changes(run, case_file, members)).result()


def seen(run: PredictedRun, case_file: CaseFile, members: Sequence[Measurement]) -> Any:
    """The part of the result with which measurements are compared."""
    if run.kind != "dynamics":
        return computed(run, case_file, members)
    motion = motion_of(run, case_file)
    with case_file.placing():
        motion.integrate()
    return _moved(motion)


def motion_of(run: PredictedRun, case_file: CaseFile) -> Motion:
    """The motion of a case file, before it begins."""
    compute: Any = case_file.computation(**_changes(run, case_file, ())).compute
    return compute.motion


def _moved(motion: Motion) -> dict[str, Variable]:
    """The part of a computed motion with which measurements are compared."""
    out, _ = motion.output.first(motion.stored)
    return {
        "time": Variable("time", out.time),
        "displacement": Variable(("time", "node", "axis"), out.displacement),
        "rest_position": Variable(("node", "axis"), motion.case.structure.nodes),
    }


def _changes(
    run: PredictedRun, case_file: CaseFile, members: Sequence[Measurement]
) -> dict[str, Any]:  # fmt: skip
    """Arguments of the analysis that override the case file."""
    case, given = case_file.case(), case_file.analysis.arguments
    if run.kind == "dynamics":
        return {**steady(case_file), "initial": run.start(case_file)}
    if run.kind == "modes":
        counts = [one.count for one in members if isinstance(one, ModeShapes | ModalParameters)]
        most = min(max(given["count"], *counts), len(case.free_dofs))
        return {"count": most, "check_model": False}
    if run.kind == "frf":
        lines = [one.frequency for one in members if isinstance(one, FrequencyResponse)]
        return {"frequencies": np.unique(np.concatenate(lines)), "check_model": False}
    return {
        "method": "newton", "load_factors": _path(case, members), "first_step": None,
        "until": None, "settings": replace(given["settings"], stability=False),
    }  # fmt: skip


def with_neighbors(
    run: PredictedRun, case_file: CaseFile, others: Sequence[CaseFile],
    members: Sequence[Measurement], second: bool,
) -> tuple[Any, list[Any]]:  # fmt: skip
    """Results to compare with measurements: of a case, and of other cases close to it.

    second : whether differences need second-order accuracy.

    Raises
    ------
    FoldynError
        The results of the other cases cannot be computed together with the first result.
    """
    if any(isinstance(one, Measured) and not one.held_out for one in members):
        raise InputError("neighbors of a path have displacements and reactions only")
    if run.kind != "dynamics" and run.start(case_file) is not None:
        raise InputError("a run that starts from a state has no neighbors")
    one, *beside = (
        Asked(each.case(), {**each.analysis.arguments, **_changes(run, each, members)})
        for each in (case_file, *others)
    )
    if run.kind == "dynamics":
        motion = motion_of(run, case_file)
        moved = motions(motion, one, beside, SHARES[second])
        result = _moved(motion)
        dims = result["displacement"].dims
        return result, [{**result, "displacement": Variable(dims, each)} for each in moved]
    if run.kind == "frf":
        result, *found = responses(one, beside)
        return result, found
    if run.kind == "statics":
        result = seen(run, case_file, members)
        return result, equilibria(one, result, beside)
    if one.case.structure.nodes.size > MANY:
        raise InputError("modes of so many dofs are found as quickly as their neighbors")
    base = spectrum_of(one.case, **of_spectrum(one.arguments))
    fitted = [each for each in members if not each.held_out]
    places = [each.places(base.result, one.case) for each in fitted]  # type: ignore[attr-defined]
    return base.result, modes(base, beside, np.unique(np.concatenate(places)).tolist())


def _path(case: Case, members: Sequence[Measurement]) -> list[float]:
    """Load factors at which a case is measured; with yielding creases in the order of the test."""
    given = [one.factors(case) for one in members]
    if all(part.law.relaxes for part in case.remembering):
        factors = np.unique(np.concatenate(given))
        return [*factors[factors < 0.0][::-1], *factors[factors >= 0.0]]
    if any(not np.array_equal(one, given[0]) for one in given[1:]):
        raise InputError(
            "data: creases that yield depend on the loading path, which differs between these "
            "measurements: give measurements along one path, or fit them separately"
        )
    return given[0][np.append(True, np.diff(given[0]) != 0.0)].tolist()


def steady(case_file: CaseFile) -> dict[str, Any]:
    """Arguments of `simulate` for time steps that do not depend on the parameters.

    Adaptive steps would make the misfit jump between neighboring values.
    """
    given = dict(case_file.analysis.arguments)
    if given["method"] == "auto":
        given["method"] = STEADY
    method = method_of(given["method"])
    if method.adaptive:
        raise InputError(
            f"{case_file.path}: analysis.method = {show(method.name)}: has adaptive steps, which "
            "make the misfit jump; fit with rk4, newmark or generalized_alpha"
        )
    if method.implicit:
        given["tolerance"] = None
        if given["dt"] is None:
            if "interval" not in given:
                raise InputError(
                    f"{case_file.path}: analysis.dt: missing; a fit needs fixed steps: give dt, or "
                    "output.interval, which is then the step"
                )
            given["dt"] = given["interval"]
    return given
