"""What a pattern keeps of a file beside its geometry: angles to fold to, families of creases."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from foldyn.formats.building import Built
from foldyn.formats.drawing import Drawing
from foldyn.patterns.frames import fold_angles

SAME = 1e-4  # rad: digits of a file


def without_repetition(made: Built) -> Built:
    """Leave out fold angles that only repeat how the vertices lie: they are no state to fold to."""
    wanted, there = made.pattern.fold_angles, fold_angles(made.pattern)
    given = ~np.isnan(wanted)
    if given.any() and np.abs(wanted - there)[given].max() < SAME:
        return made._replace(pattern=made.pattern.changed(fold_angles=None))
    return made


def with_families(made: Built, drawing: Drawing) -> Built:
    """Put families of creases into a pattern, where its vertices are still those of the drawing."""
    if not drawing.families:
        return made
    creases = {(a, b) for a, b in made.pattern.creases.tolist()}
    pairs = {tuple(sorted(pair)) for members in drawing.families.values() for pair in members}
    if len(made.pattern.vertices) == len(drawing.vertices) and pairs <= creases:
        return made._replace(pattern=made.pattern.changed(families=drawing.families))
    told = (*made.diagnosis.repairs, "families of creases left out: the vertices are others now")
    return made._replace(diagnosis=replace(made.diagnosis, repairs=told))
