"""The page of a sweep: plots of measures against parameters, the points, and failures."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from foldyn import plots
from foldyn.analyses import CaseFile
from foldyn.analyses.provenance import Call, cost_rows, inputs_table
from foldyn.errors import InputError
from foldyn.plots.sweep_charts import effect_charts, line_chart
from foldyn.report.album import Album
from foldyn.report.page import write_report
from foldyn.report.sections import Charts, Heading, Listing, Section, Table, Text, cell
from foldyn.results import sweep_dataset
from foldyn.results.sweep_dataset import POINT, is_grid, keys_of, label, measures_of

MOST_CURVES = 8
"""Most curves in a chart."""
MOST_ROWS = 1000
"""Most points in a table."""
MOST_REASONS = 50
"""Most points with missing values in a table."""
MOST_COLUMNS = 6
"""Most values of one measure in a table row."""


def write_sweep(
    sweep: xr.Dataset, folder: str | Path, case_file: CaseFile, call: Call | None = None,
    figures: str | None = None,
) -> Path:  # fmt: skip
    """Write the page of a sweep into an existing folder; return its path.

    Parameters
    ----------
    sweep : xarray.Dataset
        A result of `foldyn.sweep`.
    folder : path
    case_file : CaseFile
        The case file that was varied.
    call : Call, optional
        The command or call, for the page.
    figures : {"png", "svg", "pdf"}, optional
        File format of figures; by default none are drawn.
    """
    album = Album(folder, figures)
    sections: list[Section] = []
    for name in measures_of(sweep):
        sections += _of_measure(sweep, name, album)
    if sweep.attrs["failed"]:
        sections += [Heading("Missing values"), _failures(sweep)]
    sections += [Heading("The points"), *_points(sweep)]
    sections += [Heading("How it was computed"), inputs_table(_rows(sweep, case_file, call))]
    sections.append(Listing("The case file, with its sweep", str(sweep["case_file"].values)))
    title = f"{case_file.heading}: a sweep"
    return write_report(sections, Path(folder) / "report.html", title=title)


def _of_measure(sweep: xr.Dataset, name: str, album: Album) -> Iterator[Section]:
    """Charts or figures of a measure, and the measure's Sobol indices."""
    one = sweep[name]
    yield Heading(str(one.attrs["measure"]))
    if not np.isfinite(one.values).any():
        yield Text("Has no value at any point.")
        return
    names = sweep_dataset.parameters_of(sweep)
    own = [str(dim) for dim in one.dims if dim not in (*keys_of(sweep), POINT)]
    at = {dim: sweep[dim].values[0].item() for dim in own}
    where = "".join(f", {dim} {value}" for dim, value in at.items())
    text = f"{one.attrs['long_name']}{where}".capitalize()
    if len(names) > 1:
        if is_grid(sweep) and len(names) == 2:
            caption = f"{text}, against both parameters."
            draw = partial(plots.plot_sweep_map, sweep, name, at=at)
            yield from album.figure(f"map-{name}", caption, draw)
        caption = f"{text}: the points against each parameter, and their means."
        if is_grid(sweep):
            caption = f"{text}: mean over all other parameters, at values of one."
        draw = partial(plots.plot_main_effects, sweep, name, at=at)
        charts = Charts(effect_charts(sweep, name, at, not is_grid(sweep)), caption)
        yield from album.figure(f"effects-{name}", caption, draw, charts)
    if is_grid(sweep) and len(names) <= 2:
        by = names[1] if len(names) == 2 else (own[0] if own else None)
        kept = {dim: value for dim, value in at.items() if dim != by}
        lines = text if by not in own else str(one.attrs["long_name"]).capitalize()
        caption = f"{lines}, against {sweep[names[0]].attrs['long_name']}."
        draw = partial(plots.plot_sweep_lines, sweep, name, x=names[0], by=by, at=kept)
        charts = Charts([line_chart(sweep, name, names[0], by, kept, MOST_CURVES)], caption)
        yield from album.figure(f"lines-{name}", caption, draw, charts)
    elif len(names) == 1:
        caption = f"{text}, at all points."
        draw = partial(plots.plot_sweep_lines, sweep, name, x=names[0], at=at)
        charts = Charts(effect_charts(sweep, name, at, True), caption)
        yield from album.figure(f"lines-{name}", caption, draw, charts)
    if sweep.attrs["method"] == sweep_dataset.SALTELLI:
        yield from _indices(sweep, name, at, album, text)


def _indices(
    sweep: xr.Dataset, name: str, at: dict[str, Any], album: Album, text: str
) -> Iterator[Section]:  # fmt: skip
    try:
        found = sweep_dataset.sobol_indices(sweep, name, at=at)
    except InputError as error:
        yield Text(f"No Sobol indices: {error}")
        return
    caption = (
        f"{text}: shares of its variance that parameters explain, alone and with all their "
        f"interactions, with intervals of 95 % by the bootstrap; from {found.points} rows of the "
        "design."
    )
    header = ["parameter", "alone", "from", "to", "with interactions", "from", "to"]
    rows = [
        [word, found.first[k], *found.first_interval[k], found.total[k], *found.total_interval[k]]
        for k, word in enumerate(found.names)
    ]
    yield Table(header, rows, caption, digits=3)
    yield from album.figure(f"indices-{name}", caption, partial(plots.plot_sobol_indices, found))


def _points(sweep: xr.Dataset) -> Iterator[Section]:
    """Table of the points."""
    table = _flat(sweep)
    columns: dict[str, np.ndarray] = {}
    for name in keys_of(sweep):
        columns[label(sweep[name])] = table[name].values
    for name in measures_of(sweep):
        one = table[name]
        values = one.transpose(POINT, ...).values.reshape(one.sizes[POINT], -1)
        several = values.shape[1] > 1
        for k in range(min(values.shape[1], MOST_COLUMNS)):
            columns[label(one, f"{name} {k + 1}" if several else name)] = values[:, k]
    count = table.sizes[POINT]
    rows = [
        [cell(value) if isinstance(value, float) else value for value in row]
        for row in zip(*(column[:MOST_ROWS].tolist() for column in columns.values()), strict=True)
    ]
    more = f" The first {MOST_ROWS} of {count}." if count > MOST_ROWS else ""
    yield Table(list(columns), rows, f"What was measured at each point.{more}", digits=5)


def _flat(sweep: xr.Dataset) -> xr.Dataset:
    """The sweep with its points along a single dimension."""
    kept = sweep[[*measures_of(sweep), "failure", "seconds"]]
    return kept.stack({POINT: keys_of(sweep)}, create_index=False) if is_grid(sweep) else kept


def _failures(sweep: xr.Dataset) -> Table:
    table = _flat(sweep)
    names = keys_of(sweep)
    failed = [k for k, reason in enumerate(table["failure"].values.tolist()) if reason]
    rows = [
        [*(table[name].values[k].item() for name in names), str(table["failure"].values[k])]
        for k in failed[:MOST_REASONS]
    ]
    more = f", the first {MOST_REASONS}" if len(failed) > MOST_REASONS else ""
    caption = f"Values are missing at {len(failed)} of {sweep.attrs['points']} points{more}."
    return Table([*(label(sweep[name]) for name in names), "why"], rows, caption)


def _rows(sweep: xr.Dataset, case_file: CaseFile, call: Call | None) -> Iterator[tuple[str, str]]:
    """Facts about the computation."""
    facts = sweep.attrs
    yield "case file", str(case_file.path.name)
    yield "analysis", str(facts["kind"])
    for name in keys_of(sweep):
        values = sweep[name].values
        listed = ", ".join(str(value) for value in np.unique(values).tolist()[:12])
        if values.dtype.kind in "iuf" and len(np.unique(values)) > 12:
            listed = f"{values.min():.6g} to {values.max():.6g}"
        yield str(sweep[name].attrs["key"]), listed
    how = "all combinations of values"
    if not is_grid(sweep):
        how = f"{facts['method']}, {facts['samples']} samples, seed {facts['seed']}"
    yield "points", f"{facts['points']}, values missing at {facts['failed']} of them; {how}"
    yield "processes", str(facts["processes"])
    seconds = float(np.nansum(sweep["seconds"].values))
    yield from cost_rows(str(facts["foldyn_version"]), call or Call(), seconds)
