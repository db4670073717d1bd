"""The table of towers and large sheets with a radius at their vertices in shells.md, computed.

`python docs/vertex_radius_table.py` prints it, or some of its rows by number; all take up to
half an hour and 10 GB.
"""

from __future__ import annotations

import sys
import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

import foldyn as fd
from foldyn.algebra.extrapolation import convergence
from foldyn.errors import FoldynWarning
from foldyn.linear.mac import pairs
from foldyn.linear.reference import MeshModes, mesh_modes, same_modes
from foldyn.patterns import Pattern

MESHES = (8, 12, 16)
MODES = 6
SEEN = 0.01  # of the mean square of a shape: less at the vertices is a mode of panels alone
MODELS: dict[str, dict[str, Any]] = {
    "plate": {"preset": "plate", "membrane": "panel", "bar_law": "linear"},
    "n5b8e": {"preset": "n5b8e", "membrane": "panel", "bar_law": "linear"},
}


def tower() -> tuple[Pattern, str]:
    return fd.patterns.kresling(sides=6, radius=0.04, height=0.03, twist=30, storeys=4), "zmin"


def miura(cells: int, held: str) -> tuple[Pattern, str]:
    pattern = fd.patterns.miura((cells, cells), a=0.04, b=0.04, panel_angle=60, dihedral=110)
    return pattern, held


ENDS = "xmin or xmax"
ROWS = (
    ("tower", *tower(), 1e-3),
    ("tower", *tower(), 3e-4),
    ("3 x 3, both ends", *miura(3, ENDS), 3e-4),
    ("5 x 5, one end", *miura(5, "xmin"), 3e-4),
)


def shell_modes(pattern: Pattern, held: str, sheet: fd.Sheet, *mesh: Any) -> MeshModes:
    """Modes of a shell of some divisions and radius."""
    divisions, radius = mesh
    made = fd.shell(pattern, sheet, divisions=divisions, mass="consistent", vertex_radius=radius)
    return mesh_modes(fd.Case(made, [fd.Fix(held, along=True)]), MODES)


def errors(model: dict[str, Any], held: str, true: MeshModes, limit: NDArray) -> NDArray:
    """Relative errors of a model's frequencies, in modes that move the vertices."""
    pattern, sheet = true.structure.pattern, true.structure.sheet
    made = fd.discretize(pattern, sheet, **model, straight=held)
    found = mesh_modes(fd.Case(made, [fd.Fix(held, along=True)]), MODES)
    count, whole = len(pattern.vertices), true.shape[:MODES]
    shape, other = whole[:, :count], found.shape[:, :count]
    seen = (shape**2).mean(axis=(1, 2)) > SEEN * (whole**2).mean(axis=(1, 2))
    same = pairs(limit[seen], shape[seen], found.frequency, other, np.ones(count))
    return np.array([found.frequency[pair.second] / limit[seen][pair.first] - 1.0 for pair in same])


def row(name: str, pattern: Pattern, held: str, thickness: float) -> str:
    sheet = fd.Sheet(2e11, 0.3, thickness, density=7850.0)
    even = [shell_modes(pattern, held, sheet, n, None).frequency[0] for n in MESHES]
    graded = [shell_modes(pattern, held, sheet, n, thickness) for n in MESHES]
    values = same_modes(graded[-1], graded, MODES)
    found = convergence(values, MESHES)
    limit = np.where(np.isnan(found.limit), values[-1], found.limit)
    rank = np.argsort(limit, kind="stable")
    true = graded[-1]._replace(shape=graded[-1].shape[rank])
    cells = [
        f"{name}, {1e3 * thickness:g} mm",
        ", ".join(f"{each:.4g}" for each in even),
        ", ".join(f"{each.frequency[0]:.4g}" for each in graded),
        f"{found.limit[0]:.4g} ({found.order[0]:.1f})",
    ]
    for model in MODELS.values():
        off = 100 * errors(model, held, true, limit[rank])
        low, high = (round(each) + 0 for each in (off.min(), off.max()))
        cells.append(f"{low:+d} to {high:+d}")
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Print the rows."""
    warnings.simplefilter("ignore", FoldynWarning)
    chosen = [int(number) for number in sys.argv[1:]] or range(len(ROWS))
    for number in chosen:
        print(row(*ROWS[number]), flush=True)


if __name__ == "__main__":
    main()
