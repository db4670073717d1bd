"""The figure of waves.md: bands of a Miura sheet, and lines of one frequency of its first band.

`python docs/waves_figure.py` writes images/waves-bands.png.
"""

from __future__ import annotations

from pathlib import Path

import foldyn as fd

IMAGES = Path(__file__).with_name("images")


def main() -> None:
    """Draw the bands of the page's sheet with the directions of their waves."""
    pattern = fd.patterns.miura(a=0.03, b=0.03, panel_angle=60, dihedral=100)
    sheet = fd.Sheet(youngs_modulus=1e9, poissons_ratio=0.3, thickness=1e-3, density=1000.0)
    cell = fd.UnitCell(fd.Case(fd.discretize(pattern, sheet, preset="plate")))
    found = fd.bands(cell, cell.path("G-X-M-Y-G", 160), count=8, polarization=True)
    fd.plots.plot_bands(found).savefig(IMAGES / "waves-bands.png", dpi=90)


if __name__ == "__main__":
    main()
