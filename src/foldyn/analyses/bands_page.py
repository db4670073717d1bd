"""Figures and the page of bands."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
import xarray

from foldyn import plots
from foldyn.report.album import Album, ByRule, by_mass_rule
from foldyn.report.sections import Heading, Section, Table, Text

MOST_GAPS = 200
"""Gaps that the table of the page lists at most."""
NUMBERS = ("gap_below", "gap_bottom", "gap_top", "gap_width", "gap_relative_width")


def bands_sections(case_file: Any, results: ByRule, album: Album) -> Iterator[Section]:
    """See `Analysis.sections`."""
    first = next(iter(results))
    result = results[first]
    yield from album.structure(case_file.case(first), "A cell with its nodes and supports.")
    yield Heading("The bands")
    for k in range(result.sizes.get("state", 1)):
        shown = result.isel(state=k) if "state" in result.dims else result
        of = f", {state_text(result, k)}" if "state" in result.dims else ""
        yield from album.figure(
            "bands" if k == 0 else f"bands-{k + 1}",
            f"Frequencies of Bloch waves along the path of the Brillouin zone{of}, mass rule "
            f"{first}. Full gaps are gray; the color is the share of motion along z.",
            partial(plots.plot_bands, shown),
        )
    yield Heading("The numbers")
    yield _gaps(results)
    yield by_mass_rule(
        results,
        {"bands": lambda r: r.sizes["band"], "wave vectors": lambda r: r.sizes["phase"],
         "states": lambda r: r.sizes.get("state", 1), "time (s)": "wall_seconds"},
        f"{case_file.path.name}: the computation",
    )  # fmt: skip
    yield Text(_notes(result))


def state_text(result: xarray.Dataset, k: int) -> str:
    """What the key that varies is in a state: "dihedral 80 degrees"."""
    about = result["state"].attrs
    unit = f" {about['units']}" if "units" in about else ""
    return f"{about['long_name']} {result['state'].values[k]:g}{unit}"


def _gaps(results: ByRule) -> Table:
    several, by_state = len(results) > 1, False
    rows = []
    for rule, result in results.items():
        by_state = "state" in result.dims
        named = result[["gap_direction", *NUMBERS]]
        for k in range(named.sizes["gap"]):
            row = [named[name].values[k].item() for name in ("gap_direction", *NUMBERS)]
            where = [result["state"].values[int(result["gap_state"][k])]] if by_state else []
            rows.append([*([rule] if several else []), *where, *row])
    more = f"; the first {MOST_GAPS} of {len(rows)}" if len(rows) > MOST_GAPS else ""
    header = [*(["mass rule"] if several else []), *(["state"] if by_state else [])]
    header += ["direction", "below", "bottom (Hz)", "top (Hz)", "width (Hz)", "width / middle"]
    caption = (
        "Gaps between bands in the order of frequency: full ones, and those along one leg of the "
        f"path alone. Below: number of the band below the gap{more}"
    )
    if not rows:
        return Table(header, [], "No gaps between these bands")
    return Table(header, rows[:MOST_GAPS], caption)


def _notes(result: xarray.Dataset) -> str:
    """Notes on the numbers."""
    notes = [
        "Bands are small vibrations of a sheet of cells without end, as waves with a phase k per "
        "period: R cells away, nodes move as the Bloch mode times exp(i k R). The result carries "
        "the case of its cell. Curves follow the shapes of waves through crossings; gaps count "
        "bands in the order of frequency."
    ]
    if "damped_ratio" in result:
        notes.append(
            "Bands and gaps are those without damping; damping ratios are of the waves with it, in "
            "the order of their frequencies."
        )
    if "zone_frequency" not in result and result.sizes["period"] > 1:
        notes.append(
            "Full gaps are those at all wave vectors of the path. The greatest and least "
            "frequencies of bands may lie beside it: analysis.zone computes the whole zone."
        )
    residual = float(np.max(result["residual"].values))
    if residual > 1e-6:
        notes.append(
            f"A state is no equilibrium: its residual is {residual:.2g} of the forces at play."
        )
    return "\n\n".join(notes)
