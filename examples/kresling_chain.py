"""A chain of Kresling cells struck at one end: a rarefaction overtakes the compression."""

import numpy as np

import foldyn as fd

CELLS, SIDES = 64, 6
sheet = fd.Sheet(youngs_modulus=1.25e6, poissons_ratio=0.3, thickness=1e-3, density=140.0)


def chain(cells, plates):
    """A tower with rigid plates of 20 g, kept level, on some of its rings."""
    pattern = fd.patterns.kresling(SIDES, radius=0.05, height=0.04, twist=45, storeys=cells)
    tower = fd.discretize(
        pattern, sheet, mass="panel", calibration="standard", membrane="bars", bar_law="linear",
        fold_law="linear", crease_stiffness={"mountain": 0.01, "valley": 0.0},
    )  # fmt: skip
    supports, nodes = [], np.arange(SIDES * plates).reshape(plates, SIDES)
    for a, b, c, d, e, f in nodes.tolist():
        supports += [
            fd.Link([b, d, f], to=(a, c, e)),  # half of the ring rides on the other half
            fd.Link([a, c, e], axes="z"),
            fd.Spring(3e4, between=[(a, c), (c, e), (e, a)]),
        ]
    return fd.Case(tower, supports, masses=[fd.PointMass(nodes.ravel().tolist(), 0.02 / SIDES)])


cell, case = fd.UnitCell(chain(1, plates=1)), chain(CELLS, plates=CELLS + 1)
waves = fd.linear.long_waves(cell)
end = fd.linear.absorbing_end(case, f"z>{0.04 * CELLS - 1e-3}", waves=waves)
struck = np.where(case.structure.nodes[:, 2:] < 1e-3, (0.0, 0.0, 0.8), 0.0)  # m/s
case = fd.Case(case.structure, [*case.supports, *end], masses=case.masses)
start = fd.State(velocity=struck)
motion = fd.simulate(case, 1.6, method="rk4", dt=2e-4, interval=2e-3, initial=start)
strain = fd.linear.space_time(motion, cell)["strain"].values[:, :50]
for name, sign in (("compression", -1), ("rarefaction", 1)):
    speed = fd.signals.pulse(motion.time, strain, sign=sign, share=0.85).speed
    print(f"{name}: {speed:.1f} cells/s; slow long waves: {waves.speeds[0]:.1f}")
fd.plots.plot_space_time(motion, cell, quantity="strain").savefig("chain-impact.png", dpi=75)
