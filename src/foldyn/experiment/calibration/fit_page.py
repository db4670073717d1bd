"""The page of `foldyn fit`: the fitted model in motion, data against model, the parameters."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from foldyn.analyses import CaseFile
from foldyn.analyses.provenance import Call, computed, inputs, inputs_table
from foldyn.cases import Case
from foldyn.experiment.calibration import modal
from foldyn.experiment.calibration.fit_charts import charts_of
from foldyn.experiment.calibration.fitted import Fit
from foldyn.experiment.calibration.histories import Spectrum, TimeHistory
from foldyn.experiment.calibration.measured import MOST, ForceDisplacement, dense_curve
from foldyn.experiment.calibration.measurement import AtNodes, Measurement
from foldyn.experiment.calibration.modal import FrequencyResponse
from foldyn.report.album import Album
from foldyn.report.page import write_report
from foldyn.report.sections import Charts, Heading, Listing, Section, Table, Text, cell
from foldyn.viewer import Stage, stage


@dataclass(frozen=True, eq=False)
class _Run:
    """A run of the fitted model for some of the measurements."""

    members: tuple[int, ...]
    case_file: CaseFile
    result: xr.Dataset
    name: str


def write_fit(
    fit: Fit, folder: str | Path, title: str = "", note: str = "", call: Call | None = None,
    figures: str | None = None,
) -> Path:  # fmt: skip
    """Write the page of a fit into an existing folder; return its path.

    Parameters
    ----------
    fit : Fit
    folder : path
    title : str
    note : str
        Text written on every figure.
    call : Call, optional
        The command or call, for the page.
    figures : {"png", "svg", "pdf"}, optional
        File format of figures; by default none are drawn.
    """
    folder = Path(folder)
    album, runs = Album(folder, figures), _runs(fit)
    title = title or f"Fit of {fit.problem.path.stem}"
    sections: list[Section | Stage] = [*_stages(fit, runs, title)]
    sections += [Heading("Parameters"), _parameters(fit), Text(_quality(fit))]
    if len(fit.estimates) > 1:
        caption = (
            "Correlation of the parameters: where it is near 1 or -1, the data hardly tell two of "
            "them apart, and their intervals are long in one direction."
        )
        draw = partial(_draw, "plot_correlation", fit, note)
        sections += album.figure("correlation", caption, draw, _correlation(fit, caption))
    if not all(one.determined for one in fit.estimates):
        sections.append(Text(_blind(fit)))
    sections += [Heading("Measured and model"), _scores(fit)]
    for i, one in enumerate(fit.problem.measurements):
        run = next(run for run in runs if i in run.members)
        model = run.result, run.case_file.case()
        charts = charts_of(one, *model)
        if charts:
            shown = Charts(charts, _caption(one))
            draw = partial(_draw, "plot_measured", one, *model, note)
            sections += album.figure(f"data-{i}", _caption(one), draw, shown)
        if isinstance(one, modal.ModalParameters):
            sections.append(modes_table(one, *model))
        elif isinstance(one, modal.ModeShapes):
            sections.append(shapes_table(one, *model))
    sections += [Heading("The search"), _searches(fit), *_provenance(fit, runs, call or Call())]
    return write_report(sections, folder / "report.html", title=title)


def _runs(fit: Fit) -> list[_Run]:
    """All runs of the fitted model."""
    values, runs = [*fit.values.values()], []
    for run in fit.problem.runs:
        members = [fit.problem.measurements[i] for i in run.members]
        forces = [dense_curve(one) for one in members if isinstance(one, ForceDisplacement)]
        result = fit.problem.result(run, values, [*members, *forces])
        names = ", ".join(one.name for one in members)
        runs.append(_Run(run.members, fit.problem.case_file(run, values), result, names))
    return runs


def _stages(fit: Fit, runs: Sequence[_Run], title: str) -> Iterator[Stage]:
    """Stages of the fitted model: one with all paths in step, one with all motions in step."""
    for kind in dict.fromkeys(run.case_file.analysis.kind for run in runs):
        own = {run.name: run for run in runs if run.case_file.analysis.kind == kind}
        results = {name: run.result for name, run in own.items()}
        cases = {name: run.case_file.case() for name, run in own.items()}
        yield stage(results, cases, title, _nodes(fit, own.values()))


def _nodes(fit: Fit, runs: Iterable[_Run]) -> list[int]:
    """Measured nodes of the first run that has any; otherwise the case file's output nodes."""
    for run in runs:
        for one in (fit.problem.measurements[i] for i in run.members):
            if isinstance(one, AtNodes):
                return one.where(run.case_file.case()).tolist()
    return next(iter(runs)).case_file.output.nodes.tolist()


def _provenance(fit: Fit, runs: Sequence[_Run], call: Call) -> list[Section]:
    """How each run was computed at the fitted values."""
    sections: list[Section] = [Heading("How it was computed")]
    for run in runs:
        if len(runs) > 1:
            sections.append(Heading(run.name, level=3))
        case = run.case_file.case()
        found = {run.case_file.masses[0]: run.result}
        sections.append(inputs_table(inputs(run.case_file, case, found)))
    sections.append(inputs_table(computed({run.name: run.result for run in runs}, call)))
    for path in dict.fromkeys([fit.problem.path, *(run.case_file.path for run in runs)]):
        sections.append(Listing(f"The case file {path.name}", path.read_text("utf-8")))
    return sections


def _correlation(fit: Fit, caption: str) -> Table:
    keys = [key.rsplit(".", 1)[-1] for key in fit.values]
    rows = [[key, *map(cell, row)] for key, row in zip(keys, fit.correlation, strict=True)]
    return Table(["", *keys], rows, caption, digits=3, sorts=False)


def _parameters(fit: Fit) -> Table:
    percent = f"{100.0 * fit.confidence:g} %"
    rows = [
        [one.key, one.value, *(cell(v) for v in (one.standard_error, one.lower, one.upper)),
         cell(one.discretization or math.nan), one.note] for one in fit.estimates
    ]  # fmt: skip
    changes = fit.problem.space.changes([*fit.values.values()])
    for tie in fit.problem.space.ties:
        rows.append([tie.key, changes[tie.key], *4 * [None], f"= {tie.expression}"])
    header = ["parameter", "value", "standard error", f"{percent} from", "to", "finer steps", ""]
    return Table(header, rows, f"Parameters in the units of the case file. {fit.quality}", digits=5)


def _quality(fit: Fit) -> str:
    text = (
        f"The intervals are from the Jacobian at the optimum and Student's t with {fit.freedom} "
        "degrees of freedom; they hold if the model is right and its errors are random."
    )
    if any(one.discretization for one in fit.estimates):
        text += (
            " Finer steps: how far ever smaller time steps and, of a shell, elements would move "
            "the value, estimated from one more computation with half of them; the interval "
            "reaches that far beyond the noise."
        )
    return text


def _blind(fit: Fit) -> str:
    weak = [one.key for one in fit.estimates if not one.determined and not one.at_bound]
    lines = []
    for value, row in zip(fit.singular_values, fit.directions, strict=True):
        parts = [f"{part:+.2f} {key}" for part, key in zip(row, fit.values, strict=True)
                 if abs(part) > 0.1]  # fmt: skip
        if parts:
            lines.append(f"{value:.3g}: {', '.join(parts)}")
    return (
        f"The data do not determine {' and '.join(weak)}: other values fit as well. Measure "
        "something that depends on them, or fix them at values known from elsewhere. Singular "
        "values, each with its change of the parameters (in their scales): "
        f"{'; '.join(lines)}."
    )


def _scores(fit: Fit) -> Table:
    rows = [
        [s.name, s.held_out, s.count, s.rms, s.unit, 100.0 * s.relative, cell(s.sigmas)]
        for s in fit.scores
    ]
    header = ["measurement", "held out", "values", "rms misfit", "unit", "of its variation (%)",
              "in sigma"]  # fmt: skip
    return Table(header, rows, digits=3)


def _searches(fit: Fit) -> Table:
    keys = [key.rsplit(".", 1)[-1] for key in fit.values]
    rows = [
        [*one.guess, *one.values, cell(one.cost), one.evaluations, one.message]
        for one in fit.descents
    ]
    header = [*(f"{key}, guess" for key in keys), *(f"{key}, end" for key in keys),
              "cost", "steps", "why it ended"]  # fmt: skip
    text = f"{fit.evaluations} evaluations of the model in all."
    if fit.quotients:
        text += f" Derivatives of {', '.join(fit.quotients)} are quotients of whole runs."
    if len(rows) > 1:
        text = f"{fit.agreeing} of {len(rows)} searches ended at the smallest cost. {text}"
    return Table(header, rows, text)


def _caption(one: Measurement) -> str:
    text = f"{one.name}: {one.label} and model."
    if isinstance(one, TimeHistory | Spectrum | FrequencyResponse) and one.values.shape[1] > MOST:
        text += f" The first {MOST} of {one.values.shape[1]} nodes."
    return f"{text} Held out: the fit did not use it." if one.held_out else text


def _draw(name: str, *arguments: Any) -> Any:
    """Draw a figure; pages without figures do not import matplotlib."""
    from foldyn.experiment.calibration import fit_figures

    return getattr(fit_figures, name)(*arguments)


def modes_table(one: modal.ModalParameters, result: xr.Dataset, case: Case) -> Table:
    """Table of measured values per mode and the model's values."""
    places, measured = one.places(result, case), one.observed()
    model = result[one.quantity].values[places]
    errors = one.errors() if one.sigma is not None else np.full(len(measured), np.nan)
    header = ["mode", "model's mode", "measured", "sigma", "model", "model off by (%)",
              "in sigma"]  # fmt: skip
    if one.unit:
        header[2:5] = [f"{title} ({one.unit})" for title in header[2:5]]
    names = result["mode"].values[places].tolist()
    differences = 100.0 * (model - measured) / np.where(measured == 0.0, np.nan, measured)
    columns = measured, errors, model, differences, (model - measured) / errors
    rows: list[list[Any]] = [
        [int(mode), name, *map(cell, values)]
        for mode, name, *values in zip(one.mode, names, *columns, strict=True)
    ]
    if one.shapes is None:
        return Table(header, rows, f"{one.name}: paired in their order")
    place, alike = one.shapes.pairing(result, case)
    for row, value in zip(rows, alike[np.arange(len(place)), place], strict=True):
        row.append(float(value))
    return Table([*header, "MAC"], rows, f"{one.name}: paired by their shapes (MAC)")


def shapes_table(one: modal.ModeShapes, result: xr.Dataset, case: Case) -> Table:
    """Table of the similarity of measured shapes and the model's shapes."""
    place, alike = one.pairing(result, case)
    kept = modal.resisted(result)[place]
    names, hertz = result["mode"].values[kept].tolist(), result["frequency"].values[kept].tolist()
    rows: list[list[Any]] = []
    for k, (mode, name, f) in enumerate(zip(one.mode.tolist(), names, hertz, strict=True)):
        others = np.delete(alike[k], place[k])
        rows.append([mode, name, f, float(alike[k, place[k]]), float(others.max(initial=0.0))])
    header = ["mode", "model's mode", "its frequency (Hz)", "MAC", "next best MAC"]
    return Table(header, rows, f"{one.name}: paired by their shapes")
