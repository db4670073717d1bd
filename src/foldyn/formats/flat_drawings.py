"""Panels of a drawing that has only lines, found from its planar graph, with notes on repairs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.formats import planar
from foldyn.formats.drawing import Notes, count
from foldyn.formats.lines import Lines, single, without_points
from foldyn.formats.panels import Panels, compact, with_inner_borders
from foldyn.formats.regions import areas, enclosed, sheet, straightened

_SAME = 1e-9  # relative to the size: larger distances between joined ends are reported
_PLANE = 1e-9  # relative to the size: smaller heights count as zero


def flat_panels(lines: Lines, notes: Notes, tolerance: float | None = None) -> Panels:
    """Panels enclosed by lines in the plane.

    Parameters
    ----------
    lines : Lines
        Lines as drawn (m), with two coordinates, or with three coordinates if one is constant.
    notes : Notes
        Collects repairs and doubts.
    tolerance : float, optional
        Distance (m) within which ends are merged; by default it suits the lines.

    Raises
    ------
    InputError
        The lines are not in the plane, enclose nothing, or are too many.
    """
    lines = _in_plane(lines, notes)
    tolerance = planar.tolerance_of(lines) if tolerance is None else tolerance
    whole = _joined(lines, tolerance, notes)
    whole, contradictions = single(whole)
    notes.contradict(contradictions)
    planar.check_crowding(whole)
    whole = _on_lines(whole, tolerance, notes)
    parted = planar.split(whole, tolerance)
    if len(parted.ends) > len(whole.ends):
        more = len(parted.ends) - len(whole.ends)
        notes.repairs.append(f"split lines where they meet: {count(more, 'piece')} more")
    suspects = np.unique(planar.points_on(whole, 0.5 * tolerance)[:, 1])
    pieces = straightened(parted, suspects, tolerance)
    if len(pieces.ends) < len(parted.ends):
        more = len(parted.ends) - len(pieces.ends)
        notes.repairs.append(f"left out {count(more, 'end')} of lines upon others, within these")
    pieces, moved, farthest = planar.without_gaps(pieces, tolerance)
    if moved:
        notes.repairs.append(
            f"drew {count(moved, 'open end')} on to the next line, by up to {1e3 * farthest:.3g} mm"
        )
    panels, loose, divided = enclosed(pieces, tolerance)
    _tell_loose(loose, lines, notes)
    if divided:
        notes.repairs.append(
            f"divided {count(divided, 'panel')} with others or openings inside into triangles, by "
            "flat creases"
        )
    drawn = panels
    panels, cuts, folds = with_inner_borders(panels)
    if cuts:
        notes.doubts.append(f"{count(cuts, 'line')} of the outline inside the sheet taken as cuts")
    if folds:
        notes.doubts.append(
            f"all lines are of the outline's kind: the {folds} inside the sheet are taken as "
            "creases without a letter"
        )
    panels, openings, others = sheet(panels)
    meant = _uncut(drawn, panels, openings, cuts) if cuts else len(openings)
    if len(openings):
        told = notes.repairs if meant == len(openings) else notes.doubts
        told.append(
            f"left out {count(len(openings), 'region')} that cuts bound on all sides, of "
            f"{1e6 * openings.sum():.4g} mm2 in all"
        )
    for area, corner in others[:3]:
        notes.doubts.append(
            f"left out another sheet of {1e6 * area:.4g} mm2 at {notes.point(corner)}, which no "
            "crease joins to the largest"
        )
    if len(others) > 3:
        notes.doubts.append(f"left out {len(others) - 3} more such sheets")
    return compact(panels)


def _uncut(drawn: Panels, kept: Panels, openings: NDArray, cuts: int) -> int:
    """Number of openings if inner lines of the outline do not count as cuts.

    Raises
    ------
    InputError
        As cuts, these lines would cut pieces off the sheet.
    """
    whole, meant, _ = sheet(drawn)
    before, after = areas(whole).sum(), areas(kept).sum()
    if before - after - (openings.sum() - meant.sum()) > _SAME * before:
        raise InputError(
            f": {cuts} of the outline's kind (black, B) are inside the sheet; as cuts they would "
            f"leave {1e6 * after:.4g} of its {1e6 * before:.4g} mm2: draw creases as such (those "
            "without a letter magenta, U), and what cuts pieces off as cuts (green, C); a "
            "`tolerance` joins ends that miss each other",
            "lines",
        )
    return len(meant)


def _in_plane(lines: Lines, notes: Notes) -> Lines:
    """Lines in the xy plane; another plane is turned into it, seen from its positive side."""
    points = lines.points
    if not len(lines.ends):
        raise InputError(": there are none; give a file with a crease pattern", "lines")
    if points.shape[1] == 3:
        extent = np.ptp(points[np.unique(lines.ends)], axis=0)
        x, y, z = points.T
        even = extent <= _PLANE * np.linalg.norm(extent)
        if not even.any():
            raise InputError(
                ": panels cannot be found from lines in space; give a file with faces", "lines"
            )
        if not even[2]:
            points = np.stack([x, -z] if even[1] else [y, z], axis=1)
            notes.repairs.append(
                f"turned the drawing, which is in the plane of {'x' if even[1] else 'y'} and z, "
                "into that of x and y"
            )
    return replace(lines, points=points[:, :2])


def _joined(lines: Lines, tolerance: float, notes: Notes) -> Lines:
    """Lines with joined ends; lines of zero length are left out."""
    whole = planar.joined(lines, tolerance)
    moves = np.linalg.norm(whole.points[whole.ends] - lines.points[lines.ends], axis=2)
    moved = int(np.count_nonzero(moves > _SAME * lines.size))
    if moved:
        notes.repairs.append(
            f"joined {count(moved, 'line end')} to others up to {1e3 * moves.max():.3g} mm away"
        )
    lengths = lines.lengths
    drawn = without_points(whole)
    if len(drawn.ends) < len(whole.ends):
        gone = np.setdiff1d(whole.source, drawn.source)
        notes.repairs.append(
            f"left out {count(len(gone), 'line')} of no length (up to "
            f"{1e3 * lengths[gone].max():.3g} mm): {notes.lines(gone.tolist())}"
        )
    if not len(drawn.ends):
        raise InputError(": all are points; give a file with a crease pattern", "lines")
    return drawn


def _on_lines(lines: Lines, tolerance: float, notes: Notes) -> Lines:
    """Move line ends onto lines that they nearly reach."""
    placed = planar.on_lines(lines, tolerance)
    moves = np.linalg.norm(placed.points - lines.points, axis=1)
    if moves.any():
        notes.repairs.append(
            f"moved {count(int(np.count_nonzero(moves)), 'line end')} onto lines up to "
            f"{1e3 * moves.max():.3g} mm away"
        )
    return placed


def _tell_loose(loose: Lines, lines: Lines, notes: Notes) -> None:
    """Report lines that bound no panel; among them, cuts and long pieces of creases are doubted."""
    folds = np.isin(loose.letters, ("M", "V", "U")) & (loose.lengths > 2 * planar.GAP * lines.size)
    slits = loose.letters == "C"
    for which, told, noun, what in (
        (~slits & ~folds, notes.repairs, "line", "or parts of them that bound no panel"),
        (folds, notes.doubts, "crease", "or parts of them that bound no panel (end them on lines)"),
        (slits, notes.doubts, "cut", "that end inside a panel (end them on creases)"),
    ):
        rows = np.unique(loose.source[which])
        if len(rows):
            where = lines.points[lines.ends[rows]].mean(axis=1)
            names = notes.lines(rows.tolist(), list(where))
            told.append(f"left out {count(len(rows), noun)} {what}: {names}")
