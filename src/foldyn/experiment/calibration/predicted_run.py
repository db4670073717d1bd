"""What the case of a fit computes for its measurements."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from foldyn.analyses import CaseFile
from foldyn.cases import Case
from foldyn.dynamics.methods import method_of
from foldyn.errors import FoldynWarning, InputError
from foldyn.experiment.calibration.measurement import Measurement
from foldyn.experiment.calibration.modal import ModalParameters, ModeShapes
from foldyn.experiment.calibration.responses import FrequencyResponse
from foldyn.gradients.neighbors import Asked, equilibria, modes, responses
from foldyn.patterns import Pattern
from foldyn.values import show

STEADY = "generalized_alpha"
"""Integrator of a fit where the case file leaves the choice open."""
MANY = 2000
"""Coordinates of nodes beyond which modes are found as quickly as those of a neighbor."""


@dataclass(frozen=True, eq=False)
class PredictedRun:
    """One path or motion that predicts several measurements.

    Attributes
    ----------
    path : Path
        Its case file.
    document : dict
        Its content, with the changes of these measurements.
    members : tuple of int
        Numbers of the measurements.
    patterns : list of Pattern
        Its pattern once it is made, for all values of parameters that leave it alone.
    """

    path: Path
    document: dict[str, Any]
    members: tuple[int, ...]
    patterns: list[Pattern] = field(init=False, repr=False, default_factory=list)

    @property
    def kind(self) -> str:
        """Kind of its analysis."""
        return self.document["analysis"]["kind"]

    def those_of(self, measurements: Sequence[Measurement]) -> list[Measurement]:
        """Its measurements, of all."""
        return [measurements[i] for i in self.members]


def result_of(case_file: CaseFile, members: Sequence[Measurement]) -> Any:
    """What a case file asks for, without its warnings."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)
        return computed(case_file, members)


def computed(case_file: CaseFile, members: Sequence[Measurement]) -> Any:
    """What a case file asks for, at the load factors, modes or frequencies that are measured."""
    return case_file.computation(**_changes(case_file, members)).result()


def _changes(case_file: CaseFile, members: Sequence[Measurement]) -> dict[str, Any]:
    """Arguments of an analysis that are not those of the case file."""
    case, given = case_file.case(), case_file.analysis.arguments
    if case_file.analysis.kind == "dynamics":
        return steady(case_file)
    if case_file.analysis.kind == "modes":
        counts = [one.count for one in members if isinstance(one, ModeShapes | ModalParameters)]
        return {"count": min(max(given["count"], *counts), len(case.free_dofs))}
    if case_file.analysis.kind == "frf":
        lines = [one.frequency for one in members if isinstance(one, FrequencyResponse)]
        return {"frequencies": np.unique(np.concatenate(lines))}
    return {
        "method": "newton", "load_factors": _path(case, members), "first_step": None,
        "until": None, "settings": replace(given["settings"], stability=False),
    }  # fmt: skip


def asked(case_file: CaseFile, members: Sequence[Measurement]) -> Asked:
    """The case of a file, and the arguments of its analysis."""
    if case_file.analysis.kind == "dynamics" or case_file.initial() is not None:
        raise InputError("motions, and what starts from a state, have no neighbors")
    given = {**case_file.analysis.arguments, **_changes(case_file, members)}
    return Asked(case_file.case(), given)


def neighbors(
    kind: str, one: Asked, result: Any, others: Sequence[Asked], fitted: Sequence[Measurement]
) -> list[Any]:
    """Results of other cases beside a result, as far as measurements need them."""
    if kind == "statics":
        return equilibria(one, result, others)
    if kind == "modes":
        if one.case.structure.nodes.size > MANY:
            raise InputError("modes of so many dofs are found as quickly as their neighbors")
        places = [each.places(result, one.case) for each in fitted]  # type: ignore[attr-defined]
        return modes(one, result, others, np.unique(np.concatenate(places)).tolist())
    return responses(one, result, others)


def _path(case: Case, members: Sequence[Measurement]) -> list[float]:
    """Load factors at which a case is measured; in the order of a test in which creases yield."""
    given = [one.factors(case) for one in members]
    if all(part.law.relaxes for part in case.remembering):
        factors = np.unique(np.concatenate(given))
        return [*factors[factors < 0.0][::-1], *factors[factors >= 0.0]]
    if any(not np.array_equal(one, given[0]) for one in given[1:]):
        raise InputError(
            "data: creases that yield depend on the way, and these measurements have different "
            "ones: give what was measured along one path, or fit them apart"
        )
    return given[0][np.append(True, np.diff(given[0]) != 0.0)].tolist()


def steady(case_file: CaseFile) -> dict[str, Any]:
    """Arguments of `simulate` for steps that do not depend on the parameters.

    Steps chosen by their error would make the misfit jump between neighboring values.
    """
    given = dict(case_file.analysis.arguments)
    if given["method"] == "auto":
        given["method"] = STEADY
    method = method_of(given["method"])
    if method.adaptive:
        raise InputError(
            f"{case_file.path}: analysis.method = {show(method.name)}: chooses its steps by their "
            "error, which makes a misfit jump; fit with rk4, newmark or generalized_alpha"
        )
    if method.implicit:
        given["tolerance"] = None
        if given["dt"] is None:
            if not isinstance(given["every"], float):
                raise InputError(
                    f"{case_file.path}: analysis.dt: missing; a fit needs fixed steps: give dt, or "
                    "output.every in seconds, which is then the step"
                )
            given["dt"] = given["every"]
    return given
