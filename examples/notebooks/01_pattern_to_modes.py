# %% [markdown]
# # From a crease pattern to modes
#
# A flat Miura-ori of polyester film is folded, held along one side, and vibrates. Which
# frequencies does it have, and how far can they be trusted?

# %%
# %matplotlib inline
import numpy as np

import foldyn as fd

# m, degrees
flat = fd.patterns.miura(cells=(3, 3), a=0.02, b=0.02, panel_angle=60, dihedral=180)
folding = fd.fold(flat, fraction="55%")
folding

# %% [markdown]
# Units are SI, angles that you type are in degrees. `fd.read_pattern` reads FOLD, SVG,
# OBJ, CP, OPX and DXF files in place of the generator. `rigid` means that panels stayed
# plane and unstrained on the way. The page plays the folding: drag to turn it, press
# Play or the space bar.

# %%
fd.view(folding)

# %% [markdown]
# The film is 0.19 mm thick. `discretize` turns each panel into bars and hinges that
# stretch, bend and give way at the creases as a thin plate does (model `n5b8e`).

# %%
film = fd.Sheet(4e9, poissons_ratio=0.38, thickness=0.19e-3, density=1390.0)  # SI
held = [fd.Fix("xmin")]  # the vertices on that side
case = fd.Case(fd.discretize(folding.pattern, film), held)
modes = fd.modes(case, count=6)
fd.plots.draw_modes(case, modes, which=[1, 2, 3, 4])

# %% [markdown]
# ## Check
#
# Superelements are panels condensed from a fine shell. They resolve what bars and
# hinges leave out, and state how large their own error is.

# %%
fine = fd.modes(fd.Case(fd.superelements(folding.pattern, film), held), count=6)
error = modes.frequency.values / fine.frequency.values - 1.0
for f, reference, e in zip(modes.frequency, fine.frequency, error, strict=True):
    print(f"{f:5.1f} Hz, superelements {reference:5.1f} Hz, {100 * e:+.1f} %")
stated = (fine.frequency_error / fine.frequency).max()
print(f"superelements state an error of {100 * stated:.1f} % at most")
assert abs(error).max() < 0.03

# %% [markdown]
# Twice the density must divide all frequencies by $\sqrt 2$.

# %%
heavy = fd.Sheet(4e9, 0.38, thickness=0.19e-3, density=2 * 1390.0)
slower = fd.modes(fd.Case(fd.discretize(folding.pattern, heavy), held), count=6)
np.testing.assert_allclose(slower.frequency, modes.frequency / np.sqrt(2.0), rtol=1e-6)

# %% [markdown]
# See also: [folding](../folding.md), [models](../models.md), [modes](../modes.md).
