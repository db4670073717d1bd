"""Frequencies and shapes of bars and hinges beside those of the shell."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import FoldynWarning
from foldyn.structures import Structure, discretize
from foldyn.studies.fidelity.cases import FidelityCase
from foldyn.studies.fidelity.pairing import pairs
from foldyn.studies.fidelity.reference import BELOW, Reference, elastic, plate_frequency

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
}
"""Options of `discretize`; all bends are linear. `circumcenter` is refused on many panels, and is
`mixed_voronoi` on all others."""
COMPARED = 8  # modes of the shell, at most
SOUGHT = 18  # modes among which partners are sought
LEAST = 0.5  # MAC of a partner


class Row(NamedTuple):
    """A mode of the shell and its partner in a model.

    Attributes
    ----------
    mode : int
        Number of the elastic mode of the shell, from 1.
    shell : float
        Its frequency, Hz.
    over_plate : float
        The same over that of a free square plate whose side is the longest edge.
    error : float
        Relative error of the model's frequency; nan where no mode has a MAC of 0.5 or more.
    mac : float
    """

    mode: int
    shell: float
    over_plate: float
    error: float
    mac: float


def structure_of(case: FidelityCase, model: str) -> Structure:
    """Bars and hinges of a case; edges that are held stay straight in the scheme n5b8e."""
    options = dict(MODELS[model])
    if options.get("scheme") == "n5b8e":
        options["straight"] = case.held.edges
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)
        return discretize(case.pattern(), case.sheet, bend_law="linear", **options)


def compare(case: FidelityCase, true: Reference, model: str) -> list[Row]:
    """Modes of a case below the limit, by a model beside the shell."""
    structure = structure_of(case, model)
    frequency, shape = elastic(case, structure, SOUGHT)
    nodes = np.flatnonzero(true.seen[: len(structure.nodes)])
    mass = _weights(structure)[nodes]
    wanted = true.frequency[:COMPARED]
    found = pairs(wanted, true.shape[:COMPARED][:, nodes], frequency, shape[:, nodes], mass)
    limit = plate_frequency(case.pattern(), case.sheet)
    return [
        Row(
            pair.first + 1,
            float(wanted[pair.first]),
            float(wanted[pair.first] / limit),
            float(frequency[pair.second] / wanted[pair.first] - 1.0)
            if pair.mac >= LEAST
            else float("nan"),
            pair.mac,
        )
        for pair in found
        if wanted[pair.first] < BELOW * limit
    ]


def _weights(structure: Structure) -> NDArray:
    """Weights (n,) of the nodes in the MAC, the same for all mass rules."""
    return replace(structure, options=replace(structure.options, mass="mixed_voronoi")).nodal_mass
