"""Stretching panels: stiffness of held sheets, and a tower pressed to its snap-through.

    python -m verification.fidelity.stretching

prints both tables (about three minutes). Edges are held and moved along their whole length; the
shell has a vertex radius of its thickness, and results of two meshes are extrapolated.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.algebra.extrapolation import extrapolated
from foldyn.cases import Case, Fix, Impose
from foldyn.cases.clamped_edges import straightened
from foldyn.errors import FoldynWarning
from foldyn.patterns import Pattern, kresling, miura
from foldyn.shells import shell
from foldyn.statics import trace
from foldyn.structures import Sheet, discretize
from foldyn.structures.discretized import Discretized
from foldyn.structures.presets import resolved
from verification.fidelity.compare import markdown

MODELS: Mapping[str, Mapping[str, Any]] = {
    "standard": {"preset": "herkal", "bend_law": "linear"},
    "plate, bars": {"preset": "plate", "membrane": "bars"},
    "plate": {"preset": "plate"},
    "n5b8e": {"preset": "n5b8e"},
}
STEEL = Sheet(2e11, 0.3, 1e-3, density=7850.0)
SMALL = 1e-6  # m
PRESSED, STEPS = 8e-3, 16  # pressed distance (m), past the largest force; steps
ENDS = {"x": "compressed", "y": "sheared", "z": "moved across"}


class Held(NamedTuple):
    """A sheet between two rims: the vertices of both, and the guided axes of the second."""

    name: str
    pattern: Pattern
    sheet: Sheet
    rims: tuple[Sequence[int], Sequence[int]]
    led: str
    meshes: tuple[int, int]


def tower(thickness: float, meshes: tuple[int, int] = (8, 16)) -> Held:
    """A cell of a Kresling tower whose upper ring is free to turn."""
    pattern = kresling(sides=6, radius=0.04, height=0.06, twist=30, storeys=1)
    name = f"Kresling cell, {1e3 * thickness:g} mm"
    own = replace(STEEL, thickness=thickness)
    return Held(name, pattern, own, (range(6), range(6, 12)), "z", meshes)


def sheet(cells: int = 6, meshes: tuple[int, int] = (4, 8)) -> Held:
    """A Miura-ori between its zigzag edges, which do not turn."""
    pattern = miura(cells=(cells, cells), a=0.04, b=0.04, panel_angle=60, dihedral=110)
    step = 2 * cells + 1
    rims = range(step), range(2 * cells * step, (2 * cells + 1) * step)
    return Held(f"Miura-ori, {cells} x {cells} cells, 1 mm", pattern, STEEL, rims, "xyz", meshes)


def moved(held: Held, structure: Discretized, axis: str, way: float) -> Case:
    """One rim fixed, the other moved by a distance (m) along an axis."""
    near, far = (list(rim) for rim in held.rims)
    along = [Impose(far, led, way if led == axis else 0.0, along=True) for led in held.led]
    return Case(structure, [Fix(near, along=True), *along])


def structures(held: Held) -> dict[str, Discretized]:
    """All models of a sheet."""
    near, far = (list(rim) for rim in held.rims)
    rims = [Fix(near, along=True), Fix(far, held.led, along=True)]
    made: dict[str, Discretized] = {}
    for name, own in MODELS.items():
        straight = straightened(resolved(**own), held.pattern, rims)
        made[name] = discretize(held.pattern, held.sheet, **own, **straight)
    return made


def _errors(held: Held, measure: Callable[[Discretized], NDArray]) -> dict[str, NDArray]:
    """Value of the shell, and relative errors of the models by name."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)
        coarse, fine = (
            measure(
                shell(held.pattern, held.sheet, divisions=n, vertex_radius=held.sheet.thickness)
            )
            for n in held.meshes
        )
        true = extrapolated(coarse, fine, held.meshes[1] / held.meshes[0])
        found = {name: measure(s) / true - 1.0 for name, s in structures(held).items()}
    return {"shell": true, **found}


def stiffness(held: Held, axis: str) -> dict[str, NDArray]:
    """Stiffness (1,) for small displacements, N/m, of the shell, and errors of the models."""

    def measure(structure: Discretized) -> NDArray:
        path = trace(moved(held, structure, axis, SMALL), "displacement", steps=1)
        energy = sum(float(path[name][-1]) for name in structure.energy_groups)
        return np.array([2.0 * energy / SMALL**2])

    return _errors(held, measure)


def pressed(held: Held, way: float = PRESSED, steps: int = STEPS) -> dict[str, NDArray]:
    """Largest force (N) and final energy (J) of a pressed tower, by the shell, and errors."""

    def measure(structure: Discretized) -> NDArray:
        path = trace(moved(held, structure, "z", -way), "displacement", steps=steps)
        top = path.support_node.isin(np.flatnonzero(structure.nodes[:, 2] > 0.5 * way))
        force = path.reaction[:, (top & (path.support_axis == "z")).values].sum("support")
        energy = sum(float(path[name][-1]) for name in structure.energy_groups)
        return np.array([float(abs(force).max()), energy])

    return _errors(held, measure)


def _row(what: str, found: Mapping[str, NDArray], k: int, unit: str) -> list[str]:
    errors = [f"{100 * found[name][k]:+.1f} %" for name in MODELS]
    return [what, f"{found['shell'][k]:.3g} {unit}", *errors]


def tables() -> str:
    """Both tables in Markdown."""
    rows = []
    held = sheet()
    for axis, what in ENDS.items():
        rows.append(_row(f"{held.name}, {what}", stiffness(held, axis), 0, "N/m"))
    for held in (tower(1e-3), tower(3e-4)):
        rows.append(_row(f"{held.name}, pressed", stiffness(held, "z"), 0, "N/m"))
    held = tower(1e-3)
    found = pressed(held)
    rows.append(_row(f"{held.name}: force at which it snaps", found, 0, "N"))
    rows.append(_row(f"{held.name}: energy at {1e3 * PRESSED:g} mm", found, 1, "J"))
    return markdown(["", "shell", *MODELS], rows)


if __name__ == "__main__":
    print(tables())
    sys.exit(0)
