"""A Miura tube of cardboard with air inside: it opens and shortens, in both models."""

import matplotlib.pyplot as plt
import numpy as np

import foldyn as fd

pattern = fd.patterns.miura_tube(cells=2, a=0.05, b=0.05, panel_angle=60, dihedral=90)
cardboard = fd.Sheet(1.219e9, 0.2, 0.6e-3, density=667.0)
folds = {"fold_law": "linear", "crease_stiffness": 0.02}  # N m/rad of each crease
models = {
    "bars and hinges": fd.discretize(pattern, cardboard, **folds),
    "shell": fd.shell(pattern, cardboard, divisions=4, **folds),
}
seam, ridge, end = 2, 1, 16  # vertices: the other seam, the ridge, the far end
held = [fd.Fix([0], "xyz"), fd.Fix([seam], "z"), fd.Fix([end], "yz")]  # as a rigid body
factors = np.linspace(0.0, 1.0, 13) ** 2  # it moves most at first
figure, rows = plt.subplots(2, sharex=True, figsize=(6.5, 4.6), layout="constrained")
for name, structure in models.items():
    case = fd.Case(structure, held, [fd.Pressure(1000.0)])  # Pa; the ends are open
    settings = fd.statics.Settings(stability=False)
    path = fd.trace(case, load_factors=factors, settings=settings)
    position = structure.nodes + path.displacement.values
    length, height = position[:, end, 0], np.ptp(position[:, [ridge, 3], 2], axis=1)  # m
    print(f"{name}: {1e3 * length[-1]:.1f} mm long ({1e3 * length[0]:.1f} at rest)")
    rows[0].plot(path.load_factor, 1e3 * length, label=name)
    rows[1].plot(path.load_factor, 1e3 * height, label=name)
    if name == "bars and hinges":
        fd.plots.draw_shapes(case, path, points=[0, 6, -1]).savefig("pressure.png", dpi=80)
rows[0].set(ylabel="length (mm)")
rows[1].set(ylabel="height (mm)", xlabel="pressure (kPa)")
rows[0].legend()
figure.savefig("pressure-curve.png", dpi=80)
