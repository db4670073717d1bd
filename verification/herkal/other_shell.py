"""The paper's metric against the shell of OpenSees, from its stored motions."""

from __future__ import annotations

from typing import Any

import numpy as np

from foldyn.report import Section, Table
from foldyn.report.sections import cell
from foldyn.studies.herkal import metric, runs
from foldyn.studies.herkal.specimen.page import NO_BREAK
from foldyn.studies.herkal.study import Study
from verification.opensees.stored import read_motion, stored_motions


def second_table(study: Study) -> dict[str, tuple[int, dict[str, float]]]:
    """By case, the divisions of OpenSees' finest stored motion, and errors relative to that motion.

    Cases without such a motion, or with a duration other than that of the study, are left out.
    """
    found = {}
    for case in study.plan.cases:
        for divisions, dt in reversed(stored_motions(case)):
            row = _second_row(study, case, divisions, dt)
            if row:
                found[case] = divisions, row
                break
    return found


def _second_row(study: Study, case: str, divisions: int, dt: float) -> dict[str, float]:
    nodes, axis, up_to = runs.reported(case)
    theirs = read_motion(case, divisions, dt)
    if theirs.node.tolist() != nodes:
        return {}
    moved = theirs.displacement[:, :, "xyz".index(axis)]
    reference = metric.content_of(theirs.time, moved, up_to)[1]
    row = {}
    for model in study.plan.models:
        motion = study.result(case, model, "motion")
        if motion is None or len(motion["time"]) != len(theirs.time):
            return {}
        ours = metric.content(motion, nodes, axis, up_to)[1]
        row[model] = float(np.mean(metric.deviation(ours, reference)))
    return row


def sections(study: Study) -> list[Section]:
    """Table of errors against both shells; empty without stored motions of the same length."""
    found = second_table(study)
    rows: list[list[Any]] = []
    for case, (divisions, row) in found.items():
        ours = study.table()[case]
        own = study.plan.numerics.divisions
        rows.append([case[-1], f"Foldyn,{NO_BREAK}{own}", *[cell(ours[m]) for m in row]])
        rows.append(["", f"OpenSees,{NO_BREAK}{divisions}", *row.values()])
    table = Table(
        ["case", "shell, divisions", *study.plan.models.values()],
        rows,
        "The same errors against a shell of OpenSees: triangles with transverse shear and springs "
        "between crease nodes.",
        digits=3,
    )
    return [table] if found else []
