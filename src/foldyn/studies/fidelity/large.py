"""Large loads: the paper's case studies, and single panels twisted far, by laws of the bends."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.analyses import read_case
from foldyn.cases import Case, Fix, Force, Impose
from foldyn.errors import FoldynWarning
from foldyn.patterns import Pattern
from foldyn.shells import shell
from foldyn.statics import trace
from foldyn.structures import Sheet, discretize
from foldyn.structures.discretized import Discretized
from foldyn.studies import find_case
from foldyn.studies.fidelity.statics import STUDIES

LAWS: Mapping[str, Mapping[str, Any]] = {
    "standard, superlinear": {"preset": "herkal"},
    "plate, linear": {"preset": "plate"},
    "n5b8e, linear": {"preset": "n5b8e"},
    "plate, plate_superlinear": {"preset": "plate", "bend_law": "plate_superlinear"},
}
"""Options of `discretize`: the models of the large loads and of the large motions."""
LOADS = (0.1, 1.0, 3.0)  # multiples of the paper's loads
TURNS = (1.0, 8.0, 35.0)  # lifts of a panel's corner over its thickness
PANELS = {"1 x 1, 60 degrees": (60.0, 1.0), "1 x 1.5, 75 degrees": (75.0, 1.5)}
SHEET = Sheet(1e6, 0.25, 0.01, density=1.0)
DIVISIONS = {"study": 12, "panel": 10}
NUDGE = 1e-6  # N on the center of a panel: decides which of its diagonals bends


def under_loads(name: str, factors: Sequence[float] = LOADS) -> dict[str, NDArray]:
    """Errors (k,) of the displacement of a case study under multiples of its loads, by law."""
    given = read_case(find_case(f"herkal/{name}")).case("circumcenter")
    pattern, sheet = given.structure.pattern, given.structure.sheet

    def moved(structure: Discretized) -> NDArray:
        case = replace(given, structure=structure)
        force = np.sum([p for p, _ in case.load_terms], axis=0)
        return np.einsum("sna,na->s", _paths(case, factors).displacement.values, force)

    true = moved(shell(pattern, sheet, divisions=DIVISIONS["study"]))
    return {law: moved(discretize(pattern, sheet, **o)) / true - 1.0 for law, o in LAWS.items()}


def twisted(angle: float, b: float, turns: Sequence[float] = TURNS) -> dict[str, NDArray]:
    """Errors (k,) of the force that lifts a corner of a panel, by law.

    Parameters
    ----------
    angle, b : float
        Acute angle (degrees) and second edge (m) of a parallelogram with a first edge of 1 m.
    turns : sequence of float
        Lifts of corner 2, relative to the thickness; the other corners stay on the ground.
    """
    c, s = b * np.cos(np.radians(angle)), b * np.sin(np.radians(angle))
    panel = Pattern([[0, 0], [1, 0], [1 + c, s], [c, s]], [[0, 1, 2, 3]])
    last = turns[-1] * SHEET.thickness

    def force(structure: Discretized) -> NDArray:
        middle = structure.nodes - structure.nodes[:4].mean(axis=0)
        center = int(np.linalg.norm(middle, axis=1).argmin())
        held = [Fix([0], "xyz"), Fix([1], "yz"), Fix([3], "z"), Impose([2], "z", last)]
        case = Case(structure, held, [Force([center], (0.0, 0.0, NUDGE))])
        path = _paths(case, [turn / turns[-1] for turn in turns])
        return path.reaction.values[:, path.support_node.values == 2][:, -1]

    true = force(shell(panel, SHEET, divisions=DIVISIONS["panel"]))
    return {law: force(discretize(panel, SHEET, **o)) / true - 1.0 for law, o in LAWS.items()}


def _paths(case: Case, factors: Sequence[float]) -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)
        return trace(case, "newton", load_factors=list(factors))


def large_table() -> str:
    """Both tables in Markdown."""
    heads = f"| | {' | '.join(LAWS)} |\n|---|" + "---|" * len(LAWS)
    rows = [(name, under_loads(name)) for name in STUDIES]
    rows += [(name, twisted(*panel)) for name, panel in PANELS.items()]
    lines = [heads]
    for name, errors in rows:
        cells = [", ".join(f"{100 * e:+.1f}" for e in found) + " %" for found in errors.values()]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines)
