"""A ramp of thick boards folds shut: valleys hinge in the upper faces, mountains in the lower."""

import numpy as np

import foldyn as fd

boards, width, length, thickness = 6, 0.5, 0.8, 0.05  # m
x, n = width * np.arange(boards + 1), boards + 1
vertices = [(place, y) for y in (0.0, length) for place in x]
faces = [(k, k + 1, n + k + 1, n + k) for k in range(boards)]
letters = {(k, n + k): "V" if k % 2 else "M" for k in range(1, boards)}
ramp = fd.thicken(fd.Pattern(vertices, faces, letters, "ramp"), thickness)

plywood = fd.Sheet(youngs_modulus=8e9, poissons_ratio=0.3, thickness=thickness, density=600.0)
structure = fd.discretize(ramp, plywood)
fold = fd.Actuate("all", fraction="100%")  # all hinges by the same fraction, until faces touch
case = fd.Case(structure, [fd.Fix([0, 1, n])], [fold])
path = fd.trace(case, method="displacement", steps=20)

moved = (structure.nodes + path.displacement.values)[:, :n]
stack = moved[-1, -1] - moved[-1, 0]  # m: as high as the boards together
half = np.radians(90.0 * path.load_factor.values)
exact = 2.0 * (width * np.cos(half) + thickness * np.sin(half))  # distance of every second hinge
error = np.abs(np.linalg.norm(moved[:, 2] - moved[:, 0], axis=1) - exact).max()
print(f"closed: {stack[2]:.3f} m high; hinges are off by {error:.0e} m")

states = [0, 7, 14, 20]
captions = [f"fold angles {180 * float(path.load_factor[k]):.0f}°" for k in states]
figure = fd.plots.draw_boards(
    case, path.displacement.values[states], captions=captions, view=(14, -75)
)
figure.savefig("thick-panel.png", dpi=80)
