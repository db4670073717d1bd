# %% [markdown]
# # Stresses and margins: does a solar panel survive its launch?
#
# A folded panel of quasi-isotropic carbon fiber, 1.1 m long, is held by two rails. It
# must bear 20 g and the noise of a launch with a factor of safety of 1.5.

# %%
# %matplotlib inline
import warnings

import numpy as np

import foldyn as fd

G = 9.80665  # m/s2
cfrp = fd.Sheet(60e9, 0.3, thickness=2e-3, density=1600.0, strength=300e6)

# %% [markdown]
# ## Check: a strip
#
# First a strip with an answer from a textbook, clamped at one end, with a force $P$ on
# the other: halfway the bending moment per width is $PL/2b$ and the stress $3PL/bt^2$.

# %%
P, L, b = 1.0, 0.2, 0.05  # N, m, m
strip = fd.Pattern([(0, 0, 0), (L, 0, 0), (L, b, 0), (0, b, 0)], [(0, 1, 2, 3)])
clamped = fd.superelements(strip, cfrp, clamped=[(0, 3)])
tip = fd.Force([1, 2], (0, 0, P / 2))
bent = fd.trace(fd.Case(clamped, [fd.Fix([0, 3])], [tip]), steps=1)
center = fd.stresses(bent).isel(step=-1, point=0)
by_hand = 3 * P * L / (b * cfrp.thickness**2)
print(f"{center.von_mises[0] / 1e6:.2f} MPa, by hand {by_hand / 1e6:.2f} MPa")
np.testing.assert_allclose(center.von_mises, by_hand, rtol=0.01)

# %% [markdown]
# ## 20 g
#
# The margin is strength over stress and factor of safety, less 1. Creases bear 10 N m
# per meter.

# %%
pattern = fd.patterns.miura(cells=(3, 1), a=0.15, b=0.2, panel_angle=70, dihedral=130)
rails = [fd.Fix("xmin", along=True), fd.Fix("xmax", along=True)]
damping = fd.ModalDamping(0.02, count=100)
panel = fd.Case(fd.superelements(pattern, cfrp), rails, damping=damping)
bears = {"crease_strength": 10.0, "factor_of_safety": 1.5}  # N m per m

lifted = fd.trace(panel.altered(loads=[fd.Gravity((0, 0, -20 * G))]), steps=1)
static = fd.margins(lifted, **bears)
weight = lifted.reaction.isel(step=-1)[lifted.support_axis == "z"].sum()
np.testing.assert_allclose(weight, 20 * G * panel.mass.sum(), rtol=1e-6)
fd.plots.draw_stresses(fd.stresses(lifted).isel(step=-1))

# %% [markdown]
# ## Random vibration
#
# The base shakes by 0.04 g²/Hz up to 500 Hz. Three times the root mean square of the
# stress counts. Some modes are above 500 Hz, where this launch has ended; Foldyn warns
# of that.

# %%
warnings.simplefilter("ignore", fd.errors.ModelRangeWarning)
launch = fd.SpectralDensity([20, 80, 500], [0.01, 0.04, 0.04], "g2/Hz")
noise = fd.random_response(panel, base={"z": launch}, stresses=True)
random = fd.margins(noise, **bears)
print(f"first frequency {fd.modes(panel, count=1).frequency[0]:.1f} Hz")
for name, found in {"20 g": static, "noise": random}.items():
    least, where = found.attrs["least_margin"], found.attrs["least_where"]
    print(f"{name}: least margin {least:.2f} in {where}")
    assert least > 0.0
fd.plots.draw_stresses(random, "crease_margin")
