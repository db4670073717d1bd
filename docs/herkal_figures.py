"""Figures and tables of the page on the case studies, from a full study and one beyond the paper.

    foldyn study herkal --out STUDY
    python -m verification.herkal stiffnesses --out STIFFNESSES
    python docs/herkal_figures.py STUDY STIFFNESSES

writes images/herkal-*.png and specimen-test-*.png, and prints the tables in Markdown.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from PIL import Image

from foldyn import plots
from foldyn.report import Table
from foldyn.report.album import Album
from foldyn.studies.herkal import report
from foldyn.studies.herkal.claims import claims, paper_table
from foldyn.studies.herkal.runs import REFERENCE, reported
from foldyn.studies.herkal.specimen import page
from foldyn.studies.herkal.specimen.measured import Data
from foldyn.studies.herkal.study import FULL, RESULTS, Study
from verification.herkal import sensitivity_page, stiffnesses_page, variations
from verification.herkal.models import DISTRIBUTIONS, LABELS, WiderPlan
from verification.herkal.sensitivity import BEND_LAWS
from verification.herkal.stiffnesses_page import WiderStudy

IMAGES = Path(__file__).with_name("images")
SPECIMEN = {
    "shapes": "folds/data-1.png", "film": "film.png", "supports": "../../specimen-supports.png",
    "front": "../../specimen-front.png",
}  # fmt: skip
"""Figures of the study, from the folder of the specimen."""
WIDTH = 900  # pixels


def draw(study: Study, found: variations.Variations) -> None:
    """Write the two figures."""
    nodes, axis, _ = reported("case2")
    names = (REFERENCE, "panel", "circumcenter", "consistent")
    every = {LABELS[m]: study.result("case2", m, "motion") for m in names}
    motions = {name: motion for name, motion in every.items() if motion is not None}
    plots.plot_history(motions, nodes, axes=axis, max_frequency=5.0).savefig(
        IMAGES / "herkal-case2.png", dpi=100
    )
    models = (*DISTRIBUTIONS, sensitivity_page.TURNED)
    sensitivity_page.plot_sensitivity(found, models, paper_table()).savefig(
        IMAGES / "herkal-sensitivity.png", dpi=100
    )


def specimen(folder: Path) -> list[Table]:
    """Copy the specimen's figures, smaller; returns the tables of its part of the page."""
    for name, file in SPECIMEN.items():
        with Image.open(folder / RESULTS / "specimen" / file) as picture:
            picture.thumbnail((WIDTH, 10 * WIDTH))
            picture.convert("P", palette=Image.Palette.ADAPTIVE).save(
                IMAGES / f"specimen-test-{name}.png", optimize=True
            )
    parts = Study(FULL, folder, Data()).parts[1]
    told = page.sections(folder / RESULTS, parts, Album(folder))
    return [one for one in told if isinstance(one, Table)]


def table(header: Iterable[str], rows: Iterable[Iterable[Any]]) -> None:
    """Print a table."""
    titles = list(header)
    print(f"\n| {' | '.join(titles)} |\n|{'---|' * len(titles)}")
    for row in rows:
        cells = ["" if c is None else f"{c:.3g}" if isinstance(c, float) else str(c) for c in row]
        print(f"| {' | '.join(cells)} |")


def main(folder: Path, stiffnesses: Path) -> None:
    """Draw and print."""
    study, found = Study(FULL, folder), variations.read(variations.STORED)
    wider = WiderStudy(WiderPlan(), stiffnesses)
    assert found is not None
    draw(study, found)
    for case, row in wider.table().items():
        paper = [paper_table()[case].get(m) for m in row]
        table(
            [f"case {case[-1]}", *map(LABELS.__getitem__, row)],
            [["paper", *paper], ["here", *row.values()]],
        )
    table(
        ["claim", "paper or bound", "here", ""],
        [[v.target.what, v.asked, float(v.computed), v.word] for v in claims(study)],
    )
    for one in (
        report.rank_table(study),
        *(
            one
            for one in stiffnesses_page.sections(wider, Album(stiffnesses))
            if isinstance(one, Table)
        ),
        sensitivity_page.one_at_a_time(found),
        sensitivity_page.by_load(found),
        *(sensitivity_page.over_all(found, law) for law in BEND_LAWS),
        sensitivity_page.orientations(found),
        sensitivity_page.frequencies(found),
    ):
        table(one.header, one.rows)
    for one in specimen(folder):
        table(one.header, one.rows)
    print(f"\n{report.verdict(study)}\n\n{sensitivity_page.opinion(found)}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
