"""The equivalent plate, beam or solid of a repeated case: [analysis] of kind "effective"."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import xarray

from foldyn import plots
from foldyn.analyses.casefile import Analysis, Begun, CaseFile, Compute, counted
from foldyn.analyses.cells import CellSchema, CellSection, cell_states, coordinate, in_all
from foldyn.analyses.ranges import Varied
from foldyn.cases import Case
from foldyn.linear import effective
from foldyn.linear.cell_equilibrium import BY_STATE
from foldyn.report.album import Album, ByRule
from foldyn.report.sections import Heading, Section, Table, Text, cell
from foldyn.results.dataset import result_dataset

MATRICES = {
    "membrane": ("membrane", "membrane"), "coupling": ("membrane", "bending"),
    "bending": ("bending", "bending"), "stiffness": ("stiffness", "stiffness"),
}  # fmt: skip
"""Matrices of a page, and those whose diagonals are the scales of rows and columns."""
NOUGHT = 1e-10  # of these scales: smaller numbers are round-off
STATE = ("center", "frame", "vectors", "angles", "axes", "points", "displacement")
MEANING = (
    "Loads are forces and moments per length of the sheet, or of the whole chain, or stresses of "
    "a solid; creases and "
    "panels of the cell are relaxed under each mean strain and curvature. Poisson's ratios and "
    "moduli of stretching are those of a sheet that stays flat, those of bending of one without "
    "mean forces. Directions x and y are the first two axes of the frame."
)


class EffectiveSection(CellSection):
    """[analysis] of kind "effective"."""

    check_model: bool = True


class EffectiveSchema(CellSchema):
    """A case file of kind "effective"."""

    analysis: EffectiveSection


class EffectiveAnalysis(Analysis):
    """Stiffness of what is equivalent to a sheet that repeats: a plate, beam or solid."""

    kind = "effective"
    schema = EffectiveSchema
    needs_density = ""
    takes = ("stretch", "turn", "secant", "check_model")
    files = ("effective",)
    by_mass = False

    def prepare(self, case_file: CaseFile, mass: str, changes: Mapping[str, Any]) -> Compute:
        """See `Analysis`."""
        states = cell_states(case_file, mass, {**self.arguments, **changes})

        def compute(progress: bool, begun: Begun) -> xarray.Dataset:
            found = in_all(states, _effective, progress, begun)
            vary = states[0].varied
            return found[0] if vary is None else _joined(case_file.case(mass), vary, found)

        return compute

    def line(self, name: str, result: xarray.Dataset) -> str:
        """Main numbers."""
        if "state" in result.dims:
            seconds = result.attrs["wall_seconds"]
            return f"  {counted(result.sizes['state'], 'state')}, {seconds:.1f} s"
        shown = ("modulus", "poissons_ratio", "axial_stiffness", "torsional_stiffness")
        known = [name for name in shown if name in result]
        numbers = [f"{name.replace('_', ' ')} {_listed(result[name])}" for name in known]
        return f"  {'; '.join(numbers)}, {result.attrs['wall_seconds']:.1f} s"

    @staticmethod
    def sections(case_file: CaseFile, results: ByRule, album: Album) -> Iterator[Section]:
        """See `Analysis`."""
        (first, result), *_ = results.items()
        yield from album.structure(case_file.case(first), "A cell with its nodes.")
        several = "state" in result.dims
        if several or "angle" in result.coords:
            yield Heading("States" if several else "Directions")
            yield from album.figure(
                "effective", "Properties by state, hollow where it is unstable." if several else
                "Moduli of stretching and bending along directions in the sheet.",
                lambda: plots.plot_effective(result),
            )  # fmt: skip
        yield Heading("The numbers")
        if "model_error" in result:
            error = 100.0 * float(np.abs(result["model_error"]).max())
            yield Text(f"Entries of the stiffness are within {error:.2g} % of superelements'.")
        if several:
            yield _by_state(result)
            yield Text(MEANING)
            return
        for name in (one for one in MATRICES if one in result):
            strains, values = result["strain"].values.tolist(), result[name].values
            row, column = (np.sqrt(np.abs(np.diag(result[one].values))) for one in MATRICES[name])
            shown = np.where(np.abs(values) < NOUGHT * np.outer(row, column), 0.0, values)
            rows = [[load, *map(cell, own)] for load, own in zip(strains, shown, strict=True)]
            yield Table(["load", *strains], rows, f"{name} ({result[name].units})")
        others = [
            [str(name).replace("_", " "), _listed(one), one.units]
            for name, one in result.data_vars.items()
            if one.size <= 6 and name not in (*MATRICES, *STATE) and "units" in one.attrs
        ]
        yield Table(["property", "value", "unit"], others, f"{case_file.path.name}: properties")
        yield Text(MEANING)


def _effective(state: Any) -> xarray.Dataset:
    """Properties in one state."""
    return effective(state.cell, check_model=state.given["check_model"], **state.arguments())


def _joined(case: Case, vary: Varied, found: Sequence[xarray.Dataset]) -> xarray.Dataset:
    """Properties in all states as one result."""
    first, own = found[0], result_dataset("effective", case, {}, {}, {})
    values: dict[str, Any] = {}
    for name, one in first.data_vars.items():
        if name not in own and all(name in each for each in found):
            stacked = np.stack([each[name].values for each in found])
            values[str(name)] = ("state", *one.dims), stacked, one.attrs
    along: dict[str, Any] = {
        str(name): one.variable for name, one in first.coords.items() if name not in own.coords
    }
    facts = {
        "residual": max(one.attrs["residual"] for one in found),
        "not_compared": first.attrs.get("not_compared"),
        "wall_seconds": sum(one.attrs["wall_seconds"] for one in found),
    }
    return result_dataset("effective", case, values, along | {"state": coordinate(vary)}, facts)


def _by_state(result: xarray.Dataset) -> Table:
    """The short variables, a row for each state."""
    shown = [str(name) for name in BY_STATE if name in result]
    rows = []
    for state in result["state"].values:
        one = result.sel(state=state)
        stable = "yes" if one["stable"] else "no"
        rows.append([cell(float(state)), *(_listed(one[name]) for name in shown), stable])
    units = [f"{name.replace('_', ' ')} ({result[name].units})" for name in shown]
    names = [result["state"].attrs["long_name"], *units, "stable"]
    return Table(names, rows, "Properties in each state")


def _listed(values: xarray.DataArray) -> str:
    """Numbers of a variable, each after its direction, if it has one."""
    names = [f"{one} " for dim in values.dims if dim in values.coords for one in values[dim].values]
    numbers = [f"{each:.4g}" for each in values.values.ravel()]
    return ", ".join(map("".join, zip(names or [""] * len(numbers), numbers, strict=True)))
