"""Tables of measured modes and the fitted model's modes."""

from __future__ import annotations

from typing import Any

import numpy as np

from foldyn.cases import Case
from foldyn.experiment.calibration.modal import ModalParameters, ModeShapes, resisted
from foldyn.report.sections import Table, cell


def modes_table(one: ModalParameters, result: Any, case: Case) -> Table:
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


def shapes_table(one: ModeShapes, result: Any, case: Case) -> Table:
    """Table of the similarity of measured shapes and the model's shapes."""
    place, alike = one.pairing(result, case)
    kept = resisted(result)[place]
    names, hertz = result["mode"].values[kept].tolist(), result["frequency"].values[kept].tolist()
    rows: list[list[Any]] = []
    for k, (mode, name, f) in enumerate(zip(one.mode.tolist(), names, hertz, strict=True)):
        others = np.delete(alike[k], place[k])
        rows.append([mode, name, f, float(alike[k, place[k]]), float(others.max(initial=0.0))])
    header = ["mode", "model's mode", "its frequency (Hz)", "MAC", "next best MAC"]
    return Table(header, rows, f"{one.name}: paired by their shapes")
