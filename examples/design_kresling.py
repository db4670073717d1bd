"""A Kresling tower with a snap-through force and an energy barrier that were asked for."""

import foldyn as fd


def build(height, twist, thickness):
    """Tower under 1 N on each corner of its top."""
    pattern = fd.patterns.kresling(6, 0.04, height=height, twist=twist)
    paper = fd.Sheet(1.219e9, 0.2, thickness, 667.0, length_scale_ratio=2.7)
    tower = fd.discretize(pattern, paper, preset="merlin2")
    return fd.Case(tower, [fd.Fix("zmin")], [fd.Force("zmax", (0, 0, -1))])


snap = {
    "kind": "statics",
    "method": "arc_length",
    "first_step": 1.0,
    "steps": 300,
    "settings": {"largest_turn": 3.0},
    "until": {"node": 6, "axis": "z", "displacement": -0.036},
}
best = fd.design(
    build,
    {"height": (0.05, 0.07), "twist": (24.0, 36.0), "thickness": (1e-4, 4e-4)},
    minimize="mass",
    subject_to=["limit_load == 20", "barrier == 0.8"],  # N on each corner, J
    analysis=snap,
    guess={"height": 0.06, "twist": 30.0, "thickness": 2.4e-4},
)
print(best)

case = build(**best["parameters"])
arguments = {name: value for name, value in snap.items() if name != "kind"}
path = fd.trace(case, **arguments)
fd.plots.plot_landscape(fd.landscape(path)).savefig("design-kresling-landscape.png", dpi=90)
fd.plots.draw_shapes(case, path, points=3).savefig("design-kresling-shapes.png", dpi=80)
