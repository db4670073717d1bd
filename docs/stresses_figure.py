"""The figure of stresses.md: `python -m docs.stresses_figure` writes images/stresses.png."""

from __future__ import annotations

from pathlib import Path

import foldyn as fd

IMAGES = Path(__file__).with_name("images")

if __name__ == "__main__":
    pattern = fd.patterns.miura(cells=(2, 2), a=0.2, b=0.2, panel_angle=70, dihedral=130)
    plate = fd.Sheet(60e9, 0.3, thickness=2e-3, density=1600.0)
    rails = [fd.Fix("xmin", along=True), fd.Fix("xmax", along=True)]
    load = fd.Gravity((0, 0, -20 * 9.81))
    path = fd.trace(fd.Case(fd.superelements(pattern, plate), rails, [load]), steps=1)
    fd.plots.draw_stresses(fd.stresses(path)).savefig(IMAGES / "stresses.png", dpi=110)
