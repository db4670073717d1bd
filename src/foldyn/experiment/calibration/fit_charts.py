"""Charts of a fit: measurements and the fitted model."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.cases.directions import AXES
from foldyn.experiment.calibration import measured
from foldyn.experiment.calibration.histories import Spectrum, TimeHistory
from foldyn.experiment.calibration.measured import MOST, Shapes, dense_curve, picture_plane
from foldyn.experiment.calibration.measurement import Measurement
from foldyn.experiment.calibration.modal import FrequencyResponse, ModeShapes
from foldyn.plots.charts import Chart, Curve

FLOOR = 1e-300  # magnitude that represents zero in decibels


def charts_of(one: Measurement, result: xr.Dataset, case: Case) -> list[Chart]:
    """Charts of a measurement and the fitted model's result; empty if there is nothing to show."""
    if isinstance(one, measured.ForceDisplacement):
        curve = dense_curve(one)
        model = Curve("model", curve.displacement, curve.predicted(result, case))
        seen = Curve(one.label, one.displacement, one.force, True, one.sigma)
        return [Chart(f"{one.axis} displacement (m)", f"{one.axis} force (N)", [model, seen])]
    if isinstance(one, measured.Measured):
        model = Curve("model", one.load_factor, one.predicted(result, case))
        seen = Curve(one.label, one.load_factor, one.values, True, one.sigma)
        label = f"{one.measure} ({one.unit})" if one.unit else one.measure
        return [Chart("load factor", label, [model, seen])]
    if isinstance(one, Shapes):
        return _shapes(one, result, case) if len(one.axes) > 1 else []
    if isinstance(one, ModeShapes):
        return _mode_shapes(one, result, case)
    if isinstance(one, FrequencyResponse):
        return _responses(one, result, case)
    if isinstance(one, TimeHistory):
        said, seen = one.modelled(result, case), one.values - one.trend(one.values)
        said = said - one.trend(said)
        return _beside(one, one.time, "time (s)", f"{one.axis} displacement (m)", said, seen, case)
    if isinstance(one, Spectrum):
        said, label = one.modelled(result, case), f"{one.axis} amplitude (m)"
        return _beside(one, one.frequency, "frequency (Hz)", label, said, one.values, case)
    return []


def _beside(
    one: TimeHistory | Spectrum, along: NDArray, xlabel: str, ylabel: str,
    said: NDArray, seen: NDArray, case: Case,
) -> list[Chart]:  # fmt: skip
    """Charts of measured and computed histories, one for each node, with the misfit."""
    charts = []
    for k, node in enumerate(one.where(case)[:MOST].tolist()):
        curves = [Curve("model", along, said[:, k]), Curve(one.label, along, seen[:, k], True)]
        if isinstance(one, TimeHistory):
            curves.append(Curve(f"model minus {one.label}", along, said[:, k] - seen[:, k]))
        charts.append(Chart(xlabel, ylabel, curves, f"node {node}"))
    return charts


def _shapes(one: Shapes, result: xr.Dataset, case: Case) -> list[Chart]:
    """Charts of measured and computed shapes, one for each load factor."""
    model, (across, up) = one.modelled(result, case), picture_plane(one, case)
    rest = case.structure.nodes[one.where(case)][:, [AXES.index(axis) for axis in one.axes]]
    origin = rest if one.quantity == "displacement" else 0.0
    labels = f"{one.axes[across]} (m)", f"{one.axes[up]} (m)"
    steps = np.linspace(0, len(one.load_factor) - 1, min(MOST, len(one.load_factor))).astype(int)
    charts = []
    for step in steps.tolist():
        both = (("model", model[step] + origin), (one.label, one.values[step] + origin))
        curves = [Curve(name, at[:, across], at[:, up], dots=True) for name, at in both]
        charts.append(Chart(*labels, curves, f"load factor {one.load_factor[step]:.3g}"))
    return charts


def _mode_shapes(one: ModeShapes, result: xr.Dataset, case: Case) -> list[Chart]:
    """Measured against predicted components of mode shapes, a chart for each mode."""
    model = one.modelled(result, case)
    charts = []
    for mode, seen, said in zip(one.mode[:MOST].tolist(), one.values, model, strict=False):
        known = np.isfinite(seen)
        ends = np.array([said[known].min(), said[known].max()])
        dots = Curve(one.label, said[known], seen[known], True, one.sigma)
        curves = [Curve("equal", ends, ends), dots]
        charts.append(Chart("component, model", f"component, {one.label}", curves, f"mode {mode}"))
    return charts


def _responses(one: FrequencyResponse, result: xr.Dataset, case: Case) -> list[Chart]:
    """Magnitude of responses for each node and, if measured, phase."""
    model = one.modelled(result, case)
    labels = [f"{one.axis} (dB{f' re 1 {one.unit}' if one.unit else ''})", "phase (degrees)"]
    parts = [(_decibels(model), _decibels(one.values))]
    if not one.magnitude:
        phase = np.degrees(np.angle(model))
        # avoids jumps by 360 degrees
        parts.append((phase, phase + np.degrees(np.angle(one.values * model.conj()))))
    return [
        Chart(
            "frequency (Hz)",
            label,
            [Curve("model", one.frequency, said[:, k]),
             Curve(one.label, one.frequency, seen[:, k], dots=True)],
            f"node {node}, {one.quantity}",
        )
        for k, node in enumerate(one.where(case)[:MOST].tolist())
        for label, (said, seen) in zip(labels, parts, strict=False)
    ]  # fmt: skip


def _decibels(values: NDArray) -> NDArray[np.float64]:
    return 20.0 * np.log10(np.maximum(np.abs(values), FLOOR))
