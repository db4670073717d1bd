"""Figures of the page on waves in chains, from a full study.

    python -m verification.waves --out FOLDER
    python docs/wave_chains_figures.py FOLDER

writes images/wave-chains-*.png. The first figure of the page is that of examples/kresling_chain.py.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from PIL import Image

from foldyn import plots
from foldyn.cases import BaseMotion, Case, Fix, PointMass
from foldyn.linear import UnitCell, attenuation, frf, transmission
from verification.waves.kresling import SIDES, Unit

IMAGES = Path(__file__).with_name("images")
COPIED = ("arrivals", "dispersion", "miura-gaps")
WIDTH = 760  # pixels
PAIRS, HEAVIER = 16, 4.0


def paired(cells: int, rings: int) -> Case:
    """A chain without creases in which every second plate is heavier."""
    unit = Unit(crease=0.0)
    plain = unit.case(unit.structure(2 * cells), range(rings))
    nodes = [node for r in range(1, rings, 2) for node in range(SIDES * r, SIDES * (r + 1))]
    more = PointMass(nodes, (HEAVIER - 1.0) * unit.two_dofs.mass[0, 0] / SIDES)
    return Case(plain.structure, plain.supports, masses=[*plain.masses, more])


def main(folder: Path) -> None:
    """Write the figures."""
    for name in COPIED:
        with Image.open(folder / f"{name}.png") as picture:
            picture.thumbnail((WIDTH, WIDTH))
            picture.convert("P", palette=Image.Palette.ADAPTIVE).save(
                IMAGES / f"wave-chains-{name}.png", optimize=True
            )
    case = paired(PAIRS, 2 * PAIRS + 1)
    held = Case(case.structure, [Fix(range(SIDES)), *case.supports[3:]], masses=case.masses)
    frequencies = np.linspace(36.0, 132.0, 193)
    cell = UnitCell(paired(1, 2))
    passed = transmission(frf(held, BaseMotion("z"), frequencies=frequencies), cell)
    figure = plots.plot_transmission(passed, attenuation(cell, frequencies))
    figure.savefig(IMAGES / "wave-chains-transmission.png", dpi=100)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
