# %% [markdown]
# # Design: a tower that snaps on demand
#
# A [Kresling tower](03_snap_through.ipynb) snaps at a force and over a barrier of
# energy. Here both are given, and the lightest tower is wanted: which height, twist and
# thickness of the paper?

# %%
# %matplotlib inline
import warnings

import numpy as np

import foldyn as fd

warnings.simplefilter("ignore", fd.errors.StretchWarning)  # as in that notebook


def build(height, twist, thickness):
    """Tower of paper under 1 N on each corner of its top."""
    pattern = fd.patterns.kresling(6, 0.04, height=height, twist=twist)
    paper = fd.Sheet(1.219e9, 0.2, thickness, 667.0, length_scale_ratio=2.7)
    return fd.Case(
        fd.discretize(pattern, paper),
        supports=[fd.Fix("zmin")],
        loads=[fd.Force("zmax", (0, 0, -1))],
    )


until = {"node": 6, "axis": "z", "displacement": -0.036}  # m
snap = {"method": "arc_length", "first_step": 0.5, "steps": 300, "until": until}
guess = {"height": 0.06, "twist": 30.0, "thickness": 2.4e-4}  # m, degrees, m
before = fd.landscape(fd.trace(build(**guess), **snap))
print(f"guess: barrier {before.barrier():.3f} J")

# %% [markdown]
# Measures of the path are objective and constraints. Their derivatives are exact, those
# of limit loads and barriers too, so that the search needs few paths.

# %%
bounds = {"height": (0.05, 0.07), "twist": (24.0, 36.0), "thickness": (1e-4, 4e-4)}
best = fd.design(
    build,
    bounds,
    minimize="mass",
    subject_to=["limit_load == 3", "barrier == 0.12"],  # N on each corner, J
    analysis={"kind": "statics", **snap},
    guess=guess,
)
for name, value in best["parameters"].items():
    print(f"{name} {value:.4g}, guess {guess[name]:g}")
print(f"{1e3 * best['objective']:.2f} g after {best['evaluations']} evaluations")
assert best["feasible"]

# %% [markdown]
# The tower is as high as the bounds let it be.

# %%
case = build(**best["parameters"])
path = fd.trace(case, **snap)
fd.plots.plot_landscape(fd.landscape(path))

# %%
fd.plots.draw_shapes(case, path, points=3)

# %% [markdown]
# ## Check
#
# A test rig that moves the top down finds the same limit load.

# %%
rig = fd.Case(case.structure, [fd.Fix("zmin"), fd.Impose("zmax", "z", -0.01)])
pressed = fd.trace(rig, method="displacement", steps=40)
top = np.isin(pressed.support_node, range(6, 12))
force = -pressed.reaction.values[:, top].sum(axis=1)
print(f"limit load {force.max() / 6:.3f} N")
np.testing.assert_allclose(force.max() / 6, 3.0, rtol=2e-3)
