"""The figure of air.md: how the added mass converges, and what it does to the specimen's modes.

`python docs/air_figure.py` writes images/added-mass.png.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

import foldyn as fd
from foldyn.linear import character
from foldyn.plots import style
from foldyn.studies.herkal.calibration import IN_AIR, shipped

IMAGES = Path(__file__).with_name("images")
PUBLISHED = {"square": (1.0, 0.579), "1 x 2": (2.0, 0.757), "1 x 10": (10.0, 0.947)}
ALONG = np.array([4, 6, 8, 12, 16, 20])


def error(ratio: float, coefficient: float, along: int) -> float:
    """Error of the mass of a rectangle of width 1 that moves normal to itself."""
    corners = [(0, 0), (1, 0), (1, ratio), (0, ratio)]
    plate = fd.discretize(
        fd.Pattern(corners, [(0, 1, 2, 3)]), fd.Sheet(1e9, 0.3, 1e-3, 700.0), preset="plate"
    )
    lift = np.tile([0.0, 0.0, 1.0], len(plate.nodes))
    added = fd.Case(plate, air=fd.Air(density=1.0, resolution=along)).added_mass()
    return 1.0 - float(lift @ (added @ lift)) / (coefficient * np.pi / 4.0 * ratio)


def main() -> None:
    """Draw both."""
    figure = style.new_figure(8.5, 3.4, "")
    left, right = figure.subplots(1, 2)
    style.frame(left, "boundary elements along an edge", "error of the added mass", "plates")
    for k, (name, published) in enumerate(PUBLISHED.items()):
        errors = [100.0 * error(*published, int(along)) for along in ALONG]
        left.loglog(ALONG, errors, "o-", color=style.CYCLE[k], markersize=4, label=name)
    left.loglog(ALONG, 160.0 / ALONG**2, "--", color=style.GRAY, label="order 2")
    left.set_xticks(ALONG, [str(n) for n in ALONG])
    left.set_yticks([0.3, 1, 3, 10], ["0.3 %", "1 %", "3 %", "10 %"])
    left.minorticks_off()
    left.legend(frameon=False)
    found = shipped("specimen-modes", IN_AIR).run("circumcenter")
    share = 100.0 * found["air_share"].values[:6]
    names = [f"{k}: {name}" for k, name in enumerate(character(found, "x")["name"].values[:6], 1)]
    style.frame(right, "share of the air in the modal mass (%)", "", "the specimen")
    right.barh(names, share, color=style.CYCLE[0])
    right.invert_yaxis()
    style.finish(figure).savefig(IMAGES / "added-mass.png", dpi=90)


if __name__ == "__main__":
    main()
