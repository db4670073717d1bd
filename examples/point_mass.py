"""Weights on the tip of a folded sheet: frequencies fall as a cantilever's do."""

import numpy as np

import foldyn as fd

sheet = fd.Sheet(youngs_modulus=1e6, poissons_ratio=0.3, thickness=0.01, density=100.0)
pattern = fd.patterns.miura(cells=(2, 1))
structure = fd.discretize(pattern, sheet, clamped=[(0, 1), (1, 2)])
tip = [12, 13, 14]
push = fd.Force(tip, (0, 1, 0))  # N
added = np.array([0.0, 0.25, 1.0, 4.0])  # in parts of the sheet's mass
labels = {0.0: "sheet alone", 0.25: "a quarter of its mass added", 1.0: "its mass added"}
first, responses = [], {}
for part in added:
    weights = [fd.PointMass(tip, part * structure.total_mass / 3)] if part else []
    case = fd.Case(structure, [fd.Fix([0, 1, 2])], damping=fd.Rayleigh(0.01), masses=weights)
    first.append(float(fd.modes(case, count=1).frequency[0]))  # Hz
    response = fd.frf(case, [push], frequencies=np.linspace(0.0, 0.08, 401), method="direct")
    if part in labels:
        responses[labels[part]] = response
    if part == 1.0:
        fd.plots.draw_structure(case).savefig("point-mass.png", dpi=75)

# f = sqrt(k / (M + c m)) / 2 pi: 1 / f^2 is a line in M
slope, start = np.polyfit(added, 1.0 / np.square(first), 1)
share = start / slope
print("first frequencies", np.round(first, 4), f"Hz, share c of the sheet's mass {share:.3f}")
fd.plots.plot_frf(responses, [13], axes="y").savefig("point-mass-response.png", dpi=75)
