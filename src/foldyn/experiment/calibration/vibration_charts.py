"""What the page of a fit shows of modes and frequency responses beside the model."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.experiment.calibration.measured import MOST
from foldyn.experiment.calibration.modal import ModalParameters, ModeShapes, resisted
from foldyn.experiment.calibration.responses import FrequencyResponse
from foldyn.report.charts import Chart, Curve
from foldyn.report.sections import Table, cell

FLOOR = 1e-300
"""Magnitude that stands for zero in decibels."""


def modes_table(one: ModalParameters, result: Any, case: Case) -> Table:
    """Measured numbers of modes beside those of the model."""
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


def shapes_table(one: ModeShapes, result: Any, case: Case) -> Table:
    """How alike measured shapes and those of the model are."""
    place, alike = one.pairing(result, case)
    kept = resisted(result)[place]
    names, hertz = result["mode"].values[kept].tolist(), result["frequency"].values[kept].tolist()
    rows: list[list[Any]] = []
    for k, (mode, name, f) in enumerate(zip(one.mode.tolist(), names, hertz, strict=True)):
        others = np.delete(alike[k], place[k])
        rows.append([mode, name, f, float(alike[k, place[k]]), float(others.max(initial=0.0))])
    header = ["mode", "model's mode", "its frequency (Hz)", "MAC", "next best MAC"]
    return Table(header, rows, f"{one.name}: paired by their shapes")


def shape_charts(one: ModeShapes, result: Any, case: Case) -> list[Chart]:
    """Components of measured shapes over those of the model, a chart for each mode."""
    model = one.shapes(result, case)
    charts = []
    for mode, seen, said in zip(one.mode[:MOST].tolist(), one.values, model, strict=False):
        known = np.isfinite(seen)
        ends = np.array([said[known].min(), said[known].max()])
        curves = [Curve("equal", ends, ends), Curve(one.label, said[known], seen[known], dots=True)]
        charts.append(Chart("component, model", f"component, {one.label}", curves, f"mode {mode}"))
    return charts


def response_charts(one: FrequencyResponse, result: Any, case: Case) -> list[Chart]:
    """Magnitude and, where it was measured, phase of responses, for each node."""
    model, nodes = one.curves(result, case), one.where(case).tolist()
    level = f"{one.axis} (dB{f' re 1 {one.unit}' if one.unit else ''})"
    charts = []
    for k, node in enumerate(nodes[:MOST]):
        charts.append(_beside(one, level, k, node, _decibels(model), _decibels(one.values)))
        if not one.magnitude:
            phase = np.degrees(np.angle(model))
            near = phase + np.degrees(np.angle(one.values * model.conj()))  # no jumps by a turn
            charts.append(_beside(one, "phase (degrees)", k, node, phase, near))
    return charts


def _beside(
    one: FrequencyResponse, ylabel: str, k: int, node: int, model: NDArray, seen: NDArray
) -> Chart:
    curves = [
        Curve("model", one.frequency, model[:, k]),
        Curve(one.label, one.frequency, seen[:, k], dots=True),
    ]
    return Chart("frequency (Hz)", ylabel, curves, f"node {node}, {one.quantity}")


def _decibels(values: NDArray) -> NDArray[np.float64]:
    return 20.0 * np.log10(np.maximum(np.abs(values), FLOOR))
