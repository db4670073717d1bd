"""The page of the study of waves: an impact on a Kresling chain, and bands of sheets."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import xarray
from matplotlib.figure import Figure

from foldyn.plots import style
from foldyn.plots.space_time import drawn_cells, plot_wave_spectrum
from foldyn.report import Heading, Section, Table, Text, write_report
from foldyn.report.album import Album
from foldyn.signals import Pulse, sampling_interval, wavenumber_spectrum
from verification.waves import kresling, sheets
from verification.waves.study import FULL, Study

TITLE = "Waves in periodic origami"
STATES = 4  # number of fold states with drawn bands
FROM, TO = 0.3, 0.7  # part of the chain where the pulse is followed
SHEETS = {"miura": "Miura", "eggbox": "eggbox"}
# smallest compression before the highest tension, relative to that tension, that counts
FELT = 0.05
KEPT = 0.2  # a pulse keeps its form if height and width change by at most this share
SPEEDS = 0.01  # speeds count as equal up to this relative difference


def write(study: Study) -> Path:
    """Draw the figures of a study into its folder and write report.html; return its path."""
    album = Album(study.folder)
    hit, small = study.result("impact"), study.result("small_impact")
    lines = study.result("dispersion")
    found: list[Any] = [Text(_opening(study))]
    if lines is not None:
        found += _dispersion(album, lines, small)
    if hit is not None:
        found += _impact(album, hit, small)
    for kind in sheets.PATTERNS:
        states = study.result(kind)
        if states is not None:
            found += _sheet(album, kind, states)
    found += [Heading("What was computed"), _inputs(study)]
    return write_report(found, study.folder / "report.html", title=TITLE)


def _opening(study: Study) -> str:
    text = (
        "Two studies, repeated with Foldyn: the chain of Kresling cells of Yasuda, Miyazawa, "
        "Charalampidis, Chong, Kevrekidis and Yang (Origami-based impact mitigation via "
        "rarefaction solitary wave creation, Science Advances 5, eaau2835, 2019), and the bands of "
        "Miura and eggbox sheets of Pratapa, Suryanarayana and Paulino (Bloch wave framework for "
        "structures with nonlocal interactions, J. Mech. Phys. Solids 118, 2018).\n\n"
        "The papers' dimensions, masses and stiffnesses were not available. All parameters, in the "
        "last table, are ours: compare claims, not numbers. For the Kresling chain we searched "
        "for a case in which the rarefaction overtakes the compression: it can happen, which does "
        "not say how often. As in the papers, models are trusses and sheets whose panels do not "
        "vibrate, of which Foldyn would otherwise warn."
    )
    if study.plan != FULL:
        text += "\n\nThis is a coarse run with fewer fold states, phases and cells."
    return text


# ---------------------------------------------------------------------- the chain
def deviations(lines: xarray.Dataset, free: bool) -> tuple[float, float]:
    """Largest relative deviations of the two bands from the two-dof unit (except at phase 0)."""
    start = "free_" if free else ""
    ratio = lines[f"{start}bands"].values[1:] / lines[f"{start}two_dof"].values[1:] - 1.0
    slow, fast = np.abs(ratio).max(axis=0).tolist()
    return slow, fast


def _dispersion(
    album: Album, lines: xarray.Dataset, small: xarray.Dataset | None
) -> list[Section | Any]:
    slow, fast = deviations(lines, free=False)
    free = max(deviations(lines, free=True))
    found: list[Any] = [
        Heading("Kresling chain: small waves"),
        Text(
            "A cell between rigid plates has two degrees of freedom, elongation and twist, and the "
            "chain has the frequencies omega = 2 |sin(kappa/2)| sqrt(eig(K, M)), K the static "
            "stiffness of a cell. Without creases the chain's bands agree with this to "
            f"{100 * free:.2g} %, as the springs of its plates give way. Creases at the plates, "
            "folds between two cells, are missing in the unit: with them the slow band deviates by "
            f"up to {100 * slow:.2g} %, the fast one by {100 * fast:.2g} %."
        ),
    ]
    found += album.figure(
        "dispersion",
        "Bands of the Kresling chain and of the two-dof unit, and their difference.",
        lambda: _plot_dispersion(lines),
    )
    if small is not None:
        found += album.figure(
            "spectrum",
            "Two-dimensional spectrum of the axial velocity after a small impact, over the bands.",
            lambda: _plot_spectrum(small, lines),
        )
    return found


def _plot_dispersion(lines: xarray.Dataset) -> Figure:
    figure = style.new_figure(8.4, 3.6)
    left, right = figure.subplots(1, 2)
    style.frame(left, "phase (rad per cell)", "frequency (Hz)")
    style.frame(right, "phase (rad per cell)", "deviation from two dofs (%)")
    phase = lines["phase"].values[1:]
    keys = []
    for start, name in (("", "with creases"), ("free_", "without creases")):
        chain, unit = (lines[f"{start}{key}"].values[1:] for key in ("bands", "two_dof"))
        color = style.BLUE if name == "with creases" else style.VERMILLION
        dashed: dict[str, Any] = {"color": color, "linestyle": (0, (3, 3)), "linewidth": 1.2}
        left.semilogy(phase, chain, color=color, linewidth=0.9)
        left.semilogy(phase, unit, **dashed)
        right.plot(phase, 100.0 * (chain / unit - 1.0), color=color)
        keys += [style.key(f"chain {name}", color=color), style.key("its two-dof unit", **dashed)]
    left.set_xlim(0.0, np.pi)
    right.set_xlim(0.0, np.pi)
    return style.finish(figure, keys, columns=4)


def _plot_spectrum(small: xarray.Dataset, lines: xarray.Dataset) -> Figure:
    found = wavenumber_spectrum(small["velocity"].values, sampling_interval(small["time"].values))
    spectrum = xarray.Dataset(
        {"amplitude": (("phase", "frequency"), found.amplitude)},
        {"phase": found.phase, "frequency": found.frequency},
    )
    shown = xarray.Dataset(
        {"frequency": (("phase", "band"), lines["bands"].values)},
        {"wave_vector": (("phase", "period"), lines["phase"].values[:, None])},
    )
    return plot_wave_spectrum(spectrum, shown, max_frequency=1.15 * float(lines["bands"].max()))


def _impact(album: Album, hit: xarray.Dataset, small: xarray.Dataset | None) -> list[Any]:
    passed = kresling.overtaking(hit)
    found: list[Any] = [Heading("Kresling chain: an impact"), Text(verdict(hit, passed))]
    found += album.figure(
        "impact",
        f"Strain of the cells after an impact of {hit.attrs['velocity']:g} m/s on the first "
        "plate: compression red, tension blue.",
        lambda: drawn_cells(hit, "strain", None),
    )
    if small is not None:
        found += album.figure(
            "small-impact",
            f"The same after {1e3 * small.attrs['velocity']:.2g} mm/s, where all is linear.",
            lambda: drawn_cells(small, "strain", None),
        )
    found += album.figure(
        "arrivals",
        "Arrival and size of the highest compression and tension in each cell.",
        lambda: _plot_arrivals(passed),
    )
    slow, fast = np.asarray(hit.attrs["long_waves"]).tolist()
    middle = _middle(passed)
    rows = [
        ["rarefaction", passed.rarefaction.speed, *_of(passed.rarefaction, middle)],
        ["compression", passed.compression.speed, *_of(passed.compression, middle)],
        ["slow long waves", slow, None, None],
        ["fast long waves", fast, None, None],
    ]
    found.append(
        Table(
            ["wave", "speed (cells/s)", "peak strain", "width (ms)"],
            rows,
            "Pulses (medians over the middle of the chain) and long waves.",
            digits=3,
        )
    )
    return found


def _middle(passed: kresling.Overtaking) -> slice:
    count = len(passed.rarefaction.arrival) / kresling.UNTIL
    return slice(int(FROM * count), int(TO * count))


def _of(pulse: Pulse, cells: slice) -> tuple[float, float]:
    return (float(np.nanmedian(pulse.peak[cells])), 1e3 * float(np.nanmedian(pulse.width[cells])))


def verdict(hit: xarray.Dataset, passed: kresling.Overtaking) -> str:
    """Text on what agrees with the paper and what does not, from the numbers."""
    slow = float(np.asarray(hit.attrs["long_waves"])[0])
    rare, press = passed.rarefaction, passed.compression
    momentum = hit["momentum"].values
    lead = rare.speed / press.speed - 1.0
    middle = _middle(passed)
    tension, pressed = _of(rare, middle)[0], -_of(press, middle)[0]
    overtakes = lead > SPEEDS and passed.share > 0.5
    ahead = (
        f"agrees with the paper: the rarefaction is {100 * lead:.2g} % faster than the compression "
        f"and overtakes it at cell {passed.cell}; from there on tension peaks first in "
        f"{100 * passed.share:.0f} % of the cells"
        if overtakes
        else "does not agree with the paper: no rarefaction overtakes the compression"
    )
    return (
        "An impact gives the first plate of a free chain a velocity. Its cell is pressed and "
        "springs back: a rarefaction follows the compression. Cells soften in compression and "
        f"stiffen in tension. What happens {ahead}. It travels at {rare.speed / slow:.3g} times "
        f"the speed of slow long waves, the compression at {press.speed / slow:.3g} times. The "
        f"first cell is pressed by {100 * abs(float(hit['strain'].values[:, 0].min())):.2g} %; in "
        f"the middle of the chain the peak tension is {100 * tension:.2g} % and the peak "
        f"compression {100 * pressed:.2g} %.\n\n"
        f"{_form(rare)}\n\n"
        f"{_first(passed)}\n\n"
        f"Energy is balanced to {hit.attrs['energy_error']:.1g} of the energies at play, the "
        f"momentum along the chain changes by {np.ptp(momentum) / abs(momentum[0]):.1g} of itself."
    )


def _first(passed: kresling.Overtaking) -> str:
    """Text on whether the far part of the chain feels tension first."""
    does = "holds" if passed.before < FELT else "does not hold strictly"
    return (
        f"That the end of the chain feels tension first {does}: before it comes a compression of "
        f"{100 * passed.before:.2g} % of the highest tension (median of the last third of the "
        "judged cells), ripples and a front that the rarefaction has not yet passed."
    )


def _form(rare: Pulse) -> str:
    """Text on whether the rarefaction keeps its form, like a solitary wave."""
    count = len(rare.arrival) / kresling.UNTIL
    parts = [slice(int(a * count), int(b * count)) for a, b in ((0.3, 0.4), (0.65, 0.75))]
    (early, narrow), (late, wide) = (_of(rare, part) for part in parts)
    kept = max(abs(late / early - 1.0), abs(wide / narrow - 1.0)) < KEPT
    start = "It keeps its form, as a solitary wave does" if kept else "It does not keep its form"
    return (
        f"{start}: the peak is {100 * early:.2g} % of strain in cells {parts[0].start} to "
        f"{parts[0].stop} and {100 * late:.2g} % in cells {parts[1].start} to {parts[1].stop}, the "
        f"width {narrow:.3g} and {wide:.3g} ms."
    )


def _plot_arrivals(passed: kresling.Overtaking) -> Figure:
    labels = ["time (s)", "strain"]
    figure, (upper, lower) = style.rows((6.2, 5.0), "", "cell", labels, heights=[1.6, 1.0])
    keys = []
    for pulse, color, label in (
        (passed.compression, style.VERMILLION, "compression"),
        (passed.rarefaction, style.BLUE, "tension"),
    ):
        look = {"color": color, "marker": ".", "linestyle": "none", "label": label}
        keys += upper.plot(pulse.arrival, **look)
        lower.plot(np.abs(pulse.peak), **look)
    look = {"color": style.GRAY, "linestyle": "dashed", "linewidth": 0.9}
    upper.axvline(passed.cell, **look)
    top = np.nanquantile(np.abs(passed.compression.peak), 0.95)
    lower.set_ylim(0.0, 1.5 * top)
    return style.finish(figure, [*keys, style.key("overtaking", **look)])


# ---------------------------------------------------------------------- sheets
def _sheet(album: Album, kind: str, states: xarray.Dataset) -> list[Any]:
    found: list[Any] = [Heading(f"Bands of the {SHEETS[kind]} sheet against its fold state")]
    rows = []
    for direction in states["direction"].values.tolist():
        dihedral, bottom, top = sheets.widest(states, direction)
        open_ = np.isfinite(states["bottom"].sel(direction=direction).values).any(axis=1)
        share = f"{int(np.sum(open_))} of {states.sizes['dihedral']}"
        there = np.isfinite(bottom)
        rows.append([direction, share, *((dihedral, bottom, top) if there else [None] * 3)])
    found.append(
        Table(
            ["direction", "fold states with a gap", "widest at (degrees)", "from (Hz)", "to (Hz)"],
            rows,
            "Gaps for waves along x and for all waves of the zone; widest by width / middle.",
            digits=4,
        )
    )
    found += album.figure(
        f"{kind}-bands",
        f"Bands of the {SHEETS[kind]} sheet in some fold states (dihedral of the creases along x).",
        lambda: _plot_bands(states),
    )
    found += album.figure(
        f"{kind}-gaps",
        f"Gaps of the {SHEETS[kind]} sheet: along x (light) and in all directions (dark).",
        lambda: _plot_gaps(states),
    )
    return found


def _plot_bands(states: xarray.Dataset) -> Figure:
    count = states.sizes["dihedral"]
    chosen = np.unique(np.linspace(0, count - 1, min(STATES, count)).round().astype(int))
    figure = style.new_figure(9.0, 3.4)
    frames = figure.subplots(1, len(chosen), sharey=True, squeeze=False)[0]
    names = states.attrs["tick_labels"].replace("G", "Γ").split("-")
    for axes, k in zip(frames, chosen.tolist(), strict=True):
        first = axes is frames[0]
        dihedral = float(states["dihedral"][k])
        style.frame(axes, "", "frequency (kHz)" if first else "", f"{dihedral:.0f}°")
        values = 1e-3 * states["frequency"].values[k]
        axes.plot(states["distance"].values, values, color=style.BLUE, linewidth=1.0)
        axes.set_xticks(np.atleast_1d(states.attrs["ticks"]), names)
        axes.set_ylim(bottom=0.0)
    return style.finish(figure)


def _plot_gaps(states: xarray.Dataset) -> Figure:
    figure, axes = style.single((6.2, 3.8), "", "dihedral (degrees)", "frequency (kHz)")
    keys = []
    for direction, color in (("along x", style.SKY), ("all", style.BLUE)):
        bottom, top = (1e-3 * states[k].sel(direction=direction).values for k in ("bottom", "top"))
        for below in range(bottom.shape[1]):
            edges = states["dihedral"].values, bottom[:, below], top[:, below]
            axes.fill_between(*edges, color=color, linewidth=0.0)
            lone = {"color": color, "linestyle": "none", "marker": "_", "markersize": 3.0}
            axes.plot(edges[0], 0.5 * (edges[1] + edges[2]), **lone)
        keys.append(style.key(direction, color=color, linewidth=5.0))
    axes.set_ylim(bottom=0.0)
    return style.finish(figure, keys)


def _inputs(study: Study) -> Table:
    plan = study.plan
    rows = [[name.replace("_", " "), value] for name, value in asdict(plan.unit).items()]
    rows += [["cells of the chain", plan.cells], ["velocity of the first plate", plan.velocity]]
    sheet = sheets.PAPER
    rows += [
        ["sheets: edges of panels", sheets.EDGE],
        ["sheets: angle of panels (degrees)", 60.0],
        ["sheets: Young's modulus", sheet.youngs_modulus],
        ["sheets: thickness", sheet.thickness],
        ["sheets: density", sheet.density],
        ["sheets: length-scale ratio", sheet.length_scale_ratio],
        ["fold states", plan.dihedrals],
    ]
    return Table(["parameter", "value"], rows, "All of them ours, in SI units.", digits=5)
