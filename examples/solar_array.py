"""A solar array of 4 x 6 panels on a free satellite: springs open it, one cable holds it back."""

import matplotlib.pyplot as plt
import numpy as np

import foldyn as fd

side, half = 0.5, np.radians(12.0)  # the first column of panels is the hub
x, z = side * np.array([[-1, 0], *[[k * np.sin(half), k % 2 * np.cos(half)] for k in range(7)]]).T
points = [(a, side * j, c) for a, c in zip(x, z, strict=True) for j in range(5)]
corner = [5 * i + j for i in range(7) for j in range(4)]  # the first of each panel
panels = [(k, k + 5, k + 6, k + 1) for k in corner]
array = fd.Pattern(points, panels, welds=[(k, k + 5) for k in corner if k % 5])
cfrp = fd.Sheet(7e9, 0.3, thickness=4e-3, density=600.0)
open_ = {"valley": 190.0, "mountain": 170.0}  # degrees: springs push creases onto their stops
structure = fd.discretize(array, cfrp, crease_stiffness=0.1, crease_rest=open_, fold_law="linear")
cable = [5 * i + 2 for i in (1, 3, 5, 7, 6, 4, 2, 0)]  # along inner creases, back over outer ones
length = np.linalg.norm(np.diff(array.vertices[cable], axis=0), axis=1).sum()
motor = fd.Table([0, 2, 20, 24], [0, 0, 1, 1], smooth=True)
supports = [
    fd.Cable(cable, 1e3, pretension=1.1, change=13 * side - length, history=motor),
    fd.Latch("valley", 177.0, stiffness=5.0),
    fd.Latch("mountain", 183.0, stiffness=5.0),
    fd.Stop("all", 180.0, stiffness=20.0, damping=0.05),
]
satellite = fd.Case(structure, supports, damping=fd.CreaseDamping(0.1))
motion = fd.simulate(satellite, 24, method="energy_momentum", tolerance=1e-4, interval=0.1)

hub, held = fd.attitude(motion, panel=0), fd.latched(motion).sum("crease")
turn = np.degrees(hub.rotation.sel(axis="y"))
print(f"{int(held[-1])} of 24 creases latched, the hub turned by {float(turn[-1]):.2f} degrees")
named = {"turn of the hub (degrees)": turn, "cable (N)": motion.tension, "latched creases": held}
figure, axes = plt.subplots(3, figsize=(6.4, 6.0), sharex=True, layout="constrained")
for axis, (name, values) in zip(axes, named.items(), strict=True):
    axis.plot(motion.time, values)
    axis.set(ylabel=name, xlabel="time (s)" if axis is axes[-1] else "")
figure.savefig("solar-array.png", dpi=75)
fd.view(motion).save("solar-array.html")
fd.plots.animate(motion, path="solar-array.gif", frames=60, fps=12, view=(18.0, -65.0))
