"""What `foldyn fit` leaves for people to look at: figures and a page."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.experiment.calibration import fit_figures
from foldyn.experiment.calibration.fit_problem import Run
from foldyn.experiment.calibration.fitted import Fit
from foldyn.experiment.calibration.measured import ForceDisplacement, Shapes, Spectrum, TimeHistory
from foldyn.experiment.calibration.measurement import Measurement
from foldyn.plots import style
from foldyn.report.page import write_report
from foldyn.report.sections import Heading, Picture, Section, Table, Text
from foldyn.writing import whole

POINTS = 25
"""Points of the curve that is drawn through measured forces."""


def write_fit(fit: Fit, folder: str | Path, title: str = "", note: str = "") -> Path:
    """Draw a fit into a folder that exists, a note on every figure; returns the page's path."""
    folder = Path(folder)
    sections: list[Section] = [Heading("Parameters"), _parameters(fit), Text(_quality(fit))]
    if len(fit.estimates) > 1:
        picture = folder / "correlation.png"
        _save(fit_figures.plot_correlation(fit), picture, note)
        sections.append(
            Picture(
                picture,
                "Correlation of the parameters: near 1 or -1 two of them can hardly be told apart, "
                "and their intervals are long in one direction.",
            )
        )
    if not all(one.determined for one in fit.estimates):
        sections.append(Text(_blind(fit)))
    sections += [Heading("Measured and model"), _scores(fit)]
    for i, one in enumerate(fit.problem.measurements):
        picture = _draw(fit, i, one, folder, note)
        if picture is not None:
            sections.append(Picture(picture, _caption(one)))
    sections += [Heading("The search"), _searches(fit)]
    return write_report(
        folder / "report.html", title or f"Fit of {fit.problem.path.stem}", sections
    )


def _parameters(fit: Fit) -> Table:
    percent = f"{100.0 * fit.confidence:g} %"
    rows = [
        [one.key, one.value, *(_finite(v) for v in (one.standard_error, one.lower, one.upper)),
         one.note] for one in fit.estimates
    ]  # fmt: skip
    changes = fit.problem.space.changes([*fit.values.values()])
    for tie in fit.problem.space.ties:
        rows.append([tie.key, changes[tie.key], None, None, None, f"= {tie.expression}"])
    header = ["parameter", "value", "standard error", f"{percent} from", "to", ""]
    return Table(header, rows, "Parameters in the units of the case file.", digits=5)


def _quality(fit: Fit) -> str:
    given = all(one.sigma is not None for one in fit.problem.measurements if not one.held_out)
    told = f"The intervals are from the Jacobian at the optimum and Student's t with {fit.freedom} "
    told += "degrees of freedom; they hold where the model is right and its errors are random."
    if given and math.isfinite(fit.misfit):
        told += (
            f" The misfit is {fit.misfit:.3g} times what the standard errors of the data explain"
            + (
                ": the model is wrong somewhere, or they are too small."
                if fit.misfit > 1.5
                else "."
            )
        )
    return told


def _blind(fit: Fit) -> str:
    weak = [one.key for one in fit.estimates if not one.determined and not one.at_bound]
    lines = []
    for value, row in zip(fit.singular_values, fit.directions, strict=True):
        parts = [
            f"{part:+.2f} {key}" for part, key in zip(row, fit.values, strict=True)
            if abs(part) > 0.1
        ]  # fmt: skip
        lines.append(f"{value:.3g}: {', '.join(parts)}")
    return (
        f"The data do not determine {' and '.join(weak)}: other values fit as well. Measure "
        "something that depends on them, or leave them as they are known otherwise. Singular "
        "values, each with the change of the parameters (in their scales) that it belongs to: "
        + "; ".join(line for line in lines if not line.endswith(": "))
        + "."
    )


def _scores(fit: Fit) -> Table:
    rows = [[s.name, s.held_out, s.count, s.rms, s.unit, 100.0 * s.relative] for s in fit.scores]
    header = ["measurement", "held out", "values", "rms misfit", "unit", "of its variation (%)"]
    return Table(header, rows, digits=3)


def _searches(fit: Fit) -> Table:
    keys = [key.rsplit(".", 1)[-1] for key in fit.values]
    rows = [
        [*one.start, *one.values, _finite(one.cost), one.evaluations, one.message]
        for one in fit.descents
    ]
    header = [*(f"{key}, start" for key in keys), *(f"{key}, end" for key in keys),
              "cost", "steps", "why it ended"]  # fmt: skip
    told = f"{fit.evaluations} evaluations of the model in all."
    if len(rows) > 1:
        told = f"{fit.agreeing} of {len(rows)} searches ended at the smallest cost. {told}"
    return Table(header, rows, told)


def _caption(one: Measurement) -> str:
    told = f"{one.name}: {one.label} and model."
    if isinstance(one, TimeHistory | Spectrum) and one.values.shape[1] > fit_figures.MOST:
        told += f" The first {fit_figures.MOST} of {one.values.shape[1]} nodes."
    return f"{told} Held out: the fit did not use it." if one.held_out else told


def _draw(fit: Fit, number: int, one: Measurement, folder: Path, note: str) -> Path | None:
    """Draw one measurement; returns its picture's path, None where there is nothing to draw."""
    run = next(run for run in fit.problem.runs if number in run.members)
    values = [*fit.values.values()]
    case = fit.problem.case_file(run, values).case()
    result = partial(fit.problem.result, run, values)
    if isinstance(one, ForceDisplacement):
        figure = fit_figures.plot_forces(one, _curve(fit, run, one, case))
    elif isinstance(one, Shapes):
        if len(one.axes) < 2:
            return None
        figure = fit_figures.plot_shapes(one, case, one.shapes(result(), case))
    elif isinstance(one, TimeHistory):
        figure = fit_figures.plot_histories(one, case, one.curves(result(), case))
    elif isinstance(one, Spectrum):
        figure = fit_figures.plot_spectra(one, case, one.spectra(result(), case))
    else:
        return None
    picture = folder / f"data-{number}.png"
    _save(figure, picture, note)
    return picture


def _save(figure: Figure, picture: Path, note: str) -> None:
    style.title_above(figure, note)
    with whole(picture) as part:
        style.finish(figure).savefig(part)


def _curve(
    fit: Fit, run: Run, one: ForceDisplacement, case: Case
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Displacements and forces of the model from 0 to beyond the measured ones."""
    ends = min(0.0, one.displacement.min()), max(0.0, one.displacement.max())
    along = np.union1d(np.linspace(*ends, POINTS), one.displacement)
    dense = one.at(along)
    result = fit.problem.result(run, [*fit.values.values()], [dense])
    return along, dense.predicted(result, case)


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
