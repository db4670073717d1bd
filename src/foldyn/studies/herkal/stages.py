"""Stages of the cases in motion on the study's page, and their input files."""

from __future__ import annotations

import xarray

from foldyn.analyses.provenance import Call, computed, inputs, inputs_table
from foldyn.report import Heading, Listing, Section
from foldyn.studies.herkal.runs import reported
from foldyn.studies.herkal.sheet_models import AS_FILED, REFERENCE, case_study, case_with, label
from foldyn.studies.herkal.study import Study
from foldyn.viewer import Stage, stage


def stage_of(study: Study, case: str) -> Stage | None:
    """Stage of a case's motions with the shell and all models, in step; None if there are none.

    Motions are stored at the pattern's vertices, which are the nodes of the coarsest shell.
    """
    shown = {label(m): found[["displacement"]] for m, found in _motions(study, case).items()}
    if not shown:
        return None
    case_file = case_study(case)
    coarse = case_with(case_file, REFERENCE, AS_FILED, divisions=1)
    return stage(shown, dict.fromkeys(shown, coarse), case_file.heading, reported(case)[0])


def inputs_of(study: Study, call: Call | None) -> list[Section]:
    """Inputs of each case, and the total computing time."""
    sections: list[Section] = []
    every: dict[str, xarray.Dataset] = {}
    for case in study.plan.cases:
        found = _motions(study, case)
        if found:
            case_file = case_study(case)
            table = inputs_table(inputs(case_file, case_file.case(), found))
            sections += [Heading(case_file.heading, level=3), table]
            sections.append(Listing(f"The case file {case_file.path.name}", case_file.text))
        every |= {f"{case}-{m}": motion for m, motion in found.items()}
    return [*sections, inputs_table(computed(every, call or Call()))] if every else []


def _motions(study: Study, case: str) -> dict[str, xarray.Dataset]:
    """The stored motions of a case by model, starting with the shell."""
    motions = {m: study.result(case, m, "motion") for m in (REFERENCE, *study.plan.models)}
    return {m: motion for m, motion in motions.items() if motion is not None}
