"""Errors against another shell: the stored motions of OpenSees."""

from __future__ import annotations

import numpy as np

from foldyn.studies.herkal.metric import AXES, UP_TO, content, content_of, deviation
from foldyn.studies.herkal.opensees.stored import read_motion, stored_motions
from foldyn.studies.herkal.study import Study


def second_table(study: Study) -> dict[str, tuple[int, dict[str, float]]]:
    """Divisions of the finest stored motion of OpenSees and the errors against it, by case.

    Cases without one, or with one of another length than the study's motions, are left out.
    """
    found = {}
    for case in study.plan.cases:
        for divisions, dt in reversed(stored_motions(case)):
            row = _row(study, case, divisions, dt)
            if row:
                found[case] = divisions, row
                break
    return found


def _row(study: Study, case: str, divisions: int, dt: float) -> dict[str, float]:
    nodes, axis = study.reported(case)
    theirs = read_motion(case, divisions, dt)
    if theirs.node.tolist() != nodes:
        return {}
    up_to = study.case_file(case).output.max_frequency or UP_TO
    moved = theirs.displacement[:, :, AXES.index(axis)]
    reference = content_of(theirs.time, moved, up_to)[1]
    row = {}
    for model in study.plan.models:
        motion = study.result(case, model, "motion")
        if motion is None or len(motion["time"]) != len(theirs.time):
            return {}
        ours = content(motion, nodes, axis, up_to)[1]
        row[model] = float(np.mean(deviation(ours, reference)))
    return row
