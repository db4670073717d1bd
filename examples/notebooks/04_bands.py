# %% [markdown]
# # Waves in a Miura sheet
#
# An endless sheet of one repeated cell lets waves pass in bands of frequencies, and
# stops them in gaps. Here a cell of four panels, 30 mm wide, is folded to a dihedral of
# 60 degrees.

# %%
# %matplotlib inline
import numpy as np

import foldyn as fd

pattern = fd.patterns.miura(a=0.03, b=0.03, panel_angle=60, dihedral=60)
sheet = fd.Sheet(3e9, 0.3, thickness=2.4e-4, density=1200.0, length_scale_ratio=10.0)
cell = fd.UnitCell(fd.Case(fd.superelements(pattern, sheet)))
cell

# %% [markdown]
# The pattern knows how it repeats. Superelements carry the vibrations of the panels
# themselves, with an estimate of the error of each frequency. `G`, `X`, `M` and `Y` are
# the corners of the Brillouin zone.

# %%
bands = fd.bands(cell, cell.path("G-X-M-Y-G", 33), count=8, shape=True)
gaps = fd.linear.band_gaps(bands).to_dataframe()
gaps[["direction", "below", "bottom", "top"]].round(0)  # Hz

# %% [markdown]
# One gap is full: between bands 4 and 5 nothing passes in any direction (`all`).

# %%
figure = fd.plots.plot_bands(bands)
figure.axes[0].set_ylim(0.0, 700.0)
figure

# %% [markdown]
# Click a point of a band, and its Bloch wave runs over several cells.

# %%
fd.view(bands)

# %% [markdown]
# ## Check: long waves
#
# Waves much longer than a cell see a plate. `fd.effective` finds its membrane stiffness
# $A$ and mass per area $\rho$ by stretching one cell, without any wave. Along x, a
# longitudinal wave then runs at $\sqrt{A_{xx,xx}/\rho}$, and a shear wave at
# $\sqrt{A_{xy,xy}/\rho}$. In `fd.effective` panels deform in more shapes than in bands,
# so that the sheet is softer by up to 1 %.

# %%
plate = fd.effective(cell)
stiffness = plate.membrane.values[[0, 2], [0, 2]]  # N/m
expected = np.sqrt(stiffness / float(plate.density))
phase = 0.02  # rad per cell
period = np.linalg.norm(cell.vectors[0])  # m
waves = fd.bands(cell, [[phase, 0.0]], count=3)
frequency = waves.frequency.values[0, 1:]  # Hz; the first wave bends the sheet
speed = 2 * np.pi * frequency * period / phase
print(f"m/s: waves {speed.round(1)}, plate {expected.round(1)}")
np.testing.assert_allclose(speed, expected, rtol=1e-2)

# %% [markdown]
# See also: [waves](../waves.md), [waves in finite chains](../wave-chains.md), and
# `examples/miura_bands.py`, where the gap closes as the sheet unfolds.
