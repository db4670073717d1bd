"""Steps after a pattern is built from a file: facets, convex panels, slips.

Facets are lines assigned "F" along which a sheet is not creased. Slips are small errors of a
drawing that keep a pattern from folding flat.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from foldyn.errors import ComputationError, InputError, within
from foldyn.formats.building import Built
from foldyn.formats.diagnosis import LISTED
from foldyn.formats.drawing import Drawing, count
from foldyn.patterns import Pattern, convex, welded
from foldyn.patterns.facets import COPLANAR, FACETS, HINGE, WELD, what_was_cut
from foldyn.patterns.flat_foldability import flat_foldability, flat_foldable, slips
from foldyn.patterns.topology import Edge, edge_lookup
from foldyn.values import choice


def with_facets(made: Built, drawing: Drawing, facets: str | None) -> Built:
    """Weld the facets of a pattern, or keep them as creases.

    facets : one of `FACETS`. None means "weld" if all facets are coplanar with their panels or if
    the file marks which of its flat creases are facets, otherwise "hinge".
    """
    drawn = _drawn(made, drawing)
    if facets is not None:
        choice("facets", facets, FACETS)
        if facets == HINGE or not (drawn or made.diagnosis.facets):
            return made
        chosen = tuple(dict.fromkeys((*made.diagnosis.facets, *drawn)))
        with within("facets"):
            return made._replace(pattern=welded(made.pattern, chosen, join=facets == WELD))
    if drawing.welds is not None:
        return made._replace(pattern=welded(made.pattern, drawn)) if drawn else made
    if not made.diagnosis.facets:
        return made
    bent = _bent(made.pattern, made.diagnosis.facets)
    if bent:
        text = (
            f"{bent}: flat creases of the file are folded, so that all of its flat creases are "
            'hinges; facets = "weld" takes them for lines in the sheet, "hinge" for hinges'
        )
        return made.noted("doubts", text)
    pattern = welded(made.pattern, made.diagnosis.facets)
    return made.noted("assumptions", _acted(made.pattern, pattern), pattern=pattern)


def with_convex_panels(made: Built) -> Built:
    """Cut panels that are not convex."""
    pattern = convex(made.pattern)
    if pattern is made.pattern:
        return made
    return made.noted("repairs", what_was_cut(made.pattern, pattern), pattern=pattern)


def _drawn(made: Built, drawing: Drawing) -> tuple[Edge, ...]:
    """Facets that the file names, if the pattern still has the file's vertices."""
    creases = edge_lookup(made.pattern.creases)
    same = len(made.pattern.vertices) == len(drawing.vertices)
    pairs = [(min(pair), max(pair)) for pair in drawing.welds or ()]
    return tuple(pair for pair in pairs if same and pair in creases)


def _bent(pattern: Pattern, facets: tuple[Edge, ...]) -> str:
    """Describe facets between panels that are not coplanar."""
    row = edge_lookup(pattern.creases)
    turn = np.degrees(np.abs(pattern.dihedrals[[row[edge] for edge in facets]] - np.pi))
    worst = int(turn.argmax())
    if turn[worst] <= np.degrees(COPLANAR):
        return ""
    which = count(int((turn > np.degrees(COPLANAR)).sum()), "facet")
    return f"{which}, {facets[worst]} by {turn[worst]:.3g} degrees"


def _acted(before: Pattern, after: Pattern) -> str:
    """Describe the effect of welding."""
    lost = len(before.creases) - len(after.creases)
    new = len(set(after.faces) - set(before.faces))
    parts = []
    if new:
        whole = len(before.faces) - len(after.faces) + new
        parts.append(f"{count(whole, 'panel')} joined to {new}")
    if len(after.welds):
        parts.append(f"{len(after.welds)} kept as welds")
    return (
        f"{count(lost, 'line')} assigned F taken as part of the sheet, not as hinges "
        f'({", ".join(parts)}; facets = "hinge" makes them hinges)'
    )


# rad, smallest Kawasaki sum that is doubted: lengths with five digits, as drawing programs write
# them, leave sums of that size, and panels bend by about as much when the pattern folds
_DOUBTED = 1e-4


def without_slips(made: Built, mend: bool, is_state: bool) -> Built:
    """Move vertices to places where they fold flat if `mend` is set; otherwise suggest it.

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
            "fold it again from its flat drawing, read with flat_foldable = true"
            if isinstance(error, InputError)
            else f"{error}; a `tolerance` joins ends that miss each other"
        )
        return made.noted("doubts", f"{said}, by which panels bend when it folds; {remedy}")
    moves = np.linalg.norm(mended.vertices - pattern.vertices, axis=1)
    which = count(int((moves > LISTED).sum()), "vertex", "vertices")
    moving = f"{which} by up to {1e3 * moves.max():.3g} mm to where they fold flat"
    made = made._replace(diagnosis=replace(told, moves=moves))
    if mend:
        diagnosis = replace(made.diagnosis, vertices=flat_foldability(mended))
        return Built(mended, diagnosis).noted("repairs", f"moved {moving}")
    text = f"{said}, by which panels bend when it folds; flat_foldable = true moves {moving}"
    return made.noted("doubts", text)
