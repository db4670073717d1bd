"""Figures and the page of modes: what `foldyn run` and `foldyn modes` leave to look at."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from foldyn import plots
from foldyn.cases import Case
from foldyn.cases.casefile import CaseFile
from foldyn.linear import character, mac, pair_modes
from foldyn.plots.modes import chosen_modes, main_axis
from foldyn.plots.scene import Sheet3D
from foldyn.report.album import Album
from foldyn.report.page import write_report
from foldyn.report.sections import Heading, Picture, Section, Table, Text

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

FRAMES, FPS = 24, 12
MOST_FILMED = 6
"""Modes that the film shows at most."""
MOST_TRIANGLES = 25_000
"""Triangles that each of its pictures has at most, unless a single mode has more."""


def write_modes(
    case_file: CaseFile, results: Mapping[str, xarray.Dataset], folder: str | Path
) -> Path:
    """Draw a case and its modes into `folder`; returns the path of report.html.

    Parameters
    ----------
    case_file : CaseFile
    results : mapping
        Modes by mass rule.
    folder : path
        Exists already; files of the same names are replaced.
    """
    album = Album(folder)
    first = next(iter(results))
    case, modes = case_file.case(first), results[first]
    shown = shown_modes(modes, case_file.output.shapes)
    told = _character(case_file, modes, case)
    about = _about(modes)
    rule = f", mass rule {first}" if len(results) > 1 else ""
    sections: list[Section] = [
        *album.structure(case),
        Heading("The modes"),
        album.figure(
            "modes",
            f"Mode shapes{rule}, over {about} in gray; {_judged(case_file, told)}. A mode has no "
            "amplitude of its own: each is drawn so that it can be read.",
            lambda: plots.draw_modes(case, modes, shown, names=told),
        ),
    ]
    together = max(1, MOST_TRIANGLES // len(case.structure.triangles))
    filmed = shown[: min(MOST_FILMED, together)]
    film = album.folder / f"modes.{case_file.output.animation}"
    plots.animate_modes(case, modes, film, filmed, names=told, frames=FRAMES, fps=FPS)
    sections.append(
        Picture(film, f"The same modes{_first(filmed, shown)} in motion, all at one pace.")
    )
    others = list(results)[1:]
    if others:
        same = {other: mac(modes, results[other], case.structure.mass) for other in others}
        sections.append(
            album.figure(
                "mac",
                f"How alike modes with {first} (rows) and with {_listed(others)} (columns) are: "
                "modal assurance criterion, weighted by the mass; 1 is the same shape.",
                lambda: _draw_mac(first, same),
            )
        )
    sections += [Heading("The numbers"), _table(modes, told, rule)]
    sections += [_compared(results, same)] if others else []
    sections += [_run(case_file, results), Text(_notes(modes, case))]
    title = case_file.title or case_file.path.stem
    return write_report(album.folder / "report.html", title, sections)


def shown_modes(modes: xarray.Dataset, shapes: int | tuple[int, ...] | None) -> list[int]:
    """Numbers of the modes that are drawn: those named, or the first that are not rigid."""
    if isinstance(shapes, tuple):
        return chosen_modes(modes, shapes)
    return chosen_modes(modes, None)[:shapes]


def _about(modes: xarray.Dataset) -> str:
    """About which state the modes swing."""
    return {
        "rest": "the undeformed sheet",
        "equilibrium": "the equilibrium under the loads",
    }.get(str(modes.attrs["state"]), "the stored state")


def _character(case_file: CaseFile, modes: xarray.Dataset, case: Case) -> xarray.Dataset:
    """What the modes do along the axis that the file names, or the main one."""
    chosen = case_file.output
    axis = chosen.axis or main_axis(Sheet3D.of(case))
    return character(modes, axis, chosen.nodes if chosen.named else None, case=case)


def _judged(case_file: CaseFile, told: xarray.Dataset) -> str:
    """How the names of modes came about."""
    of = f" of nodes {_listed(case_file.output.nodes.tolist())}" if case_file.output.named else ""
    return f"named by the largest share of their motion{of}, seen along {told.attrs['axis']}"


def _draw_mac(first: str, same: Mapping[str, NDArray[np.float64]]) -> Figure:
    """Draw the matrices beside each other."""
    whole = np.hstack([np.nan_to_num(matrix) for matrix in same.values()])
    if len(same) == 1:
        return plots.plot_mac(whole, row_title=first, column_title=next(iter(same)))
    columns = [f"{rule} {k + 1}" for rule, matrix in same.items() for k in range(matrix.shape[1])]
    return plots.plot_mac(whole, None, columns, first, "")


def _compared(results: Mapping[str, xarray.Dataset], same: Mapping[str, NDArray]) -> Table:
    """Frequencies of modes that belong together, by mass rule."""
    first, modes = next(iter(results.items()))
    header = ["mode", f"{first} (Hz)"]
    rows: list[list[Any]] = [
        [number, _frequency(modes, k)] for k, number in enumerate(modes["mode"].values.tolist())
    ]
    for rule, matrix in same.items():
        header += [f"{rule} (Hz)", "MAC"]
        pairs = pair_modes(np.nan_to_num(matrix))
        partner = dict(zip(pairs.first.tolist(), pairs.second.tolist(), strict=True))
        for k, row in enumerate(rows):
            j = partner.get(k)
            row += [None, None] if j is None else [_frequency(results[rule], j), matrix[k, j]]
    return Table(header, rows, "The same modes with other mass rules, by their shapes")


def _listed(names: list[Any]) -> str:
    return ", ".join(map(str, names))


def _first(filmed: list[int], shown: list[int]) -> str:
    return f" (the first {len(filmed)})" if len(filmed) < len(shown) else ""


def _table(modes: xarray.Dataset, told: xarray.Dataset, rule: str) -> Table:
    header = ["mode", "frequency (Hz)", "damping (%)", "what it does", "share (%)"]
    header += [f"{'effective mass ' if axis == 'x' else ''}{axis} (%)" for axis in "xyz"]
    free = np.asarray(modes.attrs["free_mass"], dtype=np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = 100.0 * modes["effective_mass"].transpose("mode", "axis").values / free
    rows = []
    for k, number in enumerate(modes["mode"].values.tolist()):
        row: list[Any] = [number, _frequency(modes, k), _percent(modes["damping_ratio"].values[k])]
        row += [str(told["name"].values[k]), round(100.0 * float(told["share"][k].max()))]
        rows.append([*row, *(_share(share) for share in shares[k].tolist())])
    return Table(
        header,
        rows,
        f"The modes{rule}. Effective masses: what a motion of the base along the axis excites, of "
        "the mass that is free to move along it.",
    )


def _frequency(modes: xarray.Dataset, k: int) -> float | str:
    if bool(modes["rigid"].values[k]):
        return "rigid"
    value = float(modes["frequency"].values[k])
    return value if np.isfinite(value) else "unstable"


def _percent(ratio: float) -> float | None:
    return 100.0 * ratio if np.isfinite(ratio) else None


def _share(percent: float) -> float | None:
    """A share to 0.1 %."""
    return round(percent, 1) if np.isfinite(percent) else None


def _run(case_file: CaseFile, results: Mapping[str, xarray.Dataset]) -> Table:
    header = ["mass rule", "free dofs", "state", "secant (degrees)", "proven complete", "solver"]
    rows = []
    for rule, modes in results.items():
        a = modes.attrs
        complete = f"{int(a['complete'])} of {modes.sizes['mode']}"
        rows.append(
            [rule, a["free_dofs"], a["state"], a.get("secant"), complete, a["solver"],
             a["wall_seconds"]]
        )  # fmt: skip
    return Table([*header, "time (s)"], rows, f"{case_file.path.name}: the computation", digits=3)


def _notes(modes: xarray.Dataset, case: Case) -> str:
    """What a reader has to know about the numbers."""
    told = [
        f"Computed with Foldyn {modes.attrs['foldyn_version']}. Modes are small vibrations about "
        f"{_about(modes)}, shapes of the modal mass 1. The result carries its own case."
    ]
    if case.damping.alpha or case.damping.beta:
        told.append(
            f"Damping: C = alpha M + beta K0 with alpha {case.damping.alpha:g} 1/s and beta "
            f"{case.damping.beta:g} s gives the ratio of each mode."
        )
    soft = int(modes.attrs["soft_hinges"])
    if soft:
        told.append(
            f"{soft} hinges of the superlinear law stand at their rest angle, where their slope "
            "vanishes: they count without stiffness, and motions that only they resist have the "
            "frequency zero. With a secant amplitude they have the slope of an oscillation of that "
            "amplitude."
        )
    if "secant" in modes.attrs:
        told.append(
            "Superlinear hinges have the slope that is equivalent to an oscillation by "
            f"{modes.attrs['secant']:g} degrees: the frequencies are those of that amplitude."
        )
    if float(modes.attrs["residual"]) > 1e-6:
        told.append(
            f"The state is no equilibrium: its residual is {modes.attrs['residual']:.2g} of the "
            "forces at play."
        )
    return "\n\n".join(told)
