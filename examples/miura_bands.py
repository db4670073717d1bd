"""Waves in a Miura sheet: a gap between its bands that closes as the sheet unfolds."""

import matplotlib.pyplot as plt
import numpy as np

import foldyn as fd

sheet = fd.Sheet(3e9, 0.3, thickness=2.4e-4, density=1200.0, length_scale_ratio=10.0)
dihedrals = np.arange(30, 131, 10)  # degrees
below = 4  # number of the band below the gap


def cell(dihedral):
    """Four panels, which repeat along x and y."""
    pattern = fd.patterns.miura(a=0.03, b=0.03, panel_angle=60, dihedral=dihedral)
    return fd.UnitCell(fd.Case(fd.discretize(pattern, sheet, preset="plate")))


bottom, top = [], []
for dihedral in dihedrals:
    unit = cell(dihedral)
    frequency = np.sort(fd.bands(unit, unit.grid(16), count=below + 1).frequency.values)  # Hz
    bottom.append(frequency[:, below - 1].max())
    top.append(frequency[:, below].min())
folded = cell(60)
bands = fd.bands(folded, folded.path("G-X-M-Y-G", 121), count=8)
gaps = fd.linear.band_gaps(bands)
print(gaps.to_dataframe()[["direction", "below", "bottom", "top"]])
drawn = fd.plots.plot_bands(bands, title="dihedral 60°")
drawn.axes[0].set_ylim(0.0, 600.0)
drawn.savefig("miura-bands.png", dpi=75)

figure, axes = plt.subplots(figsize=(5.6, 3.6), layout="constrained")
axes.fill_between(dihedrals, bottom, top, np.array(top) > bottom, True, color="0.88", label="gap")
axes.plot(dihedrals, bottom, label=f"highest of band {below}")
axes.plot(dihedrals, top, label=f"lowest of band {below + 1}")
axes.set(xlabel="dihedral (degrees)", ylabel="frequency (Hz)")
axes.legend()
figure.savefig("miura-gap.png", dpi=75)
