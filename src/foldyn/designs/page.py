"""The page of a design search: the design before and after, and the course of the search."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path

import numpy as np

from foldyn import plots
from foldyn.analyses import CaseFile
from foldyn.analyses.provenance import Call, cost_rows, inputs_table
from foldyn.cases import Case
from foldyn.designs.methods import METHODS
from foldyn.designs.result import Design
from foldyn.designs.run_design import Plan
from foldyn.errors import FoldynError
from foldyn.plots.design_charts import convergence_charts, slope_chart
from foldyn.report.album import Album
from foldyn.report.page import write_report
from foldyn.report.sections import Charts, Heading, Listing, Picture, Section, Table, Text, cell
from foldyn.viewer import Stage, stage
from foldyn.writing import whole

MOST_ROWS = 200
"""Largest number of parameter entries in a table."""
SHOWN = ("modes", "dynamics", "statics")
"""Kinds of analysis whose results a page shows in motion."""


def write_design(
    found: Design, plan: Plan, folder: str | Path, case_file: CaseFile, call: Call | None = None,
    figures: str | None = None,
) -> Path:  # fmt: skip
    """Write the page of a design into an existing folder; return its path.

    Parameters
    ----------
    found : Design
    plan : Plan
        Plan of the search.
    folder : path
    case_file : CaseFile
        The case file of the design.
    call : Call, optional
        The command or call, for the page.
    figures : {"png", "svg", "pdf"}, optional
        File format of figures; by default none are drawn.
    """
    album, evaluator = Album(folder, figures), plan.evaluator
    designs = {"after": found.parameters, "before": plan.space.values(plan.first)}
    cases = {}
    for name, values in designs.items():
        with suppress(FoldynError):  # the guess may not give a case
            cases[name] = evaluator.case(values)
    title = f"{case_file.heading}: a design"
    sections: list[Section | Stage] = []
    if case_file.analysis.kind in SHOWN:
        results = {name: evaluator.result(designs[name]) for name in cases}
        sections.append(stage(results, cases, title, case_file.output.nodes.tolist()))
    sections += [Heading("The best design"), Text(_verdict(found, plan)), _parameters(found, plan)]
    if found.constraints:
        sections.append(_constraints(found, plan))
    sections += [Heading("How the search went")]
    caption = "The objective, and the largest violation of a constraint, at each evaluation."
    charts = Charts(convergence_charts(found.history), caption)
    draw = partial(plots.plot_convergence, found.history)
    sections += album.figure("convergence", caption, draw, charts)
    sections += [_ends(found), *_failures(found)]
    if found.gradient:
        sections.append(Heading("What matters"))
        sections += _slopes(found, plan, cases["after"], Path(folder), figures)
    for name, case in cases.items():
        caption = f"The design {name} the search."
        sections += album.figure(name, caption, partial(plots.draw_structure, case))
    sections += [Heading("How it was computed"), inputs_table(_rows(found, plan, case_file, call))]
    if text := (case_file.text or case_file.path.read_text("utf-8")):
        sections.append(Listing(f"The case file {case_file.path.name}", text))
    return write_report(sections, Path(folder) / "report.html", title=title)


def _verdict(found: Design, plan: Plan) -> str:
    goal = "smallest" if plan.problem.sign > 0.0 else "largest"
    text = f"{plan.problem.objective.text} = {found.objective:.6g}, the {goal} that was found"
    if found.feasible:
        return f"{text}." if not found.constraints else f"{text}; all constraints hold."
    return f"{text}, but not all constraints hold: no design that was tried keeps them."


def _parameters(found: Design, plan: Plan) -> Table:
    """Table of all entries with their bounds, before and after."""
    space = plan.space
    after = np.concatenate([np.ravel(value) for value in found.parameters.values()])
    x = space.x(after)
    at = np.where(x < 1e-6, "lower bound", np.where(x > 1.0 - 1e-6, "upper bound", ""))
    columns = space.entries, space.lower, space.upper, plan.first, after, at.tolist()
    rows = [[*row] for row in zip(*columns, strict=True)]
    more = f" The first {MOST_ROWS} of {len(rows)}." if len(rows) > MOST_ROWS else ""
    caption = f"Parameters in the units of the case file.{more}"
    header = ["parameter", "from", "to", "before", "after", "at its"]
    return Table(header, rows[:MOST_ROWS], caption, digits=5)


def _constraints(found: Design, plan: Plan) -> Table:
    rows = []
    for one in plan.problem.constraints:
        left, right = one.left.value(found.measures), one.right.value(found.measures)
        amount = found.constraints[one.text]
        rows.append([one.text, left, right, None if amount == 0.0 else amount])
    measured = ", ".join(f"{name} = {value:.6g}" for name, value in found.measures.items())
    caption = f"Constraints at the best design; {measured}."
    return Table(["constraint", "left side", "right side", "violated by"], rows, caption, digits=6)


def _ends(found: Design) -> Table:
    rows = [
        [one.search + 1, cell(one.objective), cell(one.violation), one.feasible, one.evaluations,
         one.message] for one in found.ends
    ]  # fmt: skip
    header = ["search", "objective", "violation", "feasible", "evaluations", "why it ended"]
    beside = "Violations are relative to the constraint's size."
    return Table(header, rows, f"{found.evaluations} evaluations in all. {beside}", digits=6)


def _failures(found: Design) -> Iterator[Section]:
    """Designs that could not be computed, grouped by reason."""
    reasons = Counter(filter(None, found.history["failure"].values.tolist()))
    if reasons:
        rows = [[count, reason] for reason, count in reasons.items()]
        caption = "Designs that could not be computed; near them the search took shorter steps."
        yield Table(["designs", "why"], rows[:MOST_ROWS], caption)


def _slopes(
    found: Design, plan: Plan, case: Case, folder: Path, figures: str | None
) -> Iterator[Section]:
    """Sensitivity to each parameter; for arrays, also drawn on the sheet for each entry."""
    text = plan.problem.objective.text
    width = plan.space.values(plan.space.upper - plan.space.lower)
    slopes = {name: one * width[name] for name, one in found.gradient.items()}
    caption = (
        "Derivative of the objective with respect to each parameter at the best design, times the "
        "range of the parameter. For an array: the root of the sum of squares over its entries."
    )
    if len(slopes) > 1:
        yield Charts([slope_chart(slopes, text)], caption)
    counts = len(case.structure.pattern.creases), len(case.structure.pattern.faces)
    for name, one in slopes.items():
        if np.ndim(one) and len(found.gradient[name]) in counts:
            on = "crease" if len(found.gradient[name]) == counts[0] else "panel"
            label = f"d({text}) / d {name}"
            drawn = plots.draw_sensitivity(case, found.gradient[name], label=label)
            if figures is not None:
                with whole(folder / f"sensitivity-{name}.{figures}") as part:
                    drawn.savefig(part)
            yield Picture(drawn, f"Derivative of {text} by {name} of each {on}, per unit.")


def _rows(
    found: Design, plan: Plan, case_file: CaseFile, call: Call | None
) -> Iterator[tuple[str, str]]:
    """Facts about the computation."""
    facts = found.history.attrs
    yield "case file", case_file.path.name
    yield "analysis", case_file.analysis.kind
    goal = "minimize" if plan.problem.sign > 0.0 else "maximize"
    yield goal, plan.problem.objective.text
    yield "subject to", "; ".join(one.text for one in plan.problem.constraints)
    yield "method", f"{plan.method}: {METHODS[plan.method].doc}"
    yield "searches", f"{plan.searches}, seed {plan.settings.seed}"
    yield "tolerance", f"{plan.settings.tolerance:g}; slack of constraints {plan.settings.slack:g}"
    seconds = float(np.nansum(found.history["seconds"].values))
    yield from cost_rows(str(facts["foldyn_version"]), call or Call(), seconds)
