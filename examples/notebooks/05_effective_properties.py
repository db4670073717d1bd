# %% [markdown]
# # A folded sheet as a material
#
# A Miura sheet that is pulled grows across (its Poisson's ratio is negative), and bends
# to a saddle. How stiff is it, and how does that depend on how far it is folded?

# %%
# %matplotlib inline
import matplotlib.pyplot as plt
import numpy as np

import foldyn as fd

sheet = fd.Sheet(3e9, 0.3, thickness=1e-4)
angle = 60.0  # of the panels, degrees


def plate(dihedral):
    """The plate that is equivalent to the sheet."""
    pattern = fd.patterns.miura(a=0.03, b=0.03, panel_angle=angle, dihedral=dihedral)
    soft = {"crease_stiffness": 1e-4, "fold_law": "linear"}  # N/rad
    cell = fd.UnitCell(fd.Case(fd.discretize(pattern, sheet, **soft)))
    return fd.effective(cell, check_model=False)  # at most 7 % from superelements


plate(100)[["modulus", "poissons_ratio", "bending_modulus", "bending_poissons_ratio"]]

# %% [markdown]
# One solution of one cell has them all: stiffness per width in stretching (N/m) and
# bending (N m), along x and y, for a sheet that repeats without end.

# %%
dihedrals = np.arange(20, 171, 25)  # degrees
plates = [plate(dihedral) for dihedral in dihedrals]
ratio, bent, modulus = (
    np.array([one[name].values for one in plates])
    for name in ("poissons_ratio", "bending_poissons_ratio", "modulus")
)

# %% [markdown]
# ## Check
#
# For rigid panels that are tilted by $\theta$ out of the plane, Schenk and Guest (Proc.
# Natl. Acad. Sci. 110, 2013) have $\nu_x = -(\cos\theta \tan\gamma)^2$ with the panel
# angle $\gamma$, and in bending the opposite.

# %%
theta = np.radians(180.0 - dihedrals) / 2.0
published = -((np.cos(theta) * np.tan(np.radians(angle))) ** 2)
figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 3.6), layout="constrained")
left.plot(dihedrals, published, color="0.75", lw=5.0, label="rigid panels")
left.plot(dihedrals, ratio[:, 0], label="in the plane")
left.plot(dihedrals, bent[:, 0], label="in bending")
left.set(xlabel="dihedral (degrees)", ylabel="Poisson's ratio along x")
left.legend()
for k, axis in enumerate("xy"):
    right.semilogy(dihedrals, modulus[:, k], label=f"along {axis}")
right.set(xlabel="dihedral (degrees)", ylabel="stiffness in the plane (N/m)")
right.legend()
np.testing.assert_allclose(ratio[:, 0], published, rtol=2e-3)

# %% [markdown]
# Near the flat state panels bend before creases do, and the ratio in bending leaves the
# formula. Ratios along x and y are each other's inverse: the sheet has one way to fold.

# %%
np.testing.assert_allclose(bent[:4, 0], -published[:4], rtol=2e-3)  # up to 95 degrees
np.testing.assert_allclose(ratio[:, 0] * ratio[:, 1], 1.0, rtol=0.01)
off = bent[-1, 0] / -published[-1] - 1.0
print(f"at {dihedrals[-1]} degrees the ratio in bending is off by {100 * off:.1f} %")

# %% [markdown]
# See also: [effective properties](../effective.md), with beams that stand for chains
# and tubes.
