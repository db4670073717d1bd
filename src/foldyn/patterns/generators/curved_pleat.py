"""Pleats along a curve, in flat strips."""

from __future__ import annotations

import math

import numpy as np

from foldyn.errors import within
from foldyn.patterns.generators.arguments import angle_between, check_size, fold_dihedral
from foldyn.patterns.generators.grid import indices, opposite, sheet
from foldyn.patterns.pattern import Pattern
from foldyn.values import length, whole


def curved_pleat(
    pleats: int = 4,
    segments: int = 9,
    *,
    a: float = 0.4,
    radius: float = 1.0,
    arc: float = 90.0,
    dihedral: float = 110.0,
) -> Pattern:
    """Sheet pleated along circular arcs, each a polygon, with straight rulings.

    The creases are copies of one polygon with its corners on an arc, each shifted by `a` along y
    from the last; rulings join their corners. Vertex (i, j), i along the arc and j along y, is
    number i (pleats + 1) + j. With the tilt f = (180 - dihedral)/2 of the rulings it lies at
    (X_i, Y_i + a j cos f, a sin f [j odd]), where a chord (x, y) of the flat arc becomes
    (sqrt(x^2 + y^2 - (y/cos f)^2), y/cos f). Panels are parallelograms and keep their angles.

    Parameters
    ----------
    pleats : int
        Strips along y, at least 1.
    segments : int
        Chords of the arc, at least 1; more of them come closer to a curved crease.
    a : float
        Length of the rulings of a strip (m).
    radius : float
        Radius of the arc (m) when the sheet is flat.
    arc : float
        Angle of the arc (degrees, between 0 and 180).
    dihedral : float
        180 degrees less twice the tilt of the rulings: the angle across a crease where it is at
        right angles to them (degrees; 180 is flat). The pleat is closed when this is the angle of
        the outermost chords.

    Returns
    -------
    Pattern
        (segments + 1)(pleats + 1) vertices and segments pleats faces, front to +z. Families:
        "curve", valleys where j is even, mountains where it is odd, and "ruling".

    Raises
    ------
    InputError
        An argument of the wrong type or out of range.

    Notes
    -----
    J. M. Gattas, Z. You, Miura-base rigid origami: parametrizations of curved-crease geometries,
    J. Mech. Des. 136, 2014. The sheet folds rigidly with one degree of freedom, but not to flat
    layers. Strips between concentric curves do not: they have no folded state without more creases
    (E. Demaine et al., (Non)existence of pleated folds, Graphs Comb. 27, 2011).
    """
    with within("curved_pleat: "):
        pleats, segments = whole("pleats", pleats, least=1), whole("segments", segments, least=1)
        check_size(f"pleats = {pleats}, segments = {segments}", (pleats + 1) * (segments + 1))
        a, radius = length("a", a), length("radius", radius)
        arc = angle_between("arc", arc, 0.0, 180.0)
        step = arc / segments
        slope = np.radians((np.arange(segments) + 0.5) * step - arc / 2)  # of the chords
        flat = dihedral == 180
        steepest = arc - step
        dihedral = fold_dihedral(dihedral, least=steepest)
    chord = 2.0 * radius * math.sin(math.radians(step) / 2)
    tilt = math.radians(180.0 - dihedral) / 2
    along = chord * np.sin(slope) / math.cos(tilt)
    across = np.sqrt(np.maximum(chord**2 - along**2, 0.0))
    i, j = indices(segments, pleats)
    x, y = (np.concatenate([[0.0], np.cumsum(part)])[i] for part in (across, along))
    letters = None
    if flat:
        letters = curved_pleat(
            pleats, segments, a=a, radius=radius, arc=arc, dihedral=(180 + steepest) / 2
        ).assignments
    places = [x, y + a * math.cos(tilt) * j, a * math.sin(tilt) * (j % 2)]
    periods = opposite(segments, pleats)[1:] if pleats % 2 == 0 else ()
    return sheet("curved pleat", places, ("curve", "ruling"), letters, periods)
