"""Models beside superelements or the shell: [analysis] of kind "fidelity"."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, Self

import numpy as np
import xarray

from foldyn import plots
from foldyn.analyses.bars import bar, bar_closed
from foldyn.analyses.casefile import Analysis, Begun, CaseFile, Compute, arguments_of
from foldyn.analyses.sections import AnalysisSection, CaseSchema, Count, Positive, one_of
from foldyn.analyses.vibration import Secant
from foldyn.arguments import Placed
from foldyn.cases import Case
from foldyn.cases.models import BARS_AND_HINGES, SUPERELEMENTS
from foldyn.errors import InputError
from foldyn.linear import Fidelity, fidelity
from foldyn.linear.compared import WITHIN, against, legend, percent
from foldyn.linear.fidelity import MODELS, REFERENCES, comparison, named
from foldyn.linear.shell_of import checked_divisions
from foldyn.report.album import Album, ByRule
from foldyn.report.sections import Heading, Section, Table, Text
from foldyn.tables import ListOf
from foldyn.values import show


class FidelitySection(AnalysisSection):
    """[analysis] of kind "fidelity"."""

    like = (fidelity,)
    count: Count = 6
    reference: Annotated[str, one_of(REFERENCES)] = SUPERELEMENTS
    divisions: Annotated[int | Sequence[int] | None, Placed(checked_divisions, name="")] = None
    models: Annotated[
        Sequence[str] | None, ListOf(one_of(MODELS), 'a list of names, as in ["plate"]')
    ] = None
    secant: Secant = None
    vertex_radius: Positive | None = None


class FidelitySchema(CaseSchema):
    """A case file of kind "fidelity"."""

    analysis: FidelitySection

    def agree(self) -> None:
        """Refuse other models than bars and hinges."""
        if self.model.kind not in (None, BARS_AND_HINGES):
            raise InputError(
                f" = {show(self.model.kind)}: bars and hinges are compared with this model, which "
                "is made from them; leave out kind and the keys of that model",
                "model.kind",
            )


class FidelityAnalysis(Analysis):
    """Comparison of models of bars and hinges with superelements or the shell."""

    kind = "fidelity"
    schema = FidelitySchema
    needs_density = "a comparison of frequencies needs"
    takes = arguments_of(fidelity)
    files = ("fidelity",)
    by_mass = False

    masses: tuple[str, ...] = ()
    """Further mass rules of the file; each is compared as a model of its own."""

    @classmethod
    def of(cls, schema: Any, case: Case) -> Self:
        """See `Analysis`."""
        own = super().of(schema, case)
        own.masses = tuple(schema.model.mass or ())[1:]
        return own

    def prepare(self, case_file: CaseFile, mass: str, changes: Mapping[str, Any]) -> Compute:
        """See `Analysis`."""
        case, given = case_file.case(mass), {**self.arguments, **changes}
        others = {f"own ({rule})": {"mass": rule} for rule in self.masses}
        models = {**others, **named(given["models"], case.structure)}
        checked = comparison(case, **{**given, "models": models})

        def compute(progress: bool, begun: Begun) -> xarray.Dataset:
            begun()
            with bar_closed(bar(progress, bar_format="{desc} ({elapsed})")) as shown:
                told = checked.run(lambda step: shown.set_description_str(f"fidelity: {step}"))
            return told.result

        return compute

    def line(self, name: str, result: xarray.Dataset) -> str:
        """All modes in a table, and notes."""
        return str(Fidelity(result))

    @staticmethod
    def sections(case_file: CaseFile, results: ByRule, album: Album) -> Iterator[Section]:
        """See `Analysis`."""
        (first, result), *_ = results.items()
        found = Fidelity(result)
        yield Heading("Errors")
        yield from album.figure(
            "fidelity",
            f"Above: errors of the models' frequencies, relative to {against(result)}, 5 % shaded. "
            "Below: likeness of the shapes (MAC); modes below 0.5 are lost, and have no error. "
            "Dashed: 0.6 of the plate frequency, above which panels vibrate as plates.",
            lambda: plots.plot_fidelity(found),
        )
        yield Heading("The numbers")
        yield _models(found)
        yield _modes(found)
        yield Text(_notes(found))
        yield from album.structure(case_file.case(first))


def _models(found: Fidelity) -> Table:
    """Table with a row for each model: its options, its errors, its range."""
    result, below = found.result, found.result["frequency"].values < found.limit
    forces = "deflection" in result
    header = ["model", "options", "median (%)", "largest (%)", "lost"]
    header += ["small loads (%)"] if forces else []
    rows = []
    for model in found.models:
        one = result.sel(model=model)
        error = np.abs(one["error"].values[below])
        kept = 100.0 * error[np.isfinite(error)]
        row = [model, one["options"].item()]
        row += [float(np.median(kept)), float(kept.max())] if len(kept) else [None, None]
        row.append(int(np.isinf(error).sum()))
        if forces:
            row.append(_told(float(one["deflection_error"]), "soft"))
        rows.append([*row, found.holds_to(model)])
    # this table shows no modes
    words = [line for line in legend(found) if not line.startswith("*")]
    return Table(
        [*header, f"{WITHIN} (Hz)"],
        rows,
        f"Errors against {against(result)} of the {int(below.sum())} modes below 0.6 of the plate "
        f"frequency, {found.limit:.4g} Hz; lost modes do not count in median and largest. "
        f"{'; '.join(words)}.",
        digits=3,
    )


def _modes(found: Fidelity) -> Table:
    """Table with a row for each mode of the reference."""
    tables = [found.table(model) for model in found.models]
    rows: list[list[Any]] = []
    for every in zip(*tables, strict=True):
        first = every[0]
        mesh = 100.0 * first.mesh_error
        row = [f"{first.mode}{'' if first.below else ' *'}", first.shell]
        row.append("not converged" if np.isnan(mesh) else mesh)
        rows.append([*row, *(f"{_told(mode.error, 'lost')} ({mode.mac:.2f})" for mode in every)])
    return Table(
        ["mode", f"{found.result.attrs['reference']} (Hz)", "mesh (%)", *found.models],
        rows,
        f"Elastic modes of {against(found.result)}: frequency in the limit of fine meshes, and "
        "about how far it is off; errors of the models in % and, in parentheses, their MAC. "
        f"{'; '.join(legend(found))}.",
    )


def _told(error: float, otherwise: str) -> str:
    return percent(error).removesuffix(" %") if np.isfinite(error) else otherwise


def _notes(found: Fidelity) -> str:
    facts, name = found.result.attrs, against(found.result)
    notes = [
        f"{name.capitalize()} had the same pattern, sheet, creases, supports and masses. "
        f"{_meshes(found)} Modes are paired by their MAC at the nodes that both have, modes of "
        "nearly equal frequency as a space. Supports hold the same vertices in both."
    ]
    if facts["rigid"]:
        notes.append(f"{facts['rigid']} rigid motions that nothing resists are left out.")
    if "deflection" in found.result:
        far = float(found.result["deflection"])
        notes.append(
            f"Under the full forces, with the stiffness at rest, {name} would move by {far:.4g} m "
            "along the forces (mean, weighted by the forces)."
        )
    if "not_forces" in facts:
        notes.append(f"{facts['not_forces']}: no force, so it has no displacements to compare.")
    if "secant" in facts:
        notes.append(
            f"Superlinear hinges have the slope of an oscillation by {facts['secant']:g} degrees."
        )
    return "\n\n".join([*notes, *found.notes])


def _meshes(found: Fidelity) -> str:
    """Sentences on the meshes of the reference and its errors."""
    facts = found.result.attrs
    if facts["reference"] == SUPERELEMENTS:
        return (
            f"Panels were condensed on fine meshes with the shapes of level {facts['level']}; the "
            "errors are their own estimates, from other levels and meshes."
        )
    coarse, fine = (int(n) for n in facts["divisions"])
    if "vertex_radius" in facts:
        return (
            f"Its meshes had {coarse // 2}, {coarse} and {fine} divisions, graded toward vertices, "
            f"within {facts['vertex_radius']:g} m of which panels do not stretch "
            f"({facts['triangles']} triangles), and consistent mass; frequencies are extrapolated, "
            "and their errors estimated, with the order that these meshes show."
        )
    return (
        f"Its meshes had {coarse} and {fine} divisions of every edge ({facts['triangles']} "
        "triangles) and consistent mass; frequencies are extrapolated with the square of the mesh "
        "size, and their errors estimated with the order that these meshes show together with one "
        f"of {coarse // 2}."
    )
