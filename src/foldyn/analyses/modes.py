"""Modes: [analysis] of kind "modes", arguments of `modes`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Annotated, Any

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn import plots
from foldyn.analyses.casefile import CaseFile, arguments_of, counted
from foldyn.analyses.sections import AnalysisSection, Animation, Count, ShownSection, some_shapes
from foldyn.analyses.vibration import GONE, About, Secant, Vibration, VibrationSchema, slope_notes
from foldyn.arguments import Check
from foldyn.cases import Case
from foldyn.linear import character, mac, modes, pair_modes
from foldyn.linear.compared import size
from foldyn.plots.readings import chosen_modes
from foldyn.report.album import Album, ByRule, computation, listed
from foldyn.report.sections import Heading, Picture, Section, Table, Text, cell

FRAMES, FPS = 24, 12
MOST_FILMED = 6
"""Largest number of modes in the film."""
MOST_TRIANGLES = 25_000
"""Largest number of triangles in a picture of the film, unless a single mode has more."""


class ModesSection(AnalysisSection):
    """[analysis] of kind "modes"."""

    like = (modes,)
    count: Count = 6
    state: About = "rest"
    secant: Secant = None
    gone = GONE
    check_model: bool = True


class ModesOutput(ShownSection):
    """[output] of modes; axis and nodes determine how modes are characterized.

    Parameters
    ----------
    shapes : int or sequence of int
        Number of drawn modes, or their numbers.
    animation : {"gif", "mp4"}, optional
        Film of the modes next to the page.
    """

    shapes: Annotated[
        int | Sequence[int], Check(some_shapes, drawn="modes", what="mode", least=1)
    ] = 6
    animation: Animation = None


class ModesSchema(VibrationSchema):
    """A case file of kind "modes"."""

    analysis: ModesSection
    output: ModesOutput = ModesOutput()


class ModesAnalysis(Vibration):
    """Natural frequencies and mode shapes about a state."""

    kind = "modes"
    moving = True
    schema = ModesSchema
    needs_density = "modes need"
    function = staticmethod(modes)
    takes = arguments_of(modes)
    files = ("modes", "mac", "modes.gif", "modes.mp4")

    def line(self, name: str, result: xarray.Dataset) -> str:
        """Frequencies and effort."""
        rigid, unstable = result["rigid"].values, result["eigenvalue"].values < 0.0
        elastic = result["frequency"].values[~rigid & ~unstable]
        kinds = (rigid, "rigid"), (unstable, "unstable")
        special = [f"{int(own.sum())} {what}" for own, what in kinds if own.any()]
        reach = f", {elastic[0]:.4g} to {elastic[-1]:.4g} Hz" if len(elastic) else ""
        if len(elastic) and "frequency_error" in result:
            off = (result["frequency_error"].values[~rigid & ~unstable] / elastic).max()
            reach += f" (each within {size(float(off))})"
        if "model_error" in result and np.isfinite(result["model_error"]).any():
            off = float(np.abs(result["model_error"]).max())
            reach += f" (within {size(off)} of superelements)"
        among = f" ({', '.join(special)})" if special else ""
        return (
            f"  {name}: {counted(result.sizes['mode'], 'mode')}{among}{reach}, "
            f"{result.attrs['wall_seconds']:.1f} s"
        )

    @staticmethod
    def sections(case_file: CaseFile, results: ByRule, album: Album) -> Iterator[Section]:
        """See `Analysis`."""
        (first, modes), *others = results.items()
        case = case_file.case(first)
        shown = chosen_modes(modes, case_file.output.shapes)
        output = case_file.output
        nodes = output.nodes if output.named else None
        names = character(modes, output.axis, nodes=nodes, case=case)
        rule = f", mass rule {first}" if others else ""
        yield from album.structure(case)
        yield Heading("The modes")
        yield from album.figure(
            "modes",
            f"Mode shapes{rule}, over {_about(modes)} in gray. A mode has no "
            "amplitude of its own: each is drawn so that it can be read.",
            lambda: plots.draw_modes(case, modes, which=shown, names=names),
        )
        if case_file.output.animation:
            together = max(1, MOST_TRIANGLES // len(case.structure.triangles))
            filmed = shown[: min(MOST_FILMED, together)]
            film = album.folder / f"modes.{case_file.output.animation}"
            plots.animate_modes(
                case, modes, path=film, which=filmed, names=names, frames=FRAMES, fps=FPS
            )
            some = f" (the first {len(filmed)})" if len(filmed) < len(shown) else ""
            yield Picture(film, f"The same modes{some} in motion, all at one pace.")
        same = {rule: mac(modes, other, mass=case.mass) for rule, other in others}
        if same:
            yield from album.figure(
                "mac",
                f"How alike modes with {first} (rows) and with {', '.join(same)} (columns) are: "
                "modal assurance criterion, weighted by the mass; 1 is the same shape.",
                lambda: _draw_mac(first, same),
            )
        yield Heading("The numbers")
        yield _table(modes, names, f"{rule}, {_judged(case_file, names)}")
        if same:
            yield _compared(results, same)
        columns = {
            "free dofs": "free_dofs", "state": "state", "secant (degrees)": "secant",
            "proven complete": lambda r: f"{int(r.attrs['complete'])} of {r.sizes['mode']}",
            "solver": "solver",
        }  # fmt: skip
        yield computation(case_file, results, columns)
        yield Text(_notes(modes, case))


def _about(modes: xarray.Dataset) -> str:
    """The state of the vibration, in words."""
    states = {"rest": "the undeformed sheet", "equilibrium": "the equilibrium under the loads"}
    return states.get(str(modes.attrs["state"]), "the stored state")


def _judged(case_file: CaseFile, names: xarray.Dataset) -> str:
    """Text for a caption on how modes were named."""
    of = f" of {listed('node', case_file.output.nodes.tolist())}" if case_file.output.named else ""
    return f"named by the largest share of their motion{of}, seen along {names.attrs['axis']}"


def _draw_mac(first: str, same: Mapping[str, NDArray[np.float64]]) -> Any:
    """Draw the matrices side by side."""
    whole = np.hstack([np.nan_to_num(matrix) for matrix in same.values()])
    if len(same) == 1:
        return plots.plot_mac(whole, row_title=first, column_title=next(iter(same)))
    columns = [f"{rule} {k + 1}" for rule, matrix in same.items() for k in range(matrix.shape[1])]
    return plots.plot_mac(whole, None, columns=columns, row_title=first, column_title="")


def _compared(results: ByRule, same: Mapping[str, NDArray]) -> Table:
    """Table of corresponding modes with other mass rules."""
    first, modes = next(iter(results.items()))
    header = ["mode", f"{first} (Hz)"]
    numbers = modes["mode"].values.tolist()
    rows: list[list[Any]] = [[mode, _frequency(modes, k)] for k, mode in enumerate(numbers)]
    for rule, matrix in same.items():
        header += [f"{rule} (Hz)", "MAC"]
        pairs = pair_modes(np.nan_to_num(matrix))
        partner = dict(zip(pairs.first.tolist(), pairs.second.tolist(), strict=True))
        for k, row in enumerate(rows):
            j = partner.get(k)
            row += [None, None] if j is None else [_frequency(results[rule], j), matrix[k, j]]
    return Table(header, rows, "The same modes with other mass rules, by their shapes")


def _table(modes: xarray.Dataset, names: xarray.Dataset, remark: str) -> Table:
    numbers = modes["mode"].values
    columns: dict[str, Iterable[Any]] = {"mode": numbers}
    columns["frequency (Hz)"] = [_frequency(modes, k) for k in range(len(numbers))]
    if "frequency_error" in modes:
        columns["error (Hz)"] = map(cell, modes["frequency_error"].values)
    if "model_error" in modes:
        columns["error (%)"] = map(cell, 100.0 * modes["model_error"].values)
    columns["damping (%)"] = map(cell, 100.0 * modes["damping_ratio"].values)
    columns["what it does"] = map(str, names["name"].values)
    columns["share (%)"] = (100.0 * names["share"].max("kind").values).round().astype(int)
    free = np.asarray(modes.attrs["free_mass"], dtype=np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = 100.0 * modes["effective_mass"].transpose("axis", "mode").values / free[:, None]
    for axis, share in zip("xyz", shares, strict=True):
        what = "effective mass " if axis == "x" else ""
        columns[f"{what}{axis} (%)"] = [cell(round(one, 1)) for one in share.tolist()]
    return Table.of(
        columns,
        f"The modes{remark}. Effective masses: what a motion of the base along the axis excites, "
        "of the mass that is free to move along it.",
    )


def _frequency(modes: xarray.Dataset, k: int) -> float | str:
    if bool(modes["rigid"].values[k]):
        return "rigid"
    value = float(modes["frequency"].values[k])
    return value if np.isfinite(value) else "unstable"


def _notes(modes: xarray.Dataset, case: Case) -> str:
    """Notes on the numbers."""
    notes = [
        f"Modes are small vibrations about {_about(modes)}, shapes of the modal mass 1. The result "
        "carries its own case."
    ]
    rayleigh = case.rayleigh
    if rayleigh.alpha or rayleigh.beta:
        notes.append(
            f"Damping: C = alpha M + beta K0 with alpha {rayleigh.alpha:g} 1/s and beta "
            f"{rayleigh.beta:g} s gives the ratio of each mode."
        )
    notes += slope_notes(modes)
    if case.air is not None and "air_share" in modes:
        share = 100.0 * modes["air_share"].values
        notes.append(
            f"The sheet is in a fluid of {case.air.density:.4g} kg/m3, which has {share.min():.2g} "
            f"to {share.max():.2g} % of the modal mass."
        )
    if "frequency_error" in modes:
        notes.append(
            "The panels are superelements. The errors of the frequencies are estimates of the "
            "largest difference to a shell on a fine mesh, from other levels and meshes."
        )
    if "model_error" in modes:
        missing = np.ravel(modes.attrs.get("missing_frequencies", ()))
        listed = ", ".join(f"{each:.4g}" for each in missing)
        notes.append(
            "The errors are relative to superelements, which are within 2 % of a fine shell; modes "
            "without an error resemble none of theirs."
            + (f" Modes of theirs at {listed} Hz are missing here." if listed else "")
        )
    elif "not_compared" in modes.attrs:
        notes.append(f"Not compared with superelements: {modes.attrs['not_compared']}.")
    if float(modes.attrs["residual"]) > 1e-6:
        notes.append(
            f"The state is no equilibrium: its residual is {modes.attrs['residual']:.2g} of the "
            "forces at play."
        )
    return "\n\n".join(notes)
