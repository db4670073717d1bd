"""Small loads: the paper's four case studies and a sheet of steel, by all models."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.algebra.extrapolation import extrapolated
from foldyn.analyses import read_case
from foldyn.cases import Case, Fix, Force
from foldyn.linear import modes
from foldyn.linear.fidelity import MODELS
from foldyn.linear.small_loads import small_loads
from foldyn.patterns import miura
from foldyn.shells import shell
from foldyn.structures import Sheet, discretize
from foldyn.structures.discretized import Discretized
from foldyn.studies import find_case

STUDIES = ("case1", "case2", "case3", "case4")
STEEL = Sheet(2e11, 0.3, 1e-4, density=7850.0)
MESHES = {"studies": (8, 16), "steel": (4, 8)}  # divisions of the shell meshes


class Softness(NamedTuple):
    """Displacement under small loads, with relative errors by model.

    Attributes
    ----------
    case : str
    shell : float
        Displacement of the loaded nodes along their load, by the shell, m.
    error : mapping of str to float
    """

    case: str
    shell: float
    error: Mapping[str, float]


def _extrapolated(values: Callable[[int], Any], meshes: tuple[int, int]) -> Any:
    coarse, fine = (np.asarray(values(n)) for n in meshes)
    return extrapolated(coarse, fine, meshes[1] / meshes[0])


def study(name: str) -> Softness:
    """One of the paper's case studies."""
    given = read_case(find_case(f"herkal/{name}")).case("circumcenter")
    pattern, sheet = given.structure.pattern, given.structure.sheet

    def of(structure: Discretized) -> float:
        return small_loads(replace(given, structure=structure)).displacement

    true = float(_extrapolated(lambda n: of(shell(pattern, sheet, divisions=n)), MESHES["studies"]))
    bars = {m: of(discretize(pattern, sheet, **o)) for m, o in MODELS.items()}
    return Softness(name, true, {model: found / true - 1.0 for model, found in bars.items()})


def steel_case(structure: Discretized) -> Case:
    """One side is held at its vertices; a force of 1 N, shared by the other side's, lifts it."""
    far = np.flatnonzero(
        structure.pattern.vertices[:, 0] > structure.pattern.vertices[:, 0].max() - 1e-6
    )
    return Case(structure, [Fix("xmin", "xyz")], [Force(far.tolist(), (0.0, 0.0, 1.0 / len(far)))])


def steel() -> tuple[Softness, NDArray, Mapping[str, NDArray]]:
    """A 3 x 5 Miura-ori of 0.1 mm steel with edges of 25 mm, one side held.

    Returns
    -------
    (Softness, ndarray, mapping)
        Softness at its tip; the first three frequencies of the shell (Hz), and of each model.
    """
    pattern = miura((3, 5), a=0.025, b=0.025, panel_angle=60, dihedral=60)

    def of(structure: Discretized) -> NDArray:
        case = steel_case(structure)
        return np.append(
            small_loads(case).displacement, modes(replace(case, loads=()), 3)["frequency"]
        )

    fine = _extrapolated(
        lambda n: of(shell(pattern, STEEL, divisions=n, mass="consistent")), MESHES["steel"]
    )
    bars = {m: of(discretize(pattern, STEEL, **o)) for m, o in MODELS.items()}
    error = {model: float(found[0] / fine[0] - 1.0) for model, found in bars.items()}
    frequency = {model: found[1:] for model, found in bars.items()}
    return Softness("steel", float(fine[0]), error), fine[1:], frequency


def statics_table() -> str:
    """Both tables in Markdown."""
    sheet, shell_frequency, frequency = steel()
    lines = [
        f"| | shell | {' | '.join(MODELS)} |",
        "|---|---|" + "---|" * len(MODELS),
    ]
    for found in [*map(study, STUDIES), sheet]:
        errors = " | ".join(f"{100 * value:+.1f} %" for value in found.error.values())
        lines.append(f"| {found.case} | {1e3 * found.shell:.4g} mm | {errors} |")
    for k, true in enumerate(shell_frequency):
        errors = " | ".join(f"{100 * (own[k] / true - 1):+.1f} %" for own in frequency.values())
        lines.append(f"| steel, mode {k + 1} | {true:.2f} Hz | {errors} |")
    return "\n".join(lines)
