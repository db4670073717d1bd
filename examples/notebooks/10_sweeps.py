# %% [markdown]
# # Sweeps: which parameter decides?
#
# The first frequency of the paper specimen of Herkal, Nagarajaiah and Paulino, a
# Miura-ori of 4 x 3 cells: how does it change with folding and with softer creases, and
# which uncertain number decides it?

# %%
# %matplotlib inline
import numpy as np

import foldyn as fd

path = fd.studies.find_case("herkal/specimen-modes")
fd.read_case(path).case("consistent")

# %% [markdown]
# ## On a grid
#
# Any number of a case file can be varied. `processes=1` suits a notebook and small
# cases; by default a sweep takes all processors.

# %%
varied = {
    "pattern.dihedral": "25:60:8",  # degrees, eight values
    "sheet.length_scale_ratio": "1,3,8",  # creases are softer the larger it is
    "model.mass": "consistent",
}
how = {"measures": ["frequency[1]"], "processes": 1}
grid = fd.sweep(path, varied, **how)
lines = {"x": "dihedral", "by": "length_scale_ratio"}
fd.plots.plot_sweep_lines(grid, "frequency_1", **lines)

# %% [markdown]
# ## At random
#
# Say four numbers are known to some percent only. Points are drawn from their
# ranges, and a main effect is the mean over all other parameters: which of them should
# be measured better?

# %%
uncertain = {
    "sheet.length_scale_ratio": "2:4",
    "sheet.youngs_modulus": "1.1e9:1.35e9",  # Pa
    "sheet.thickness": "2.2e-4:2.6e-4",  # m
    "sheet.density": "640:700",  # kg/m3
    "model.mass": "consistent",
}
drawn = fd.sweep(path, uncertain, samples=64, method="sobol", **how)
fd.plots.plot_main_effects(drawn, "frequency_1")

# %% [markdown]
# ## Check
#
# Creases get their stiffness from the sheet, so frequencies go with $\sqrt{E/\rho}$
# exactly.

# %%
four_times = {
    "sheet.youngs_modulus": "1e9,4e9",
    "sheet.density": "200,800",
    "model.mass": "consistent",
}
found = fd.sweep(path, four_times, **how)
found = found.frequency_1.squeeze()
print(found.values.round(3), "Hz")
np.testing.assert_allclose(found / found[0, 0], [[1.0, 0.5], [2.0, 1.0]], rtol=1e-6)
