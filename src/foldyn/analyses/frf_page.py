"""Figures and the page of frequency responses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import xarray

from foldyn import plots
from foldyn.analyses.casefile import CaseFile
from foldyn.cases import BaseMotion, Case
from foldyn.linear import Peak, peaks_of
from foldyn.linear.frf import METHODS, PER_FORCE, quantity_of
from foldyn.plots.charts import Chart, Curve
from foldyn.report.album import Album, ByRule, by_mass_rule, listed, rules, shown_nodes
from foldyn.report.charts import Charts
from foldyn.report.sections import Heading, Section, Table, Text, cell

MOST_CURVES = 8
"""Responses that one figure shows at most, each in its color."""
MOST_REASONS = 6
"""Peaks for which the page explains missing numbers, at most."""


def frf_sections(case_file: CaseFile, results: ByRule, album: Album) -> Iterator[Section]:
    """See `Analysis.sections`."""
    first = next(iter(results))
    case, response = case_file.case(first), results[first]
    drive = case_file.analysis.arguments["drive"]
    most = max(1, MOST_CURVES // len(results))
    nodes, some = shown_nodes(case_file.output.nodes.tolist(), most)
    axis = case_file.output.axis or driven_direction(response)
    quantity = case_file.output.quantity or quantity_of(response)
    shown = quantity if quantity in PER_FORCE else None
    parts = "Magnitude, phase and coherence" if "coherence" in response else "Magnitude and phase"
    yield from album.structure(
        _driven(case, drive), "The pattern with its nodes, supports and drive."
    )
    yield Heading("The response")
    yield from album.figure(
        "response",
        f"{parts} of the {quantity} of {listed('node', nodes)}{some} along {axis}, "
        f"{rules(results)}: {_meaning(quantity, axis, response)}. Dots mark peaks.",
        lambda: plots.plot_frf(results, nodes, axes=axis, quantity=shown),
        *_coherence(results, nodes, axis),
    )
    peaks = {
        (rule, node): peaks_of(result, node, axis=axis, quantity=shown)
        for rule, result in results.items()
        for node in nodes
    }
    if shown is not None and any(np.isfinite(p.damping_ratio) for p in peaks[first, nodes[0]]):
        rule = f" with mass rule {first}" if len(results) > 1 else ""
        yield from album.figure(
            "nyquist",
            f"Mobility of node {nodes[0]} along {axis}{rule} around its peaks, in the complex "
            "plane: a mode makes a circle, from which its natural frequency and damping are "
            "found. Points that leave the circle show what other modes or nonlinearity add.",
            lambda: plots.plot_nyquist(response, nodes[0], axis=axis, peaks=peaks[first, nodes[0]]),
        )
    yield Heading("The numbers")
    yield _peaks(peaks, quantity, axis, len(results) > 1)
    yield _run(case_file, results)
    yield Text(_notes(response, case, peaks))


def _coherence(results: ByRule, nodes: list[int], axis: str) -> list[Section]:
    """Coherence of responses that were estimated, for a page without figures."""
    curves = [
        Curve(
            f"node {node}" if len(results) == 1 else f"node {node}, {rule}",
            response["frequency"].values,
            response["coherence"].sel(node=node, axis=axis[-1]).values,
        )
        for rule, response in results.items()
        if "coherence" in response
        for node in nodes
    ]
    if not curves:
        return []
    chart = Chart("frequency (Hz)", "coherence", curves)
    return [Charts([chart], f"Coherence of the motion along {axis} with the drive.")]


def driven_direction(response: xarray.Dataset) -> str:
    """Direction in which most of the drive acts."""
    from foldyn.plots.readings import along_drive

    drive = response["drive"].transpose("node", "axis").values
    return along_drive(response)[int(np.abs(drive).sum(axis=0).argmax())]


def _driven(case: Case, drive: list[Any]) -> Case:
    """The case with its drive, for the picture of the structure."""
    bases = [part for part in drive if isinstance(part, BaseMotion)]
    forces = [part for part in drive if not isinstance(part, BaseMotion)]
    return replace(case, supports=[*case.supports, *bases], loads=[*case.loads, *forces])


def _meaning(quantity: str, axis: str, response: xarray.Dataset) -> str:
    """What the quantity is, in words."""
    if quantity == "transmissibility":
        base = response.attrs["base_axis"]
        return f"displacement along {axis} per displacement of the base along {base}"
    motion = {"receptance": "displacement", "mobility": "velocity", "accelerance": "acceleration"}
    return f"{motion[quantity]} per newton of driving force, on all driven nodes together"


def _peaks(
    peaks: Mapping[tuple[str, int], tuple[Peak, ...]], quantity: str, axis: str, several: bool
) -> Table:
    from foldyn.plots.readings import unit_of

    header = [*(["mass rule"] if several else []), "node", "peak (Hz)"]
    header += [f"height{unit_of(quantity)}", "3 dB (%)", "textbook (%)"]
    header += ["f0 (Hz)", "circle (%)", "misfit (%)"]
    rows = [
        [
            *([rule] if several else []), node, peak.frequency, peak.height,
            _percent(peak.half_power), _percent(peak.textbook), cell(peak.natural_frequency),
            _percent(peak.damping_ratio), _percent(peak.misfit),
        ]
        for (rule, node), found in peaks.items() for peak in found
    ]  # fmt: skip
    return Table(
        header,
        rows,
        f"Peaks of the {quantity} along {axis} and the damping ratios they give: from the "
        "half-power points (3 dB: exact for a single mode; textbook: (f2 - f1) / 2f), and from "
        "fitted circles, with the natural frequency f0 and how far points lie off the circle",
        digits=4,
    )


def _run(case_file: CaseFile, results: ByRule) -> Table:
    keys = {
        "secant": "secant (degrees)",
        "internal": "internal amplitudes",
        "modes": "modes",
        "amplitude": "amplitude",
        "pulse": "pulse (s)",
        "record": "record (s)",
        "interval": "sampling (s)",
        "averages": "averages",
        "seed": "seed",
        "estimator": "estimator",
        "sweep": "sweep",
        "cycles_in_all": "cycles",
        "window_rate": "window (1/s)",
    }
    a = next(iter(results.values())).attrs
    if not METHODS[a["method"]].by_amplitude:
        del keys["amplitude"]
    columns = {"method": "method", "state": "state"}
    columns |= {title: key for key, title in keys.items() if key in a}
    columns["time (s)"] = "wall_seconds"
    return by_mass_rule(results, columns, f"{case_file.path.name}: the computation")


def _notes(
    response: xarray.Dataset, case: Case, peaks: Mapping[tuple[str, int], tuple[Peak, ...]]
) -> str:
    """Notes on the numbers."""
    notes = [
        f"Damping: alpha {case.rayleigh.alpha:g} 1/s, beta {case.rayleigh.beta:g} s. The result "
        "carries its own case."
    ]
    soft = int(response.attrs.get("soft", 0))
    if soft:
        notes.append(
            f"{soft} hinges of the superlinear law stand at their rest angle, where their slope "
            "vanishes: they count without stiffness here. Responses of finite amplitude, by a "
            "secant amplitude or computed in time, have it."
        )
    if "secant" in response.attrs:
        notes.append(
            "Superlinear hinges have the slope that is equivalent to an oscillation by "
            f"{response.attrs['secant']:g} degrees."
        )
    swing = response["swing"].values if "swing" in response else np.zeros(1)
    if (swing > 0.0).any():  # else no hinge is superlinear
        at = int(np.nanargmax(swing)) if np.isfinite(swing).any() else 0
        notes.append(
            "Each superlinear hinge is linearized for its own amplitude: the largest is "
            f"{np.degrees(swing[at]):.3g} degrees, at {response['frequency'].values[at]:.4g} Hz."
        )
    missing = [
        f"Peak at {peak.frequency:.4g} Hz of node {node}, {rule}: {_reason(peak.note)}."
        for (rule, node), found in peaks.items()
        for peak in found
        if peak.note
    ]
    if missing:
        notes.append("Why numbers are missing from the table:")
        notes += missing[:MOST_REASONS]
        if len(missing) > MOST_REASONS:
            notes.append(f"And {len(missing) - MOST_REASONS} more.")
    return "\n\n".join(notes)


def _reason(note: str) -> str:
    """A note without its advice to programmers."""
    parts = [part for part in note.split("; ") if part.startswith(("half power", "circle fit"))]
    return "; ".join(parts or [note]).replace("magnitude: ", "")


def _percent(ratio: float) -> float | None:
    return float(f"{100.0 * ratio:.3g}") if np.isfinite(ratio) else None
