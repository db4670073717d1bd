"""A stack of thick boards that falls shut: they come to rest on each other, a thickness apart.

Run it to print the table and draw the picture of docs/sheets.md:
python docs/stack_figures.py docs/images
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import foldyn as fd

BOARDS, WIDTH, LENGTH, THICKNESS = 5, 0.5, 0.8, 0.05  # m
OPEN = 40.0  # degrees between boards at first
FOAM = fd.Sheet(youngs_modulus=5e7, poissons_ratio=0.3, thickness=THICKNESS, density=60.0)
DURATION, SHOWN = 2.5, (0.0, 0.3, 2.5)  # s


def stack() -> fd.Pattern:
    """The boards, folded like an accordion above the lowest one, which is flat."""
    up = np.radians(OPEN) * (np.arange(BOARDS) % 2)
    way = np.where(np.arange(BOARDS) % 2, -1.0, 1.0)
    step = WIDTH * np.stack([way * np.cos(up), 0.0 * up, np.sin(up)], axis=1)
    low = np.vstack([np.zeros(3), np.cumsum(step, axis=0)])
    n = BOARDS + 1
    faces = [(k, k + 1, n + k + 1, n + k) for k in range(BOARDS)]
    letters = {(k, n + k): "V" if k % 2 else "M" for k in range(1, BOARDS)}
    thin = fd.Pattern(np.vstack([low, low + np.array([0.0, LENGTH, 0.0])]), faces, letters, "stack")
    return fd.thicken(thin, THICKNESS)


def compute() -> tuple[fd.Case, object]:
    """The case, and its motion."""
    structure = fd.discretize(
        stack(), FOAM, crease_stiffness=0.001, membrane="panel", preset="plate"
    )
    held = np.unique(structure.triangles[structure.triangle_panel == 0]).tolist()
    case = fd.Case(
        structure,
        supports=[fd.Fix(held)],
        loads=[fd.Gravity((0.0, 0.0, -9.81))],
        damping=fd.Rayleigh(alpha=6.0),
        contact=fd.Contact(),
    )
    return case, fd.simulate(case, DURATION, method="dormand_prince", interval=0.02)


def middles(case: fd.Case, u: np.ndarray) -> np.ndarray:
    """Mean height (m) of each board's middle surface."""
    term = case.contact_term
    z = (term.tables.rest + term.points(u))[:, 2]
    triangles, panel = term.tables.triangles, term.tables.panel
    return np.array([z[triangles[panel == k]].mean() for k in range(BOARDS)])


def check(motion) -> None:
    """Boards rest a thickness apart, and their energies balance."""
    apart = np.diff(middles(fd.case_of(motion), motion.displacement.to_numpy()[-1]))
    np.testing.assert_allclose(apart, THICKNESS, rtol=0.02)
    assert motion.attrs["energy_error"] < 1e-3


def draw(case: fd.Case, motion, folder: Path) -> None:
    """The boards as they stand, fall and lie."""
    states = [motion.displacement.sel(time=t, method="nearest").to_numpy() for t in SHOWN]
    figure = fd.plots.draw_boards(
        case, states, captions=[f"{t:g} s" for t in SHOWN], view=(8.0, -80.0)
    )
    figure.savefig(folder / "thick-contact.png", dpi=80)


if __name__ == "__main__":
    the_case, computed = compute()
    heights = middles(the_case, computed.displacement.to_numpy()[-1])
    print(
        f"boards lie {np.diff(heights)} m apart, energy error {computed.attrs['energy_error']:.1e}"
    )
    draw(the_case, computed, Path(sys.argv[1] if len(sys.argv) > 1 else "."))
    check(computed)
