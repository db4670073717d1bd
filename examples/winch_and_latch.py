"""A winch folds a sheet, latches hold it, and its creases open it again."""

import matplotlib.pyplot as plt
import numpy as np

import foldyn as fd

sheet = fd.Sheet(2.2e9, 0.35, thickness=4e-4, density=1270.0)  # polyester
miura = fd.patterns.miura(cells=(3, 2), a=0.05, b=0.05, panel_angle=60, dihedral=120)
structure = fd.discretize(miura, sheet, preset="plate", crease_stiffness=0.01, fold_law="linear")
middle = [5 * i + 2 for i in (6, 4, 2, 0)]  # every other vertex of the middle line, along x
x = miura.vertices
length = np.linalg.norm(np.diff(x[middle], axis=0), axis=1).sum()
wound = fd.Table([0.0, 1.0, 1.2, 1.7, 4.0], [0.0, 1.0, 1.0, -0.2, -0.2], smooth=True)
supports = [
    fd.Fix([middle[-1]]),
    fd.Fix("xmin", "x"),
    fd.Fix("zmin", "z"),
    fd.Cable(middle, stiffness=200.0, change=-0.35 * length, history=wound),
    fd.Latch("valley", 80.0, stiffness=0.5, until=2.2),
]
damping = [fd.Rayleigh(alpha=2.0), fd.CreaseDamping(2e-4)]
motion = fd.simulate(fd.Case(structure, supports, damping=damping), 3.5, interval=0.01)

time = motion.time.values
size = np.ptp((motion.displacement + motion.rest_position).sel(axis="x").values, axis=1)
held = fd.latched(motion).values.sum(axis=1)
figure, (above, below) = plt.subplots(2, 1, figsize=(6.4, 5.0), sharex=True, layout="constrained")
above.plot(time, 1e3 * size)
above.set(ylabel="length of the sheet (mm)")
for axes in (above, below):
    axes.fill_between(
        time, 0, 1, held > 0, color="0.92", transform=axes.get_xaxis_transform(), label="latched"
    )
below.plot(time, motion.tension[:, 0], label="tension of the cable (N)")
below.plot(time, 50.0 * motion.work, "--", label="work of the winch (in 20 mJ)")
below.set(xlabel="time (s)")
below.legend(loc="upper right")
figure.savefig("winch-and-latch.png", dpi=75)
