"""From a `Drawing` to a repaired `Pattern`, with a diagnosis."""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import FoldynWarning, InputError, quietly
from foldyn.formats.diagnosis import Diagnosis
from foldyn.formats.drawing import Drawing, Notes, count
from foldyn.formats.lines import MOST_LINES, Lines, too_many
from foldyn.formats.listed_panels import listed_panels
from foldyn.formats.panels import Panels, opened
from foldyn.patterns import Pattern
from foldyn.patterns.flat_foldability import flat_foldability
from foldyn.patterns.geometry import CLOSED, LAYERS
from foldyn.patterns.topology import Edge, Faces, at_junctions, edge_lookup, edge_of
from foldyn.patterns.transforms import FACE_ORDERS
from foldyn.values import LONGEST, SHORTEST, number

_FARTHEST = 1e8  # largest distance from the origin, relative to the size: keeps eight digits
_COARSEST = 0.05  # largest tolerance, relative to the size
_SHUT = 179.0  # degrees: larger fold angles count as closed
_TURNED = 1e-3  # rad: larger fold angles count as folded


class Built(NamedTuple):
    """A pattern and its diagnosis."""

    pattern: Pattern
    diagnosis: Diagnosis

    def noted(self, kind: str, text: str, **more: Any) -> Built:
        """Add a sentence to the assumptions, repairs or doubts, and change what else is given."""
        told = {kind: (*getattr(self.diagnosis, kind), text)}
        return self._replace(diagnosis=replace(self.diagnosis, **told), **more)


def built(
    drawing: Drawing, *, meters: float | None = None, scale: float = 1.0,
    tolerance: float | None = None,
) -> Built:  # fmt: skip
    """Build the pattern of a drawing; repair what can be repaired, refuse the rest.

    Lines without faces lie in the plane: coincident ends are joined, lines are split where they
    meet, panels are the enclosed regions, and open ends are left out. With faces, in the plane or
    in space, points that panels should share are merged. Cuts inside become two edges of the
    boundary. Joins ("J" in FOLD 1.2: two parts of one panel) become flat creases.

    Parameters
    ----------
    drawing : Drawing
        Result of a reader, with or without faces.
    meters : float, optional
        Length of the drawing's unit (m), instead of the length in the file or the assumed length
        (`drawing.assumed`).
    scale : float
        Factor on all lengths, in addition to the unit.
    tolerance : float, optional
        Distance (m) within which points are merged; by default it suits the drawing.

    Returns
    -------
    Built
        The pattern (m), and the diagnosis: assumptions, repairs, doubts. There are no warnings.

    Raises
    ------
    InputError
        The drawing cannot be repaired; the message names the place and the reason.
    """
    unit, assumptions = drawing.meters or drawing.assumed, list(drawing.assumptions)
    if meters is not None:
        unit = number("meters", meters, above=0.0)
    elif drawing.meters is None:
        assumptions.insert(
            0,
            f"the file does not say its unit: 1 {drawing.unit} is taken as {1e3 * unit:.6g} mm "
            "(`unit` or `scale` change it)",
        )
    unit *= number("scale", scale, above=0.0)
    notes = Notes(drawing, unit)
    lines = _lines(drawing, unit, notes)
    if tolerance is not None and tolerance > _COARSEST * lines.size:
        raise InputError(
            f" = {tolerance:g}: must be at most a {1 / _COARSEST:.0f}th of the sheet's size, "
            f"{_COARSEST * lines.size:.3g} m here",
            "tolerance",
        )
    if drawing.faces is None:
        from foldyn.formats.flat_drawings import flat_panels

        panels = flat_panels(lines, notes, tolerance)
    else:
        panels = listed_panels(lines, drawing.faces, notes, tolerance)
    panels, cut = opened(panels)
    if cut:
        notes.repairs.append(f"opened {count(cut, 'cut edge')}: each is two boundary edges")
    pattern = _pattern(panels, drawing, notes)
    x, y, z = np.ptp(pattern.vertices, axis=0).tolist()
    told = tuple(assumptions), tuple(notes.repairs), tuple(notes.doubts)
    diagnosis = Diagnosis((x, y, z), *told, flat_foldability(pattern), _facets(pattern, panels))
    return Built(pattern, diagnosis)


def _facets(pattern: Pattern, panels: Panels) -> tuple[Edge, ...]:
    """Creases that are drawn as flat and are to stay flat."""
    folded = edge_lookup(pattern.creases[np.nan_to_num(pattern.fold_angles) != 0.0])
    drawn = [(a, b) for a, b in pattern.creases.tolist() if panels.letters.get((a, b)) == "F"]
    return tuple(edge for edge in drawn if edge not in folded)


def _lines(drawing: Drawing, unit: float, notes: Notes) -> Lines:
    """Lines of a drawing in meters, checked; fold angles get the signs of their letters."""
    given = np.asarray(drawing.vertices, dtype=np.float64)
    for k in np.flatnonzero(~(np.abs(given) * unit <= LONGEST).all(axis=1))[:1]:  # NaN included
        raise InputError(
            f" = {given[k].tolist()}: coordinates must be finite, and at most {LONGEST:g} m",
            f"vertices[{k}]",
        )
    points = given * unit
    size = float(np.linalg.norm(np.ptp(points, axis=0))) if len(points) else 0.0
    if not size * _FARTHEST >= np.abs(points).max(initial=SHORTEST):
        raise InputError(
            f": they span {size:.3g} m, too little at this distance from the origin; draw the "
            "pattern larger, or nearer to the origin",
            "vertices",
        )
    ends = np.asarray(drawing.edges, dtype=np.int64).reshape(-1, 2)
    for k in np.flatnonzero(((ends < 0) | (ends >= len(points))).any(axis=1))[:1]:
        raise InputError(
            f" = {ends[k].tolist()}: give vertex numbers from 0 to {len(points) - 1}", f"edges[{k}]"
        )
    if len(ends) > MOST_LINES:
        raise too_many(count(len(ends), "line"))
    letters = np.array(drawing.letters, dtype="<U1").reshape(len(ends))
    angles = np.array(drawing.fold_angles, dtype=np.float64).reshape(len(ends))
    for k in np.flatnonzero(np.abs(angles) > 180.0 + 1e-6)[:1]:
        raise InputError(
            f": a fold angle of {angles[k]:g} degrees; give angles from -180 (a closed mountain) "
            "to 180",
            notes.line(k),
        )
    angles[(letters == "U") & (angles == 0.0)] = np.nan  # 0 means not given
    against = np.where(letters == "M", angles > 0, (letters == "V") & (angles < 0))
    along = np.where(letters == "M", angles < 0, (letters == "V") & (angles > 0))
    if against.any() and not along.any():
        angles = -angles
        notes.repairs.append("turned the signs of all fold angles: mountains had positive ones")
    elif against.any():
        which = np.flatnonzero(against)
        notes.doubts.append(
            f"{count(len(which), 'fold angle')} of the other sign than the letter: "
            f"{notes.lines(which.tolist())}"
        )
    return Lines(points, ends, letters, np.clip(angles, -180, 180), np.arange(len(ends)))


def _pattern(panels: Panels, drawing: Drawing, notes: Notes) -> Pattern:
    """Pattern of panels with open cuts."""
    with quietly():
        bare = Pattern(panels.points, panels.faces)
    creases = [(a, b) for a, b in bare.creases.tolist()]
    given = np.array([panels.letters.get(edge, "") for edge in creases], dtype="<U1")
    given[at_junctions(bare.creases)] = ""  # letters need a common front
    faces = _turned(bare, given, notes)
    given = _with_sides(bare, given, faces, panels, drawing, notes)
    letters: dict[Edge, str] = dict(zip(creases, given.tolist(), strict=True))
    letters = {edge: letter for edge, letter in letters.items() if letter}
    folds, trusted = 0, drawing.faces is None or bool(bare.vertices[:, 2].any())
    for a, b in bare.boundary.tolist():
        letter = panels.letters.get((a, b))
        folds += letter in ("M", "V")
        if letter == "C" or (letter == "B" and trusted):
            letters[a, b] = "B"
    if folds:
        notes.repairs.append(
            f"{count(folds, 'mountain or valley', 'mountains or valleys')} on the outline, of one "
            "panel only, taken as the boundary"
        )
    drawn = {edge: panels.angles.get(edge, np.nan) for edge in creases}
    angles = {edge: float(np.radians(own)) for edge, own in drawn.items() if np.isfinite(own)}
    with warnings.catch_warnings(record=True, action="always", category=FoldynWarning) as doubts:
        pattern = Pattern(
            panels.points, faces, letters, drawing.name, fold_angles=angles, custom=drawing.custom
        )
    notes.doubts += [str(doubt.message) for doubt in doubts]
    return _with_fronts(pattern, panels.faces, drawing, notes)


def _turned(bare: Pattern, letters: NDArray[np.str_], notes: Notes) -> Faces:
    """Faces, turned over if every folded crease contradicts its letter."""
    turn = bare.dihedrals - np.pi
    right = ((letters == "M") & (turn > _TURNED)) | ((letters == "V") & (turn < -_TURNED))
    wrong = ((letters == "M") & (turn < -_TURNED)) | ((letters == "V") & (turn > _TURNED))
    wrong &= np.abs(turn) < np.pi - _TURNED  # coincident panels fit either letter
    if right.any() or not wrong.any():
        return bare.faces
    notes.repairs.append("turned all panels over: seen from their front, every letter was wrong")
    return tuple((face[0], *face[:0:-1]) for face in bare.faces)


def _with_sides(
    bare: Pattern, given: NDArray[np.str_], faces: Faces, panels: Panels, drawing: Drawing,
    notes: Notes,
) -> NDArray[np.str_]:  # fmt: skip
    """Letters of creases; for closed creases they follow from fold angles or the order of layers.

    Coincident panels have their fronts together at a valley, and their backs together at a
    mountain.
    """
    orders = drawing.custom.get(FACE_ORDERS, ())
    if len(faces) != len(drawing.faces or ()):
        orders = ()
    over = {edge_of(f, g): -s if faces[g][1] != panels.faces[g][1] else s for f, g, s in orders}
    letters, unknown, against = given.copy(), [], []
    turn = np.abs(bare.dihedrals - np.pi)
    for k in np.flatnonzero(turn > np.pi - CLOSED).tolist():
        edge, pair = edge_of(*bare.creases[k].tolist()), edge_of(*bare.crease_faces[k].tolist())
        angle = panels.angles.get(edge, np.nan)
        order = over.get(pair, 0)
        side = order or (np.sign(angle) if abs(angle) > _SHUT else 0)
        told = "V" if side > 0 else "M"
        if given[k] in ("M", "V"):
            against += [edge] if order and told != given[k] else []
        elif side and (not given[k] or told == "M"):  # other creases are closed to the front
            letters[k] = told
        elif not side and turn[k] > np.pi - LAYERS:
            letters[k] = given[k] or "V"
            unknown.append(edge)
    for edges, what, text in (
        (unknown, "without letter or order of layers", "taken as folded to the front, as valleys"),
        (against, "whose letter contradicts the order of layers", "the letters are kept"),
    ):
        if edges:
            which = count(len(edges), "closed crease")
            notes.doubts.append(f"{which} {what}, as {edges[0]}: {text}")
    return letters


def _with_fronts(pattern: Pattern, faces: Faces, drawing: Drawing, notes: Notes) -> Pattern:
    """Keep the order of layers if the panels, built from `faces`, are the panels of the file.

    The order refers to fronts, so it is reversed for panels that were turned over.
    """
    given = pattern.custom.get(FACE_ORDERS)
    if given is None:
        return pattern
    custom = {key: value for key, value in pattern.custom.items() if key != FACE_ORDERS}
    if len(faces) == len(drawing.faces or ()):
        turned = [now[1] != before[1] for now, before in zip(pattern.faces, faces, strict=True)]
        custom[FACE_ORDERS] = [[f, g, -s if turned[g] else s] for f, g, s in given]
    else:
        notes.repairs.append(f"{FACE_ORDERS} left out: the panels are not those of the file")
    return pattern.changed(custom=custom)
