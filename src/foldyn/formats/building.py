"""From a `Drawing` to a `Pattern`, repaired, with a diagnosis of what was done."""

from __future__ import annotations

import warnings
from typing import NamedTuple

import numpy as np
import shapely

from foldyn.errors import FoldynWarning, InputError
from foldyn.formats.diagnosis import Diagnosis
from foldyn.formats.drawing import Drawing
from foldyn.patterns import Pattern
from foldyn.patterns.topology import edge_of


class Built(NamedTuple):
    """A pattern and what is to be said of it."""

    pattern: Pattern
    diagnosis: Diagnosis


def built(drawing: Drawing, *, meters: float | None = None, scale: float = 1.0) -> Built:
    """Build the pattern of a drawing: repaired where that can be done, refused where not.

    Parameters
    ----------
    drawing : Drawing
        What a reader gives, with or without faces.
    meters : float, optional
        Length of the drawing's unit (m), in place of the one that the file says or that is
        assumed (`drawing.assumed`).
    scale : float
        Factor on all lengths, beside the unit.

    Returns
    -------
    Built
        The pattern (m), and the diagnosis: assumptions, repairs, doubts. Nothing is warned.

    Raises
    ------
    InputError
        What cannot be repaired; the message names the place and the reason.
    """
    unit = meters or drawing.meters or 1.0
    points = np.asarray(drawing.vertices, dtype=np.float64)
    faces = drawing.faces
    if faces is None:
        number = {(x, y): k for k, (x, y, *_) in enumerate(points.tolist())}
        lines = shapely.linestrings(points[drawing.edges][..., :2])
        polygons = shapely.get_parts(shapely.polygonize(list(lines)))
        faces = tuple(
            tuple(number[x, y] for x, y in polygon.exterior.coords[:-1]) for polygon in polygons
        )
        if not faces:
            raise InputError(": the lines enclose no panel; draw the sheet's outline", "lines")
    with warnings.catch_warnings(record=True) as doubts:
        warnings.simplefilter("always", FoldynWarning)
        bare = Pattern(points * (unit * scale), faces, name=drawing.name)
        creases = {(a, b) for a, b in bare.creases.tolist()}
        pairs = [edge_of(a, b) for a, b in drawing.edges.tolist()]
        letters = {
            pair: letter
            for pair, letter in zip(pairs, drawing.letters, strict=True)
            if pair in creases
        }
        pattern = Pattern(bare.vertices, faces, letters, drawing.name, custom=drawing.custom)
    return Built(
        pattern,
        Diagnosis(
            size=tuple(np.ptp(pattern.vertices, axis=0).tolist()),
            repairs=drawing.repairs,
            doubts=tuple(str(doubt.message) for doubt in doubts),
        ),
    )
