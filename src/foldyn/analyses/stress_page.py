"""Stresses on the pages of paths and motions: figures, and where they and the margins are worst."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import xarray

from foldyn import plots
from foldyn.linear.margins import margins, place_in
from foldyn.linear.stresses import ALONG
from foldyn.report.album import Album
from foldyn.report.sections import Heading, Section, Table, Text, cell
from foldyn.results import case_of

FILES = ("stresses", "crease-moments")
"""Figures of these sections."""


def stress_sections(result: xarray.Dataset, album: Album) -> Iterator[Section]:
    """Figures and a table of the stresses of a path or a motion."""
    found, pattern = album.stresses(result), case_of(result).structure.pattern
    yield Heading("Does it hold?")
    if "von_mises" in found:
        yield from album.figure(
            FILES[0],
            "Largest von Mises stress of each panel, at either face, in the state in which it is "
            "largest.",
            lambda: plots.draw_stresses(found, "von_mises"),
        )
    if len(pattern.creases):
        yield from album.figure(
            FILES[1],
            "Moment of each crease per length, in the state in which it is largest.",
            lambda: plots.draw_stresses(found, "crease_moment"),
        )
    yield _table(found)
    yield Text(
        "Stresses are elastic, at the centers of panels, the middles of their edges and one "
        "thickness away from their corners. Creases turn by what the panels beside them leave."
    )


def _table(found: xarray.Dataset) -> Table:
    """The largest values, with the least margin of the panels if their strength is known."""
    along, rows = ALONG[found.attrs["of"]][1], []
    if "von_mises" in found:
        stress = found["von_mises"].values
        step, point, _ = np.unravel_index(stress.argmax(), stress.shape)
        when, where = cell(float(found[along][step])), place_in(found, point)
        rows.append(["von Mises stress (Pa)", cell(float(stress.max())), where, when])
    moment = np.abs(found["crease_moment"].values)
    if moment.size:
        step, crease = np.unravel_index(moment.argmax(), moment.shape)
        when = cell(float(found[along][step]))
        rows.append(["moment of a crease (N)", cell(float(moment.max())), f"crease {crease}", when])
    if "von_mises" in found and case_of(found).structure.sheet.has_strength:
        margin = margins(found).attrs
        least = cell(margin["least_margin"])
        rows.append(["least margin of a panel", least, margin["least_where"], ""])
    state = "time (s)" if along == "time" else "load factor"
    return Table(["", "largest", "where", state], rows, "Stresses, moments and margins.")
