"""Shared parts of analysis pages: figures in a folder, the structure, tables of results."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray

from foldyn import plots
from foldyn.cases import Case
from foldyn.linear import stresses
from foldyn.plots.law_charts import law_charts
from foldyn.report.sections import Charts, Heading, Picture, Section, Table, Text
from foldyn.shells import Shell
from foldyn.writing import whole

ByRule = Mapping[str, xarray.Dataset]
"""Results by mass rule."""
DPI = 150
PANELS = (
    "Superelements: each panel is a small shell, condensed onto shapes of its edges. They are "
    "linear about the rest state."
)
"""Description of superelements."""
MOST_NODES = 12
"""Largest number of nodes in one figure."""
MOST_PAIRS = 24
"""Largest number of pairs of panels in a table."""


class Album:
    """Figures of a page; each is also saved as a file in a folder.

    Parameters
    ----------
    folder : path
    form : {"png", "svg", "pdf"} or None
        File format of the figures; None draws none. A page shows only PNG figures.
    """

    def __init__(self, folder: str | Path, form: str | None = "png") -> None:
        self.folder, self.form = Path(folder), form
        self._stresses: dict[int, xarray.Dataset] = {}

    def stresses(self, result: xarray.Dataset) -> xarray.Dataset:
        """Stresses of a result of the page, which are found once."""
        if id(result) not in self._stresses:
            self._stresses[id(result)] = stresses(result)
        return self._stresses[id(result)]

    def figure(
        self, name: str, caption: str, draw: Callable[[], Any], *otherwise: Section
    ) -> list[Section]:
        """Draw a figure and write it to a file, if figures are asked for.

        Return its section for the page, or `otherwise` if the page cannot show it.
        """
        if self.form is None:
            return list(otherwise)
        path = self.folder / f"{name}.{self.form}"
        with whole(path) as part:
            draw().savefig(part, dpi=DPI)
        return [Picture(path, caption)] if self.form == "png" else list(otherwise)

    def structure(
        self, case: Case, caption: str = "The pattern with its nodes, supports and loads."
    ) -> list[Section]:
        """Draw the structure and its laws."""
        sections: list[Section] = [
            Heading("The structure"),
            *self.figure("structure", caption, lambda: plots.draw_structure(case)),
        ]
        made: Any = case.structure
        of_shell = made.bar_law is None
        laws = (
            "Constitutive curves: moment of a fold, over the whole crease, against the dihedral."
            if of_shell
            else "Constitutive curves: moment of a fold and of a bend against the dihedral, stress "
            "of a bar against its stretch."
        )
        if len(made.folds) or not of_shell:
            charts = Charts(law_charts(made), laws)
            sections += self.figure("laws", laws, lambda: plots.plot_laws(made), charts)
        if of_shell:
            sections.append(Text(PANELS if made.linear else described_shell(made)))
        return sections


def filled(sections: Iterable[Section]) -> list[Section]:
    """Drop headings that have no content below them."""
    listed = list(sections)
    return [
        section
        for section, after in zip(listed, [*listed[1:], Heading("")], strict=True)
        if not (isinstance(section, Heading) and isinstance(after, Heading))
    ]


def described_shell(shell: Shell) -> str:
    """Describe a shell in words."""
    return (
        "A shell: panels that stretch and bend as thin sheets, in "
        f"{len(shell.triangles)} triangles ({shell.options.divisions} divisions of every edge), "
        "turning against each other along exact creases. The sides of the triangles are not drawn. "
        "Runs with half and a quarter of the divisions show how far the numbers depend on the mesh."
    )


def shown_nodes(chosen: list[int], most: int = MOST_NODES) -> tuple[list[int], str]:
    """Nodes for a figure, and a remark if some are left out."""
    nodes = chosen[:most]
    return nodes, f" (the first {len(nodes)} of {len(chosen)})" if len(chosen) > len(nodes) else ""


def visible_scale(case: Case, result: xarray.Dataset) -> tuple[float, str]:
    """Scale that makes a small motion visible, at most 1000, and a remark on the scale."""
    largest = float(np.abs(result["displacement"].to_numpy()).max())
    wanted = 0.1 * case.structure.pattern.size / max(largest, 1e-30)
    steps = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0]
    scale = max((s for s in steps if s <= wanted), default=1.0)
    return scale, "" if scale == 1.0 else f", displacements enlarged {scale:g} times"


def listed(noun: str, numbers: Iterable[Any]) -> str:
    """Write numbers after their noun: "node 1", "nodes 1, 2"."""
    words = [str(number) for number in numbers]
    return f"{noun}{'' if len(words) == 1 else 's'} {', '.join(words)}"


def rules(results: ByRule) -> str:
    """Name the mass rules of results, for a caption."""
    return "all mass rules" if len(results) > 1 else f"mass rule {next(iter(results))}"


def by_mass_rule(
    results: ByRule, columns: Mapping[str, str | Callable[[xarray.Dataset], Any]], caption: str
) -> Table:
    """Table with a row for each mass rule; columns are attributes or functions of the result."""
    rows, asked = [], columns.values()
    for rule, result in results.items():
        cells = (result.attrs.get(of) if isinstance(of, str) else of(result) for of in asked)
        rows.append([rule, *cells])
    return Table(["mass rule", *columns], rows, caption, digits=3)


def computation(
    case_file: Any, results: ByRule, columns: Mapping[str, str | Callable[[xarray.Dataset], Any]]
) -> Table:
    """Table of the computations of a `CaseFile`, as `by_mass_rule`, with their times."""
    columns = {**columns, "time (s)": "wall_seconds"}
    return by_mass_rule(results, columns, f"{case_file.path.name}: the computation")


def releases(results: ByRule) -> list[Section]:
    """When supports and planes of motions or paths were released; empty if none were."""
    told = [(f"{rule}: " if len(results) > 1 else "", one) for rule, one in results.items()]
    given = [rule + one.attrs["releases"] for rule, one in told if one.attrs.get("releases")]
    return [Text(f"Released: {text}.") for text in given]


def crossing_panels(results: ByRule) -> list[Section]:
    """Table of panels that pass through each other in motions or paths; empty if none do."""
    rows, along = [], "time"
    for rule, result in results.items():
        if "crossing_panels" not in result:
            continue
        along = "time" if "time" in result else "load_factor"
        pairs, first = result["crossing_panels"].values, result["crossing_first"].values
        at = result[along].values[first]
        cells = zip(pairs.tolist(), first.tolist(), at.tolist(), strict=True)
        rows += [[rule, *pair, k, value] for pair, k, value in cells]
    if not rows:
        return []
    more = f"; the first {MOST_PAIRS} of {len(rows)}" if len(rows) > MOST_PAIRS else ""
    unit = "time (s)" if along == "time" else "load factor"
    caption = (
        "Panels that pass through each other, which nothing keeps them from, and where this was "
        f"seen first{more}"
    )
    return [Table(["mass rule", "panel", "and panel", "sample", unit], rows[:MOST_PAIRS], caption)]
