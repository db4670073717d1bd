"""Which model of your own pattern to trust, and how far up: beside superelements."""

import foldyn as fd

pattern = fd.patterns.miura(cells=(2, 2), a=0.05, b=0.05, panel_angle=60, dihedral=90)
paper = fd.Sheet(youngs_modulus=2e9, poissons_ratio=0.3, thickness=3e-4, density=700)
structure = fd.discretize(pattern, paper)
case = fd.Case(structure, [fd.Fix("xmin")], [fd.Force("xmax", (0, 0, 1e-3))])
result = fd.fidelity(case, count=12)
print(result)
fd.plots.plot_fidelity(result).savefig("fidelity.png", dpi=90)
