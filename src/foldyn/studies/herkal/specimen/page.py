"""Sections of the study's page on the specimen, with figures of the film and of the model."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from foldyn import plots
from foldyn.linear import character
from foldyn.plots import style
from foldyn.plots.chart_figures import figure_of
from foldyn.plots.charts import Chart, Curve
from foldyn.report import Heading, Picture, Section, Table, Text
from foldyn.report.album import Album
from foldyn.report.sections import cell
from foldyn.results import case_of, load, netcdf
from foldyn.signals import sampling_interval
from foldyn.studies.herkal.calibration import BAND, DAMPING, FOLDS, WATCHED
from foldyn.studies.herkal.specimen import evaluation, synthetic, tasks
from foldyn.studies.herkal.specimen.evaluation import CORNER, FILM_SUPPORT, corner_peaks
from foldyn.studies.herkal.specimen.measured import Data
from foldyn.studies.herkal.specimen.tasks import Part
from foldyn.studies.herkal.targets import Target, read_targets

WIDTH = 9.0  # inches
HIGHEST = 25.0  # Hz, end of the spectra shown
ORDINALS = ("first", "second", "third")
COLUMNS = 3  # number of front nodes in a row of the pattern
SUPPORT_NAMES = {
    "glued": "plate, node 59 glued",
    "plate": "plate alone (ideal)",
    "glue alone": "node 59 alone",
}


def plot_front(
    front: xr.Dataset, support: str, label: str, note: str, spectra: bool = False
) -> Figure:
    """Draw all front nodes of the film and of the model, a frame for each: histories or spectra."""
    along = front["time"].values
    curves: dict[int, tuple[NDArray, NDArray, NDArray]] = {}
    for node in front["node"].values.tolist():
        film = front["whole" if spectra else "measured"].sel(node=node).values
        model = front["model"].sel(node=node, support=support).values
        if not spectra:
            curves[node] = along, film, model
            continue
        there, said = (evaluation.content(x, sampling_interval(along)) for x in (film, model))
        if there is not None and said is not None:
            curves[node] = *there, said[1]
    labels = "frequency (Hz)" if spectra else "time (s)", "x (mm)"
    charts = []
    for node, (along, film, model) in curves.items():
        both = Curve("model", along, 1e3 * model), Curve(label, along, 1e3 * film, dots=True)
        charts.append(Chart(*labels, both, f"node {node}"))
    size = WIDTH, 0.8 + 1.15 * -(-len(charts) // COLUMNS)
    return figure_of(charts, size, note, COLUMNS, sharex=True, sharey="row")


def plot_supports(front: xr.Dataset, label: str, note: str) -> Figure:
    """Draw motion and spectrum of the watched node in the film and with each support."""
    one, time = front.sel(node=WATCHED), front["time"].values
    motions, spectra = [], []

    def add(name: str, moved: NDArray, whole: NDArray, dots: bool = False) -> None:
        motions.append(Curve(name, time, 1e3 * moved, dots))
        found = evaluation.content(whole, sampling_interval(time))
        if found is not None:
            shown = found[0] <= HIGHEST
            spectra.append(Curve(name, found[0][shown], 1e3 * found[1][shown], dots))

    for support, name in SUPPORT_NAMES.items():
        model = one["model"].sel(support=support).values
        add(f"model: {name}", model, model)
    add(label, one["measured"].values, one["whole"].values, dots=True)
    charts = [
        Chart("time (s)", "x displacement (mm)", motions, f"node {WATCHED}"),
        Chart("frequency (Hz)", "x amplitude (mm)", spectra),
    ]
    return figure_of(charts, (WIDTH, 3.6), note, 2, 4)


def plot_responses(
    responses: Mapping[str, xr.Dataset], peaks: Sequence[float], note: str
) -> Figure:
    """Draw the magnitude of responses of a corner of the top along x, and the paper's peaks."""
    labels = "frequency (Hz)", "receptance (mm/N)", f"node {CORNER} along x"
    figure, axes = style.single((7.0, 3.8), note, *labels)
    for k, (name, found) in enumerate(responses.items()):
        size = 1e3 * np.abs(found["receptance"].sel(node=CORNER, axis="x").values)
        axes.plot(found["frequency"].values, size, **style.line_style(k), label=name)
        spots = [peak.frequency for peak in corner_peaks(found)]
        heights = np.interp(spots, found["frequency"].values, size)
        axes.plot(spots, heights, "o", color=style.CYCLE[k], markersize=4)
    for k, frequency in enumerate(peaks):
        name = "peaks of the paper" if k == 0 else None
        axes.axvline(frequency, color=style.GRAY, linestyle=(0, (1, 1.5)), label=name)
    axes.margins(x=0.0)
    axes.set_ylim(bottom=0.0)
    style.legend_below(figure, axes.get_legend_handles_labels()[0], columns=3)
    return style.finish(figure)


TITLE = "The paper specimen: from photographs and a film to a calibrated model"
NO_BREAK = "\N{NO-BREAK SPACE}"
ALONE = "glue alone"
POOR = 0.3  # misfit, relative to the data, above which a fit is rejected
SYMBOLS = {
    "sheet.length_scale_ratio": "length-scale ratio",
    "model.fold_law.theta1": "theta1 (degrees)",
    "damping.alpha": "alpha (1/s)",
    "damping.beta": "beta (s)",
}


def sections(folder: Path, parts: Sequence[Part], album: Album) -> list[Section]:
    """Sections on the computed parts of the specimen; empty if there are none.

    Parameters
    ----------
    folder : Path
        Folder of the results.
    parts : sequence of Part
        The fit, and the response computed with it.
    album : Album
        Album that receives the figures.
    """
    fit, response = parts
    if not fit.there(folder):
        return []
    inside = folder / tasks.FOLDER
    found = tasks.read_found(inside)
    page: list[Section] = [Heading(TITLE), Text(_opening(fit.data))]
    if "folds" in found:
        page += _static(inside, found, fit.data)
    if "damping" in found:
        page += _release(inside, found, fit, album)
    if response.there(folder):
        page += _vibration(inside, album, fit.note)
    return page


def _opening(data: Data) -> str:
    if not data.synthetic:
        named = [f"{what}: {file.name}" for what, file in data.files.items()]
        return f"Measured data were given. {'; '.join(named)}."
    return (
        "The paper's raw data are not public. Everything in this part is SYNTHETIC: photographs "
        "and a film that Foldyn rendered, with lens, blur and noise, of a simulated sheet with the "
        "paper's parameters. Models are never exact, so this sheet differs from the fitted model: "
        "it is 3 % softer, has a consistent mass instead of circumcenter masses, and its creases "
        f"relax: at first they are {synthetic.RATIO:.0%} stiffer, with a relaxation time of "
        f"{synthetic.TIME:g} s, so that it drifts back after its release. The results show how "
        "well the method works, and nothing about the paper's sheet. For your own film, tracks or "
        "tables: foldyn study herkal --data FILE ..."
    )


# ---------------------------------------------------------------------- static test
def _static(folder: Path, found: dict[str, Any], data: Data) -> list[Section]:
    weights = found["weights"]
    rows = [[1e3 * u, f] for u, f in zip(weights["displacement"], weights["force"], strict=True)]
    shapes = folder / "folds" / "data-1.png"
    photograph = Picture(
        folder / "photograph.png",
        "The synthetic photograph under 0.312 N with the recognized nodes and the model.",
    )
    corners = Picture(shapes, "Deformed shapes of the model over the corners in the photographs.")
    softer = Text(
        "The fit cannot know that the sheet is softer than the model, which shifts both numbers. "
        "The intervals only reflect random errors, so they need not contain the truth."
    )
    return [
        Heading("Static test: the creases", 3),
        *([photograph] if data.synthetic else []),
        Table(
            ["displacement of the top (mm)", "weight (N)"], rows,
            "Fitted data: displacements imposed on the top, and the weights that it carries.",
        ),
        _estimates({"": found["folds"]}, FOLDS, data),
        *_doubt(found["folds"], "weights"),
        Picture(folder / "folds" / "data-0.png", "Forces, and the fitted model."),
        *([corners] if shapes.is_file() else []),  # each fit recreates the folder
        *([softer] if data.synthetic else []),
    ]  # fmt: skip


def _estimates(fits: Mapping[str, dict[str, Any]], truth: Mapping[str, float], data: Data) -> Table:
    """Table of fitted parameters with intervals and the paper's values, for each named support."""
    rows = [
        [*filter(None, [SUPPORT_NAMES.get(support)]), SYMBOLS[one["key"]], one["value"],
         one["lower"], one["upper"], truth[one["key"]], one["note"]]
        for support, fit in fits.items()
        for one in fit["parameters"]
    ]  # fmt: skip
    header = ["model stands on"] if any(fits) else []
    beside = "paper, and truth here" if data.synthetic else "paper"
    header += ["parameter", "fitted", "95 % from", "to", beside, ""]
    return Table(header, rows, "Fitted parameters.", digits=4)


def _doubt(fit: dict[str, Any], what: str) -> list[Section]:
    """Explain in words why a fit must not be used."""
    doubts = [
        f"the misfit is {one['relative']:.0%} of what was measured"
        for one in fit["measurements"]
        if one["name"] == what and one["relative"] > POOR
    ]
    doubts += [f"{SYMBOLS[p['key']]} is {p['note']}" for p in fit["parameters"] if p["at_bound"]]
    doubts += [
        f"the data do not determine {SYMBOLS[p['key']]}"
        for p in fit["parameters"]
        if not p["determined"] and not p["at_bound"]
    ]
    text = f"DO NOT USE THESE PARAMETERS, nor what follows from them: {'; '.join(doubts)}."
    return [Text(text)] if doubts else []


# ---------------------------------------------------------------------- release
def _release(folder: Path, found: dict[str, Any], fit: Part, album: Album) -> list[Section]:
    front = netcdf.read(folder / tasks.COMPARED, "cannot be read as NetCDF")
    data, note = fit.data, fit.note
    filmed = data.synthetic or data.film is not None
    label = f"{data.label} film" if filmed else data.label
    frame = Picture(folder / "film.png", "The frame of the film in which the model was recognized.")
    return [
        Heading("Release: the damping", 3),
        *([frame] if filmed else []),
        Picture(
            folder / "steps.png",
            f"Preparation of node {WATCHED} (the paper's node 9): window, first turning point, "
            "final position, trend.",
        ),
        Text(
            f"Before the release the top is {1e3 * found['press']:.2f} mm below its rest position. "
            "The model starts from the equilibrium on the smooth plate with this displacement. "
            f"Alpha and beta are fitted to node {WATCHED} along x; the other front nodes are held "
            "out."
        ),
        _estimates(found["damping"], DAMPING, data),
        *_doubt(found["damping"][FILM_SUPPORT], f"node {WATCHED}"),
        *album.figure(
            "specimen-supports",
            f"Node {WATCHED} in the film and in the model on three supports (left), with spectra "
            "(right). The model on the glue alone has the damping of the first.",
            lambda: plot_supports(front, label, note),
        ),
        *_vibrations(front, data),
        *album.figure(
            "specimen-front",
            f"All front nodes that were tracked, the model on the {SUPPORT_NAMES[FILM_SUPPORT]}. "
            f"Only node {WATCHED} was fitted.",
            lambda: plot_front(front, FILM_SUPPORT, label, note),
        ),
        *album.figure(
            "specimen-front-frequency",
            "Their amplitude spectra. Nodes that were lost for long have none.",
            lambda: plot_front(front, FILM_SUPPORT, label, note, spectra=True),
        ),
        _agreement(front),
    ]


def _vibrations(front: xr.Dataset, data: Data) -> list[Section]:
    """Vibration of the watched node, quality of the tracks, and the effect of the supports."""
    step, at = sampling_interval(front["time"].values), front.sel(node=WATCHED)
    curves = {f"{data.label}, as filmed": at["whole"]}
    if "true" in front:
        curves[f"{data.label}, its true motion"] = at["true"]
    for key, name in SUPPORT_NAMES.items():
        curves[f"model: {name}"] = at["model"].sel(support=key)
    found = {name: evaluation.vibration_of(x.values, step) for name, x in curves.items()}
    paper = read_targets("specimen")
    frequency, damping = (paper[f"release_{name}"].value for name in ("frequency", "damping"))
    rows: list[list[Any]] = [["paper", frequency, None, damping]]
    for name, one in found.items():
        rows.append([name, *map(cell, (one.peak, one.frequency, 100.0 * one.damping_ratio))])
    table = Table(
        ["", "spectrum's peak (Hz)", "maxima (Hz)", "decrement (%)"],
        rows,
        f"Vibration of node {WATCHED} along x: the highest peak of its spectrum between "
        f"{evaluation.NEAR[0]:g} and {evaluation.NEAR[1]:g} Hz; as in the paper, the frequency of "
        "its maxima over time, and damping by their logarithmic decrement.",
        digits=3,
    )
    held, alone = (found[f"model: {SUPPORT_NAMES[key]}"].peak for key in (FILM_SUPPORT, ALONE))
    return [table, *_tracked(front), Text(_glue(held, alone, frequency))]


def _tracked(front: xr.Dataset) -> list[Section]:
    """Error of the tracks relative to the true motion, if known."""
    if "true" not in front:
        return []
    off = (front["measured"] - front["true"]).values
    return [
        Text(
            f"The front nodes were measured in {np.isfinite(off).mean():.1%} of the frames, with "
            f"an error of {1e6 * math.sqrt(np.nanmean(off**2)):.0f} micrometres (root mean square "
            "without constant and linear parts, which the preparation removes)."
        )
    ]


def _glue(held: float, alone: float, paper: float) -> str:
    """Text on the effect of the supports on the frequency (Hz), which may tell them apart."""
    if not math.isfinite(held) or not math.isfinite(alone):
        return "With one of the supports the model has no peak where it is sought."
    text = (
        "The paper glued node 59 and let the specimen stand on the plate. The model's peak is at "
        f"{alone:.1f} Hz when only node 59 is held, and at {held:.1f} Hz when the plate holds the "
        f"bottom row in x; the paper found {paper:g} Hz."
    )
    if abs(held - paper) < 0.5 * abs(alone - paper):
        text += " So the plate held the row, whatever the glue did."
    return text


def _agreement(front: xr.Dataset) -> Table:
    step = sampling_interval(front["time"].values)
    rows = []
    for node in front["node"].values.tolist():
        at = front.sel(node=node)
        film, whole = at["measured"].values, at["whole"].values
        both = at["model"].sel(support=[FILM_SUPPORT, "plate"]).values
        rows.append(
            [node, "fitted" if node == WATCHED else f"held{NO_BREAK}out",
             *[100.0 * evaluation.misfit(film, x) for x in both],
             *[cell(100.0 * evaluation.content_misfit(whole, x, step)) for x in both]]
        )  # fmt: skip
    return Table(
        ["node", "", "time: glued (%)", "time: ideal (%)", "frequency: glued (%)",
         "frequency: ideal (%)"],
        rows,
        "Misfit of the front nodes relative to the measured values (root mean squares), over time "
        f"and of amplitude spectra up to {BAND[1]:g} Hz: with node 59 glued to the plate, and on "
        "the plate alone (ideal), each with its own damping.",
        digits=3,
    )  # fmt: skip


# ---------------------------------------------------------------------- vibration
def _vibration(folder: Path, album: Album, note: str) -> list[Section]:
    responses = {name: load(folder / file) for name, file in tasks.RESPONSES.items()}
    labels = {
        "published": "the paper's parameters", "air": "the same in air",
        "fitted": "fitted parameters",
    }  # fmt: skip
    labeled = {labels[name]: one for name, one in responses.items()}
    paper = read_targets("specimen")
    peaks = [paper[f"frf_{which}_peak"].value for which in ORDINALS]
    modes = load(folder / tasks.MODES)
    named = character(modes, "x")
    shown = [k + 1 for k in range(min(6, modes.sizes["mode"]))]
    return [
        Heading("Frequency response and modes", 3),
        *album.figure(
            "specimen-response",
            "Response of a corner of the top to a sine of 1 mN on each of its nodes.",
            lambda: plot_responses(labeled, peaks, note),
        ),
        _response_table(responses, paper),
        *album.figure(
            "specimen-modes",
            "Modes of the model with the fitted folds. "
            + "; ".join(f"{k}: {named['name'].values[k - 1]}" for k in shown)
            + ".",
            lambda: plots.draw_modes(case_of(modes), modes, which=shown, title=note),
        ),
        _air_table(modes, load(folder / tasks.IN_AIR), named["name"].values.tolist()),
    ]


def _air_table(modes: xr.Dataset, in_air: xr.Dataset, names: Sequence[str]) -> Table:
    return Table.of(
        {"mode": map(str, names), "in vacuum (Hz)": map(cell, modes["frequency"].values),
         "in air (Hz)": map(cell, in_air["frequency"].values),
         "share of the air (%)": map(cell, 100.0 * in_air["air_share"].values)},
        "Modes with the fitted folds in vacuum and in air, and the share of air in the modal mass.",
        digits=3,
    )  # fmt: skip


def _response_table(responses: Mapping[str, xr.Dataset], paper: Mapping[str, Target]) -> Table:
    found = [corner_peaks(one) for one in responses.values()]
    rows: list[list[Any]] = []
    for k, which in enumerate(ORDINALS):
        values = [cell(one[k].frequency) if k < len(one) else None for one in found]
        target = paper[f"frf_{which}_peak"]
        rows.append([f"{target.what} (Hz)", target.value, *values])
    for k, which in enumerate(ORDINALS[1:], 1):
        target = paper[f"half_power_{which}"]
        values = [cell(100.0 * one[k].textbook) if k < len(one) else None for one in found]
        rows.append([f"{target.what} (%)", target.value, *values])
    return Table(
        ["", "paper", "the paper's parameters, here", "the same in air", "fitted parameters"], rows,
        "Peaks of the response, and damping from half-power points as in the paper. One column is "
        "in air.",
        digits=3,
    )  # fmt: skip
