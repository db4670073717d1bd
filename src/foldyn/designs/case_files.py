"""A design search as specified by the [design] table of a case file."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

import foldyn
from foldyn.analyses import CaseFile
from foldyn.analyses.keys import files_moved, replaced, value_at
from foldyn.analyses.reading import case_of_document, read_document
from foldyn.designs.run_design import Plan, plan_of
from foldyn.errors import InputError
from foldyn.writing import write_text


def planned(path: Path, changes: Mapping[str, Any]) -> tuple[CaseFile, Plan]:
    """Read a case file and the search that its [design] table specifies.

    changes : values that override keys of the table.

    Raises
    ------
    InputError
        The table is missing, or something in it cannot be used.
    """
    document = read_document(path)
    case_file = case_of_document(path, document)
    if case_file.design is None:
        raise InputError(
            ': missing; say what may change and what is wanted, as in [design] minimize = "mass", '
            'subject_to = ["frequency[1] >= 12"], [design.bounds] "sheet.thickness" = [1e-4, 1e-3]',
            "design",
            path,
        )
    asked = case_file.design.values() | dict(changes)
    asked["guess"] = _guesses(document, asked["bounds"]) | (asked["guess"] or {})
    try:
        return case_file, plan_of(path, analysis=None, **asked)
    except InputError as error:
        if error.file is not None:  # an error in the case of the first design
            raise
        raise error.within("design.", path) from None


def _guesses(document: Mapping[str, Any], bounds: Mapping[str, Any]) -> dict[str, Any]:
    """Values from the file, if they are within their bounds."""
    found = {}
    for key, pair in bounds.items():
        value = value_at(document, key)
        try:
            lower, upper = (np.asarray(end, float) for end in pair)
            inside = np.all((lower <= np.asarray(value, float)) & (np.asarray(value) <= upper))
        except (TypeError, ValueError):  # plan_of reports the error
            continue
        if inside and value is not None:
            found[key] = value
    return found


def write_case(case_file: CaseFile, parameters: Mapping[str, Any], path: Path) -> None:
    """Write a case file with the values found; paths in it become relative to the new location."""
    plain = {key: np.asarray(value).tolist() for key, value in parameters.items()}
    document = replaced(read_document(case_file.path), plain)
    way = os.path.relpath(case_file.path.parent.resolve(), path.parent.resolve())
    text = f"# Designed by Foldyn {foldyn.__version__} from {case_file.path.name}.\n"
    write_text(path, text + tomli_w.dumps(files_moved(document, way)))
