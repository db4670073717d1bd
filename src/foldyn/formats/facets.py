"""Facets of pattern files: lines assigned "F" along which a sheet is not creased."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from foldyn.errors import within
from foldyn.formats.notes import count
from foldyn.patterns import Pattern, convex, welded
from foldyn.patterns.convex import what_was_cut
from foldyn.patterns.facets import COPLANAR, FACETS, HINGE, WELD
from foldyn.patterns.topology import Edge, edge_lookup
from foldyn.values import choice

if TYPE_CHECKING:
    from foldyn.formats.building import Built
    from foldyn.formats.drawing import Drawing


def with_facets(made: Built, drawing: Drawing, facets: str | None) -> Built:
    """Weld the facets of a pattern, or keep them as creases.

    facets : one of `FACETS`; None means "weld" if all facets are coplanar with their panels,
        or the file says which of its flat creases are facets, else "hinge".
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
    told, bent = made.diagnosis, _bent(made.pattern, made.diagnosis.facets)
    if bent:
        text = (
            f"{bent}: flat creases of the file are folded, so that all of its flat creases are "
            'hinges; facets = "weld" takes them for lines in the sheet, "hinge" for hinges'
        )
        return made._replace(diagnosis=replace(told, doubts=(*told.doubts, text)))
    pattern = welded(made.pattern, made.diagnosis.facets)
    text = _acted(made.pattern, pattern)
    return made._replace(
        pattern=pattern, diagnosis=replace(told, assumptions=(*told.assumptions, text))
    )


def with_convex_panels(made: Built) -> Built:
    """Cut panels that are not convex."""
    pattern, told = convex(made.pattern), made.diagnosis
    if pattern is made.pattern:
        return made
    repairs = (*told.repairs, what_was_cut(made.pattern, pattern))
    return made._replace(pattern=pattern, diagnosis=replace(told, repairs=repairs))


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
