"""Sixty creases whose stiffnesses give a sheet three frequencies that were asked for."""

import numpy as np

import foldyn as fd

PATTERN = fd.patterns.miura((3, 3), 0.025, b=0.025, panel_angle=62.0)
PAPER = fd.Sheet(1.219e9, 0.2, 0.24e-3, 667.0)
WANTED = {1: 26.0, 2: 30.0, 3: 42.0}  # Hz; those of equal creases are 24.9, 28.9 and 40.6


def build(stiffness):
    """Sheet with these stiffnesses of its creases, N/rad."""
    options = {"preset": "merlin2", "bend_law": "linear", "crease_stiffness": stiffness}
    return fd.Case(fd.discretize(PATTERN, PAPER, **options), [fd.Fix("xmin")])


equal, modes = np.full(len(PATTERN.creases), 0.02), {"kind": "modes", "count": 4}
best = fd.design(
    build,
    {"stiffness": (0.002, 0.2)},
    minimize=" + ".join(f"log(frequency[{k}] / {wanted}) ** 2" for k, wanted in WANTED.items()),
    analysis=modes,
    guess={"stiffness": equal},
    tolerance=1e-12,
)
print(best)
found = fd.sensitivity(build, {"stiffness": equal}, measures="frequency[1]", analysis=modes)
matters = equal * found["gradient_stiffness"].values[0]
figure = fd.plots.draw_sensitivity(
    build(equal),
    matters,
    label="Hz, to first order",
    title="Gain of the first frequency from twice the stiffness",
)
figure.savefig("design-which-crease.png", dpi=90)
change = np.log2(best["parameters"]["stiffness"] / equal)
figure = fd.plots.draw_sensitivity(build(equal), change, label="log2(stiffness / 0.02 N/rad)")
figure.savefig("design-creases.png", dpi=90)
