# %% [markdown]
# # A deployable: winch, latches, and creases that open it
#
# A winch folds a sheet of polyester, latches catch its valleys at 80 degrees and hold
# it while the cable is slack. At 2.2 s they let go, and the creases open the sheet
# again.

# %%
# %matplotlib inline
import matplotlib.pyplot as plt
import numpy as np

import foldyn as fd

sheet = fd.Sheet(2.2e9, 0.35, thickness=4e-4, density=1270.0)
miura = fd.patterns.miura(cells=(3, 2), a=0.05, b=0.05, panel_angle=60, dihedral=120)
folds = {"crease_stiffness": 0.01, "fold_law": "linear"}  # N/rad
structure = fd.discretize(miura, sheet, preset="plate", **folds)

# %% [markdown]
# The cable runs over every other vertex of the middle line, along x, as over small
# pulleys. It is shortened by 35 % within a second, and paid out from 1.2 s on.

# %%
middle = [32, 22, 12, 2]
length = np.linalg.norm(np.diff(miura.vertices[middle], axis=0), axis=1).sum()  # m
wound = fd.Table([0.0, 1.0, 1.2, 1.7, 4.0], [0.0, 1.0, 1.0, -0.2, -0.2], smooth=True)
supports = [
    fd.Fix([middle[-1]]),
    fd.Fix("xmin", "x"),
    fd.Fix("zmin", "z"),
    fd.Cable(middle, 200.0, change=-0.35 * length, history=wound),  # EA = 200 N
    fd.Latch("valley", 80.0, stiffness=0.5, until=2.2),  # degrees, N m/rad per m, s
]
damping = [fd.Rayleigh(alpha=2.0), fd.CreaseDamping(2e-4)]
case = fd.Case(structure, supports, damping=damping)
motion = fd.simulate(case, duration=3.5, interval=0.01)
print(f"energy error {motion.attrs['energy_error']:.0e}")

# %%
fd.view(motion)

# %%
time, tension = motion.time.values, motion.tension.values[:, 0]  # s, N
size = np.ptp((motion.displacement + motion.rest_position).sel(axis="x").values, axis=1)
held = fd.latched(motion).values.sum(axis=1)
figure, rows = plt.subplots(3, 1, figsize=(7.0, 5.5), sharex=True, layout="constrained")
rows[0].plot(time, 1e3 * size)
rows[0].set(ylabel="length (mm)")
rows[1].plot(time, tension)
rows[1].set(ylabel="tension (N)")
rows[2].step(time, held, where="post")
rows[2].set(ylabel="latches that hold", xlabel="time (s)")
figure.align_ylabels()

# %% [markdown]
# ## Checks
#
# The work of the winch is the tension times the cable wound in, and at the end, open
# and at rest again, all of it has gone into damping and latches that opened. Halfway
# the cable is slack, and latches hold.

# %%
assert motion.attrs["energy_error"] < 1e-3
in_cable = 0.35 * length * wound.factor(time)
by_hand = np.sum(0.5 * (tension[1:] + tension[:-1]) * np.diff(in_cable))
work, lost = float(motion.work[-1]), float(motion.dissipated[-1])
print(f"work {1e3 * work:.2f} mJ, by hand {1e3 * by_hand:.2f}, lost {1e3 * lost:.2f}")
np.testing.assert_allclose(by_hand, work, rtol=0.02)
np.testing.assert_allclose(lost, work, rtol=2e-3)
halfway = np.searchsorted(time, 2.15)
assert tension[halfway] == 0.0
assert held[halfway] > 5
np.testing.assert_allclose(size[-1], size[0], rtol=1e-3)
