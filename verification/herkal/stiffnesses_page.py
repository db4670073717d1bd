"""Page on further models: their errors, static displacements, and the specimen."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from foldyn.report import Heading, Section, Table, Text, write_report
from foldyn.report.album import Album
from foldyn.report.sections import cell
from foldyn.structures.beyond_range import BELOW, plate_frequency
from foldyn.studies.herkal import report
from foldyn.studies.herkal.runs import BARS_AND_HINGES, REFERENCE, RULES, case_study
from foldyn.studies.herkal.specimen.page import NO_BREAK, ORDINALS
from foldyn.studies.herkal.study import RESULTS, Study
from foldyn.studies.herkal.targets import read_targets
from foldyn.studies.pool import Task
from foldyn.viewer import Stage
from verification.herkal import other_shell
from verification.herkal.stiffnesses import MESHES, OWN, PEAKED, Rows, Stiffness, tasks

# Models of the fidelity study, by the label of the equilibrium path they belong to.
SMALL = {f"{BARS_AND_HINGES}, linear bends": "standard", "plate": "plate", "n5b8e": "n5b8e"}
PATHS = (BARS_AND_HINGES, *SMALL)
LABELS = {OWN: "as filed (superlinear bends)", "standard": "standard, linear bends"}


@dataclass(frozen=True, eq=False)
class WiderStudy(Study):
    """The case studies with further models, and their stiffnesses; `plan` is a `WiderPlan`.

    Attributes
    ----------
    meshes : tuple of int
        Divisions of the shells for the specimen.
    """

    meshes: tuple[int, int] = MESHES

    def tasks(self) -> list[Task]:
        """All computations."""
        return [*self.plan.jobs(), *tasks(self.plan.cases, self.meshes)]

    def rows(self, kind: Any, of: str = "specimen") -> Rows | None:
        """Rows of a computation of `stiffnesses`, or None if missing."""
        return Stiffness(kind, of, self.meshes).result(self.folder / RESULTS)


def write(study: WiderStudy) -> Path:
    """Draw figures into the study's folder and write stiffnesses.html; return its path."""
    title = "The case studies of Herkal et al.: further models"
    page = study.folder / "stiffnesses.html"
    return write_report(sections(study, Album(study.folder)), page, title=title)


def sections(study: WiderStudy, album: Album) -> list[Section | Stage]:
    """Sections on what has been computed."""
    table = replace(
        report.table_1(study),
        caption="Mean error of the frequency content against the shell. Plate and n5b8e differ in "
        "stiffness, all others only in the distribution of the mass.",
    )
    found: list[Section | Stage] = [
        Heading("Models beyond the paper: plate and n5b8e"),
        Text(
            "The paper varies only the mass. Two of our models change the stiffness: in plate, "
            "panels bend and twist as plates, with the same nodes and a consistent mass; in n5b8e "
            "their edges give way too, and the mass follows the plate's shape. Both have linear "
            "bends, and nothing in them is fitted to this paper."
        ),
        *[table, report.rank_table(study), frequency_table(study), *other_shell.sections(study)],
        *[one for one in [_statics(study)] if one is not None],
        *specimen(study.rows("modes"), _peaks(study)),
    ]
    beyond = {m: label for m, label in study.plan.models.items() if m not in RULES}
    others = replace(study, plan=replace(study.plan, models=beyond))
    for case in study.plan.cases:
        found += report.case_sections(others, case, album)
    return found


def frequency_table(study: Study) -> Table:
    """Table of errors of the first frequencies, a measure without a load."""
    return Table(
        ["model", "error of low frequencies (%)", "of all (%)"],
        [
            [
                label,
                *(cell(100.0 * _frequency_error(study, m, up_to)) for up_to in (BELOW, math.inf)),
            ]
            for m, label in study.plan.models.items()
        ],
        "Mean absolute deviation from the shell's first five frequencies, for modes with a "
        f"partner. Low ones lie below {BELOW:g} of a free plate's frequency, above which the "
        "panels themselves vibrate.",
        digits=3,
    )


def _frequency_error(study: Study, model: str, up_to: float) -> float:
    """Mean error over the cases, for modes up to a multiple `up_to` of a free plate's frequency."""
    errors = []
    for case in study.plan.cases:
        found, file = study.frequencies(case, model), case_study(case)
        if found is not None:
            low = found.reference < up_to * plate_frequency(file.pattern, file.sheet)
            off = np.abs(found.deviation[low])
            errors.append(float(np.nanmean(off)) if np.isfinite(off).any() else math.nan)
    return float(np.nanmean(errors)) if np.isfinite(errors).any() else math.nan


# ---------------------------------------------------------------------- case studies
def displacements(study: Study, case: str) -> dict[str, float]:
    """Mean displacement (m) of the loaded nodes along the paper's loads, by path."""
    filed = case_study(case)
    force = np.sum([part for part, _ in filed.case(filed.masses[0]).load_terms], axis=0)
    return {
        label: float((path["displacement"].values[-1] * force[: path.sizes["node"]]).sum())
        / float(np.abs(force).sum())
        for label, path in study.paths(case).items()
    }


def _statics(study: WiderStudy) -> Table | None:
    rows: list[list[Any]] = []
    for case in study.plan.cases:
        small, large = study.rows("small-loads", case), displacements(study, case)
        if small:
            errors = [small[0].get(SMALL.get(name, "")) for name in PATHS]
            rows.append([case[-1], "small", 1e3 * small[0]["shell"], *map(_percent, errors)])
        if REFERENCE in large:
            errors = [
                large[name] / large[REFERENCE] - 1.0 if name in large else None for name in PATHS
            ]
            rows.append([case[-1], "paper's", 1e3 * large[REFERENCE], *map(_percent, errors)])
    if not rows:
        return None
    return Table(
        ["case", "loads", "shell (mm)", *PATHS],
        rows,
        "Static displacement of the loaded nodes along their load: under the paper's loads, and "
        "under small ones, scaled up (shell: extrapolated from 8 and 16 divisions). Bars and "
        "hinges have superlinear bends, without stiffness at rest, unless the column says linear.",
        digits=3,
    )


def _percent(error: float | None) -> str | None:
    return None if error is None else f"{100 * error:+.1f} %".replace(" ", NO_BREAK)


# ---------------------------------------------------------------------- the specimen
def _peaks(study: WiderStudy) -> dict[str, Rows]:
    found = {model: study.rows("peaks", model) for model in PEAKED}
    return {model: rows for model, rows in found.items() if rows}


def specimen(modes: Rows | None, peaks: Mapping[str, Rows]) -> list[Section]:
    """The paper's specimen by these models: modes compared with the shell, peaks with the paper."""
    found: list[Section] = [] if not modes else [_modes(modes)]
    return found if not peaks else [*found, _peak_table(peaks), Text(verdict(peaks))]


def _modes(modes: Rows) -> Table:
    models = list(dict.fromkeys(row["model"] for row in modes))
    of = {model: [row for row in modes if row["model"] == model] for model in models}
    first = of[models[0]]
    rows: list[list[Any]] = [["shell (Hz)", *[f"{row['shell']:.4g}" for row in first]]]
    for model, own in of.items():
        rows.append([LABELS.get(model, model), *map(_beside, own)])
    return Table(
        ["model", *[f"mode {row['mode']}" for row in first]],
        rows,
        "The paper specimen: first modes, with deviation from a shell (extrapolated from two "
        "meshes) and MAC. Bends as filed have the stiffness of turns of half a degree.",
    )


def _beside(row: Mapping[str, Any]) -> str:
    if row["frequency"] is None:
        return "none"
    deviation = 100 * (row["frequency"] / row["shell"] - 1)
    return f"{row['frequency']:.4g} ({deviation:+.1f} %, {row['mac']:.2f})".replace(" ", NO_BREAK)


def _measured() -> list[float]:
    paper = read_targets("specimen")
    return [paper[f"frf_{which}_peak"].value for which in ORDINALS]


def _deviations(rows: Rows) -> list[float]:
    """Deviations from the paper's peaks, in order; as many as the model has peaks."""
    return [row["frequency"] / f - 1.0 for row, f in zip(rows, _measured(), strict=False)]


def _peak_table(peaks: Mapping[str, Rows]) -> Table:
    rows: list[list[Any]] = [["paper's experiment", *[f"{f:g}" for f in _measured()]]]
    for model, found in peaks.items():
        cells = [
            f"{row['frequency']:.3g} ({100 * d:+.1f} %)".replace(" ", NO_BREAK)
            for row, d in zip(found, _deviations(found), strict=False)
        ]
        rows.append([LABELS.get(model, model), *cells, *[None] * (len(ORDINALS) - len(cells))])
    return Table(
        ["model", *[f"{which} peak" for which in ORDINALS]],
        rows,
        "The paper specimen: peaks (Hz) of a top corner's response to a sine of 1 mN on each top "
        "node, and their deviation from the paper's measurement.",
    )


def verdict(peaks: Mapping[str, Rows]) -> str:
    """Text on which model is closest to the experiment, to which none was fitted."""
    off = {
        model: float(np.abs(_deviations(rows)).mean())
        for model, rows in peaks.items()
        if len(rows) >= len(ORDINALS)
    }
    told = [f"{LABELS.get(model, model)} {100 * mean:.1f} %" for model, mean in off.items()]
    text = f"Mean deviation from the paper's three peaks: {', '.join(told)}." if told else ""
    others = [mean for model, mean in off.items() if model != OWN]
    if OWN in off and others:
        if off[OWN] < min(others):
            text += (
                " The model as filed is nearer to this experiment, although the others are nearer "
                "to a shell: at this amplitude superlinear bends are softer than plates, as the "
                "folded sheet seems to be."
            )
        else:
            text += " The models that are nearer to the shell are nearer to the experiment, too."
    missing = [LABELS.get(m, m) for m, rows in peaks.items() if len(rows) < len(ORDINALS)]
    if missing:
        text += f" Fewer than three peaks: {', '.join(missing)}."
    return text.strip()
