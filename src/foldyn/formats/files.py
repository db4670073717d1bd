"""Pattern files: the registry of formats, and reading and writing by extension."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from foldyn.errors import InputError, warn, within
from foldyn.formats import cp, dxf, fold, obj, opx, stl, svg
from foldyn.formats.building import Built, built
from foldyn.formats.drawing import METERS, Drawing
from foldyn.formats.facets import with_convex_panels, with_facets, without_slips
from foldyn.formats.writers import warn_of_boards
from foldyn.input_files import path_of, read_text
from foldyn.patterns import Pattern
from foldyn.patterns.facets import LINE
from foldyn.patterns.frames import Frame, fold_angles
from foldyn.patterns.pattern import pattern_of
from foldyn.values import choice, flag, length, listed, number, of_kind
from foldyn.writing import write_bytes

MOST = 32
"""Largest pattern file (MiB)."""
SAME = 1e-4
"""Difference of fold angles (rad) that count as equal, given the digits of a file."""


@dataclass(frozen=True)
class Format:
    """A text format for patterns.

    Reading and writing work on text. Opening, decoding and saving files, naming the file in
    messages, and building the pattern from lines (`built`) are shared by all formats.

    Parameters
    ----------
    name : str
        Name of the format.
    extensions : tuple of str
        File extensions, lower case with the dot.
    read : callable or None
        Turns the text of a file into a `Drawing`; raises `InputError`, which names the place. None:
        the format is written only.
    write : callable or None
        Turns a `Pattern` into the text of a file. None: the format is read only.
    frames : bool
        Whether files hold several frames. If so, the second argument of `read` is the number or
        title of a frame, and that of `write` a sequence of `Frame`.
    """

    name: str
    extensions: tuple[str, ...]
    read: Callable[..., Drawing] | None = None
    write: Callable[..., str] | None = None
    frames: bool = False

    @property
    def named(self) -> str:
        """Name a file of this format with its spoken article: "an SVG file"."""
        return f"{'an' if self.name[0] in 'OS' else 'a'} {self.name} file"


_FORMATS = (
    Format("FOLD", (".fold",), read=fold.read, write=fold.write, frames=True),
    Format("OBJ", (".obj",), read=obj.read, write=obj.write),
    Format("SVG", (".svg",), read=svg.read, write=svg.write),
    Format("CP", (".cp",), read=cp.read, write=cp.write),
    Format("OPX", (".opx",), read=opx.read),
    Format("DXF", (".dxf",), read=dxf.read, write=dxf.write),
    Format("STL", (".stl",), write=stl.write),
)

FORMATS: dict[str, Format] = {end: fmt for fmt in _FORMATS for end in fmt.extensions}
"""The format of each file extension."""


def read_pattern(
    path: str | os.PathLike[str],
    scale: float | None = None,
    *,
    unit: str | None = None,
    frame: int | str | None = None,
    facets: Literal["weld", "line", "hinge"] | None = None,
    tolerance: float | None = None,
    flat_foldable: bool = False,
) -> Pattern:
    """Read a pattern from a file; its extension determines the format.

    Parameters
    ----------
    path : path-like
        The file, for example "crane.fold"; `FORMATS` lists the extensions.
    scale : float, optional
        Factor on all lengths.
    unit : str, optional
        Unit of the file's coordinates, such as "mm", instead of the unit in the file. A file
        without a unit is taken to be in meters.
    frame : int or str, optional
        Number or title of a frame, if the file has several.
    facets : {"weld", "line", "hinge"}, optional
        Meaning of lines assigned "F". "weld": facets across which the sheet is continuous; panels
        are joined, as `welded` does. "line": facets, kept as the pattern's `welds`. "hinge": flat
        creases. By default they are facets, as with "weld", if all are coplanar with their panels
        (a warning reports this); else hinges. Files by Foldyn mark which are facets. Except with
        "line", panels that are not convex are cut along welds, as `convex` does.
    tolerance : float, optional
        Distance (m) within which ends of lines, or points that panels should share, are merged; by
        default it suits the file.
    flat_foldable : bool
        Whether to move vertices of a flat drawing that nearly folds flat to the nearest places
        where it does, as `fd.flat_foldable`; `diagnose` gives the distance of each move.

    Returns
    -------
    Pattern
        With coordinates in meters.

    Raises
    ------
    InputError
        The file does not exist, has an unknown extension, or its content is not a pattern and
        cannot be repaired; the message names the file and the place.

    Warns
    -----
    FoldynWarning
        The reader made assumptions (shown with the pattern's size) or repairs, or has doubts.
    """
    pattern, diagnosis = diagnose(
        path,
        scale,
        unit=unit,
        frame=frame,
        facets=facets,
        tolerance=tolerance,
        flat_foldable=flat_foldable,
    )
    size = " x ".join(f"{length:.4g}" for length in diagnosis.size)
    for told in (
        diagnosis.assumptions and f"{'; '.join(diagnosis.assumptions)}; the sheet is {size} m",
        diagnosis.repairs and f"repaired: {'; '.join(diagnosis.repairs)}",
        *diagnosis.doubts,
    ):
        if told:
            warn(f"{path}: {told}", "pattern-files.md#repairs")
    return pattern


def diagnose(
    path: str | os.PathLike[str],
    scale: float | None = None,
    *,
    unit: str | None = None,
    frame: int | str | None = None,
    facets: Literal["weld", "line", "hinge"] | None = None,
    tolerance: float | None = None,
    flat_foldable: bool = False,
) -> Built:
    """Read a pattern as `read_pattern` does, and return the diagnosis instead of warning.

    Returns
    -------
    Built
        The `pattern`, and the `diagnosis`: assumptions, repairs and doubts. The text of the
        diagnosis is the output of ``foldyn convert --check``.

    Raises
    ------
    InputError
        As `read_pattern`.
    """
    meters = None if unit is None else METERS[choice("unit", unit, METERS)]
    factor = 1.0 if scale is None else number("scale", scale, above=0.0)
    mend = flag("flat_foldable", flat_foldable)
    near = None if tolerance is None else length("tolerance", tolerance)
    file, fmt = _file_and_format(path)
    if fmt.read is None:
        raise InputError(f"{file}: {fmt.name} files can be written but not read.")
    if frame is not None and not fmt.frames:
        raise InputError(f": {fmt.name} files have no frames; leave it out", "frame", file)
    text = read_text(file, fmt.named, MOST, "leave out all but the pattern")
    with within("", file):
        drawing = fmt.read(text, *((frame,) if fmt.frames else ()))
        made = built(drawing, meters=meters, scale=factor, tolerance=near)
        made = _with_families(_without_repetition(made), drawing)
        made = without_slips(made, mend, frame is not None)
        made = with_facets(made, drawing, facets)
        return made if facets == LINE else with_convex_panels(made)


def _without_repetition(made: Built) -> Built:
    """Drop fold angles that equal the current angles: they define no other state to fold to."""
    wanted, there = made.pattern.fold_angles, fold_angles(made.pattern)
    given = ~np.isnan(wanted)
    if given.any() and np.abs(wanted - there)[given].max() < SAME:
        return made._replace(pattern=made.pattern.changed(fold_angles=None))
    return made


def _with_families(made: Built, drawing: Drawing) -> Built:
    """Add families of creases to a pattern that still has the drawing's vertices."""
    if not drawing.families:
        return made
    creases = {(a, b) for a, b in made.pattern.creases.tolist()}
    pairs = {tuple(sorted(pair)) for members in drawing.families.values() for pair in members}
    if len(made.pattern.vertices) == len(drawing.vertices) and pairs <= creases:
        return made._replace(pattern=made.pattern.changed(families=drawing.families))
    return made.noted("repairs", "families of creases left out: the vertices are others now")


def write_pattern(
    pattern: Pattern, path: str | os.PathLike[str], *, frames: Sequence[Frame] = ()
) -> None:
    """Write a pattern to a file; its extension determines the format.

    The file is replaced in one step once its text is complete, so that a failure leaves the old
    file.

    Parameters
    ----------
    pattern : Pattern
        What to write.
    path : path-like
        The file to make or to replace; its directory must exist.
    frames : sequence of Frame, optional
        States of the pattern, for formats that hold several; `fd.results.frames_of` makes them from
        a result.

    Raises
    ------
    InputError
        The extension is unknown (no file is touched then), or the file cannot be written.
    """
    file, fmt = _file_and_format(path)
    if fmt.write is None:
        raise InputError(f"{file}: {fmt.name} files can be read but not written.")
    pattern = pattern_of(pattern)
    given = enumerate(listed("frames", frames, "frames"))
    frames = [of_kind(f"frames[{k}]", one, Frame) for k, one in given]
    if frames and not fmt.frames:
        able = ", ".join(end for end, each in FORMATS.items() if each.frames)
        raise InputError(f": {fmt.name} files hold one state; write {able}", "frames", file)
    warn_of_boards(pattern)
    with within("", file):
        content = fmt.write(pattern, *((frames,) if fmt.frames else ())).encode()
    try:
        write_bytes(content, file)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(
            f"{file}: cannot be written: {reason}; check that its directory exists and "
            "may be written to."
        ) from None


def _file_and_format(path: Any) -> tuple[Path, Format]:
    file = path_of(path)
    if os.path.isdir(file):
        raise InputError(f"{file}: is a directory; name a pattern file in it.")
    fmt = FORMATS.get(file.suffix.lower())
    if fmt is None:
        has = f"has the unknown extension {file.suffix!r}" if file.suffix else "has no extension"
        raise InputError(f"{file}: {has}; known ones are {', '.join(sorted(FORMATS))}.")
    return file, fmt
