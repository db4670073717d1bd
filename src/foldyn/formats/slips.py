"""Slips of drawing that keep a pattern from folding flat: reported or repaired."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from foldyn.errors import ComputationError, InputError
from foldyn.formats.diagnosis import LISTED
from foldyn.formats.notes import count
from foldyn.patterns.flat_foldability import flat_foldability
from foldyn.patterns.flat_foldable import flat_foldable, slips

if TYPE_CHECKING:
    from foldyn.formats.building import Built

# rad, smallest Kawasaki sum that is doubted: lengths with five digits, as drawing programs write
# them, leave sums of that size, and panels bend by about as much when the pattern folds
_DOUBTED = 1e-4


def without_slips(made: Built, mend: bool, is_state: bool) -> Built:
    """Move vertices to where they fold flat, if asked for; otherwise offer to.

    is_state : whether the pattern is one of several states, which may be strained.
    """
    told, pattern = made.diagnosis, made.pattern
    rows = slips(told.vertices)
    if rows.size < (1 if mend else 2):  # panels around a single vertex stay planar
        return made
    off = told.vertices.alternating[rows].max()
    if off < _DOUBTED and not mend:
        return made
    said = f"nearly flat-foldable: Kawasaki's sums are up to {np.degrees(off):.3g} degrees"
    try:
        mended = flat_foldable(pattern)
    except (InputError, ComputationError) as error:
        if mend:
            raise InputError(
                f": {error}; correct the drawing, or leave it out", "flat_foldable"
            ) from None
        if is_state and isinstance(error, InputError):
            return made
        remedy = (
            "fold it anew from its flat drawing, read with flat_foldable = true"
            if isinstance(error, InputError)
            else f"{error}; a `tolerance` joins ends that miss each other"
        )
        text = f"{said}, by which panels bend when it folds; {remedy}"
        return made._replace(diagnosis=replace(told, doubts=(*told.doubts, text)))
    moves = np.linalg.norm(mended.vertices - pattern.vertices, axis=1)
    number, most = int((moves > LISTED).sum()), f"{1e3 * moves.max():.3g} mm"
    if mend:
        text = (
            f"moved {count(number, 'vertex', 'vertices')} by up to {most} to where they fold flat"
        )
        vertices = flat_foldability(mended)
        told = replace(told, repairs=(*told.repairs, text), moves=moves, vertices=vertices)
        return made._replace(pattern=mended, diagnosis=told)
    text = (
        f"{said}, by which panels bend when it folds; flat_foldable = true moves "
        f"{count(number, 'vertex', 'vertices')} by up to {most} to where they fold flat"
    )
    return made._replace(diagnosis=replace(told, doubts=(*told.doubts, text), moves=moves))
