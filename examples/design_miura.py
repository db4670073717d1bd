"""A Miura sheet whose first frequency is 12 Hz, and whose second is as high as it can be."""

from dataclasses import replace

import foldyn as fd


def build(panel_angle, dihedral, crease, bend):
    """Sheet held at one end; `bend` multiplies the stiffness of its panels."""
    pattern = fd.patterns.miura((3, 3), 0.025, b=0.025, panel_angle=panel_angle, dihedral=dihedral)
    paper = fd.Sheet(1.219e9, 0.2, 0.24e-3, 667.0)
    made = fd.discretize(
        pattern, paper, preset="merlin2", bend_law="linear", crease_stiffness=crease
    )
    softer = replace(made, bend_stiffness=bend * made.bend_stiffness)
    return fd.Case(softer, [fd.Fix("xmin")])


bounds = {"panel_angle": (45, 80), "dihedral": (60, 150), "crease": (5e-4, 0.1), "bend": (0.1, 3)}
best = fd.design(
    build,
    bounds,
    maximize="frequency[2] / frequency[1]",
    subject_to=["frequency[1] == 12"],
    analysis={"kind": "modes", "count": 4},
    searches=5,
    seed=1,
)
print(best)

case = build(**best["parameters"])
fd.plots.plot_convergence(best["history"]).savefig("design-miura-convergence.png", dpi=90)
fd.plots.draw_modes(case, fd.modes(case, count=2)).savefig("design-miura-modes.png", dpi=80)
