"""A flat sheet of paper that its creases fold into a Miura-ori.

Run it to draw the animation of the gallery:  python examples/deployment.py docs/images
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import foldyn as fd


def compute() -> tuple[object, object]:
    """The shipped case and its motion."""
    case_file = fd.read_case(fd.studies.find_case("gallery/deployment"))
    return case_file.case(), case_file.run()


def distances(points: np.ndarray) -> np.ndarray:
    """Distances (m) between all pairs of points (n, 3)."""
    return np.linalg.norm(points[:, None] - points, axis=-1)[np.triu_indices(len(points), 1)]


def fold_angles(case, displacement) -> tuple[float, float]:
    """Mean fold angles (rad) of the creases along x and of those across."""
    structure = case.structure
    folds, _ = structure.dihedrals(displacement.to_numpy())
    x, y, _ = np.ptp(structure.nodes[structure.pattern.creases], axis=1).T
    along = x > y
    angles = np.abs(np.pi - folds)
    return float(angles[along].mean()), float(angles[~along].mean())


def check(motion) -> None:
    """The sheet is a Miura-ori in the end, moves as one on the way, and comes to rest."""
    case = fd.case_of(motion)
    goal = fd.patterns.miura(cells=(4, 4), a=0.025, b=0.025, panel_angle=60, dihedral=60)
    final = (case.structure.nodes + motion.displacement[-1].to_numpy())[: len(goal.vertices)]
    np.testing.assert_allclose(distances(final), distances(goal.vertices), rtol=1e-4)

    for time in (0.4, 0.6, 0.8):
        along, across = fold_angles(case, motion.displacement.sel(time=time, method="nearest"))
        ratio = np.tan(across / 2) / np.tan(along / 2)
        assert abs(ratio - np.cos(np.radians(60))) < 0.02, (time, ratio)

    still = motion.isel(time=-1)
    left = still.kinetic + still.strain_bars + still.strain_folds + still.strain_bends
    assert left < 1e-6 * motion.work.max()
    assert motion.attrs["energy_error"] < 1e-6


def draw(case, motion, folder: Path) -> None:
    """The animation of the deployment."""
    fd.plots.animate(case, motion, folder / "deployment.gif", frames=45, fps=12)


if __name__ == "__main__":
    deployed, result = compute()
    check(result)
    draw(deployed, result, Path(sys.argv[1] if len(sys.argv) > 1 else "."))
