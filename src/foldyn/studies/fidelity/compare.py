"""Frequencies and shapes of bars and hinges compared with the shell."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from math import nan
from typing import Any, NamedTuple

from foldyn.errors import FoldynWarning
from foldyn.linear.matched import SPARE, Shown, matched
from foldyn.linear.reference import DIVISIONS, Reference, modes_at_rest, reference_modes
from foldyn.shells import shell
from foldyn.structures import Structure, discretize
from foldyn.structures.plate_frequency import BELOW, plate_frequency
from foldyn.structures.presets import resolved
from foldyn.studies.fidelity.cases import FidelityCase

MODELS: Mapping[str, Mapping[str, Any]] = {
    "standard, mixed_voronoi": {"calibration": "standard", "mass": "mixed_voronoi"},
    "standard, consistent": {"calibration": "standard", "mass": "consistent"},
    "plate, consistent": {"calibration": "plate", "mass": "consistent"},
    "plate, bubble": {"calibration": "plate", "mass": "bubble"},
    "plate, mixed_voronoi": {"calibration": "plate", "mass": "mixed_voronoi"},
    "plate, inertia_exact": {"calibration": "plate", "mass": "inertia_exact"},
    "plate, consistent, n4b5": {"calibration": "plate", "mass": "consistent", "scheme": "n4b5"},
    "n5b8e, condensed": {"calibration": "plate", "mass": "condensed", "scheme": "n5b8e"},
    "n5b8e, bubble": {"calibration": "plate", "mass": "bubble", "scheme": "n5b8e"},
    "n5b8e, consistent": {"calibration": "plate", "mass": "consistent", "scheme": "n5b8e"},
    "plate, consistent, bars": {"preset": "plate", "membrane": "bars"},
    "n5b8e, condensed, bars": {"preset": "n5b8e", "membrane": "bars"},
}
"""Options of `discretize`; all bends are linear. `circumcenter` is refused on many panels, and is
`mixed_voronoi` on all others."""
COMPARED = 8  # modes of the shell, at most
FIRST = 5  # that are compared at any frequency
REFERENCE = 10  # computed modes of the shell


class Row(NamedTuple):
    """A mode of the shell and its partner in a model.

    Attributes
    ----------
    mode : int
        Number of the elastic mode of the shell, from 1.
    shell : float
        Its frequency, Hz.
    over_plate : float
        The same, relative to a free square plate with the longest edge as its side.
    error : float
        Relative error of the model's frequency; nan if no mode has a MAC of 0.5 or more.
    mac : float
    """

    mode: int
    shell: float
    over_plate: float
    error: float
    mac: float


def reference(case: FidelityCase) -> Reference:
    """Shell modes of a case, with frequencies extrapolated quadratically in the mesh size."""
    pattern, sheet = case.pattern(), case.sheet
    cases = [
        case.case(shell(pattern, sheet, divisions=n, mass="consistent"))
        for n in (DIVISIONS[0] // 2, *DIVISIONS)
    ]
    return reference_modes(cases, REFERENCE)


def structure_of(case: FidelityCase, model: str) -> Structure:
    """Bars and hinges of a case; held edges stay straight even if edges may bow."""
    options = {"bend_law": "linear", **case.options, **MODELS[model]}
    if resolved(**options).bowed:
        options["straight"] = case.held.edges
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)
        return discretize(case.pattern(), case.sheet, **options)


def compare(case: FidelityCase, true: Reference, model: str) -> list[Row]:
    """Compare a model's modes below the limit with the shell's."""
    rows = all_rows(case, true, model)
    return [row for row in rows if row.over_plate < BELOW]


def first_modes(case: FidelityCase, true: Reference, internal: int) -> list[Row]:
    """Compare the first modes by n5b8e with internal amplitudes with the shell's."""
    return all_rows(case, true, "n5b8e, condensed", FIRST, internal)


def all_rows(
    case: FidelityCase, true: Shown, model: str, count: int = COMPARED, internal: int = 0
) -> list[Row]:
    """Compare the first modes by a model with the shell's."""
    held = case.case(structure_of(case, model))
    limit = plate_frequency(case.pattern(), case.sheet)
    if not len(held.free_dofs):  # triangles between held edges
        return [Row(k, f, f / limit, nan, 0.0) for k, f in enumerate(true.frequency[:count], 1)]
    found = matched(true, count, held, modes_at_rest(held, count + SPARE, internal=internal))
    rows = zip(true.frequency, found.error, found.mac, strict=False)
    return [
        Row(k, float(shell), float(shell / limit), float(error), float(mac))
        for k, (shell, error, mac) in enumerate(rows, 1)
    ]
