# %% [markdown]
# # Snap-through of a Kresling tower
#
# A hexagonal tower of paper, 60 mm high, is pressed down. Its triangles must stretch on
# the way to a second stable state, so it snaps. At which force, over which barrier, and
# where does it end?

# %%
# %matplotlib inline
import warnings

import numpy as np

import foldyn as fd

radius, height, twist = 0.04, 0.06, 30.0  # m, m, degrees
tower = fd.patterns.kresling(sides=6, radius=radius, height=height, twist=twist)
paper = fd.Sheet(1.219e9, 0.2, thickness=0.24e-3, density=667.0, length_scale_ratio=2.7)
structure = fd.discretize(tower, paper)
push = fd.Force("zmax", (0, 0, -1.0))  # N on each of six corners
case = fd.Case(structure, supports=[fd.Fix("zmin")], loads=[push])

# %% [markdown]
# Closed towers stretch more than the model is made for, and Foldyn warns of that:
# forces are 5 to 20 % off here, and the shell is the model for final numbers. Arc
# length follows the path through points that no dead weight can hold.

# %%
warnings.simplefilter("ignore", fd.errors.StretchWarning)
down = {"node": 6, "axis": "z", "displacement": -0.036}  # m
smooth = {"largest_turn": 3.0}  # degrees per step
how = {"first_step": 0.5, "steps": 300, "until": down, "settings": smooth}
path = fd.trace(case, method="arc_length", **how)
landscape = fd.landscape(path)
limit = float(path.load_factor[path.point == "limit"][0])
print(f"snaps at {limit:.2f} N on each corner, over {landscape.barrier():.3f} J")
fd.plots.plot_landscape(landscape)

# %% [markdown]
# Dashed parts of the path are unstable. Click in the chart to move the tower to that
# point.

# %%
fd.view(path)

# %% [markdown]
# ## Checks
#
# With all edges as long as at rest, a tower with the twist $p$ and the height $h$ has a
# second state with the twist $180° - 60° - p$ and the height
# $\sqrt{h^2 - 2R^2(\cos p + \cos(p + 60°))}$ (Cai, Zhang, Zhou and Feng, IASS-SLTE
# Symposium, 2014).

# %%
p = np.radians(twist)
closed = np.sqrt(height**2 - 2 * radius**2 * (np.cos(p) + np.cos(p + np.pi / 3)))
first, barrier, second = landscape.states
found = height - second.stroke
print(f"second state {1e3 * found:.2f} mm high, by formula {1e3 * closed:.2f} mm")
assert abs(found / closed - 1.0) < 0.01

# %% [markdown]
# A test rig moves the top instead. The largest force on the way is the limit load, and
# the work up to the barrier is its energy.

# %%
rig = fd.Case(structure, [fd.Fix("zmin"), fd.Impose("zmax", "z", -0.036)])
pressed = fd.trace(rig, method="displacement", steps=60)
top = np.isin(pressed.support_node, range(6, 12))
force = -pressed.reaction.values[:, top].sum(axis=1)
way = 0.036 * pressed.load_factor.values
work = np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(way)).max()
print(f"limit load: rig {force.max() / 6:.2f} N, arc length {limit:.2f} N")
print(f"work to the barrier {work:.4f} J, its energy {barrier.energy:.4f} J")
np.testing.assert_allclose(force.max() / 6, limit, rtol=0.01)
np.testing.assert_allclose(work, barrier.energy, rtol=0.02)

# %% [markdown]
# See also: [statics](../statics.md), and `examples/contact_tower.py`, where the tower
# is struck shut.
