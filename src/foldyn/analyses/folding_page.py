"""The page of a folding: its motion in three dimensions, its states and their accuracy."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

import numpy as np

from foldyn import plots
from foldyn.analyses.provenance import Call, cost_rows, inputs_table
from foldyn.plots.readings import evenly
from foldyn.report.page import write_report
from foldyn.report.sections import Heading, Picture, Section, Table, Text
from foldyn.results.contents import pattern_of
from foldyn.statics import Folding
from foldyn.viewer import stage

MOST_ROWS = 12
"""Largest number of states in the table."""


def write_folding_page(
    folding: Folding, path: str | PathLike[str], title: str, call: Call | None = None
) -> Path:
    """Write the page of a folding.

    Parameters
    ----------
    folding : Folding
    path : path-like
        File to write, in an existing directory.
    title : str
    call : Call, optional
        The command or call, and its cost.

    Returns
    -------
    pathlib.Path
        The file written.
    """
    way = folding.path
    begun = "the folded state" if folding.started_from == "folded" else "the pattern as it is"
    cost = cost_rows(way.attrs["foldyn_version"], call or Call())
    farthest = np.linalg.norm(way["displacement"].values[-1], axis=1).argmax()
    sections = [
        stage({"folding": way}, {}, title, [int(farthest)]),
        Heading("How it folds"),
        *(Text(f"{line[:1].upper()}{line[1:]}.") for line in folding.report().splitlines()),
        Picture(
            plots.draw_folding(folding),
            "States on the way, the first one in gray, with the smallest and largest angle by "
            "which mountains and valleys are folded.",
        ),
        _numbers(folding),
        Heading("How it was computed"),
        inputs_table([("starts from", begun), *cost]),
    ]
    return write_report(sections, path, title=title)


def _numbers(folding: Folding) -> Section:
    """Table of some states."""
    way = folding.path
    letters = np.array(pattern_of(way).assignments)
    turned = np.degrees(way["fold_angle"].values)
    kinds = {"mountains": letters == "M", "valleys": letters == "V"}
    columns = {"share of the way": way["share"].values}
    for name, is_one in kinds.items():
        if is_one.any():
            columns[f"{name} (degrees)"] = turned[:, is_one].mean(axis=1)
    columns["strain"] = way["strain"].values
    columns["bend (degrees)"] = np.degrees(way["bend"].values)
    shown = evenly(way, MOST_ROWS)
    return Table.of(
        {"state": shown, **{name: column[shown] for name, column in columns.items()}},
        "States: mean angles of the creases, valleys positive; the largest strain, and the largest "
        "turn within a panel",
    )
