"""A gripper of two bonded plastics, heated by 20 K: its four arms curl up."""

import numpy as np

import foldyn as fd

side, panels = 0.004, 10  # m; panels of an arm
squares = [(0, 0)]
squares += [(k * x, k * y) for x, y in ((1, 0), (0, 1), (-1, 0), (0, -1)) for k in range(1, 11)]
corners, faces = {}, []
for i, j in squares:
    around = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
    faces.append([corners.setdefault(corner, len(corners)) for corner in around])
cross = fd.Pattern([(side * (i - 0.5), side * (j - 0.5), 0.0) for i, j in corners], faces)

# thickness (m), Young's modulus (Pa), expansion (1/K), from the back to the front
layers = fd.Laminate([(60e-6, 1.0e9, 150e-6), (60e-6, 2.5e9, 20e-6)])
sheet = layers.sheet(poissons_ratio=0.35, areal_density=0.12)
joined = {
    "crease_stiffness": 100.0 * sheet.bending_modulus / side,
    "fold_law": "linear",
}  # no creases
structure = fd.discretize(cross, sheet, preset="n5b8e", **joined)
heat = fd.Temperature(20.0, layers.expansion, layers.curvature)
case = fd.Case(structure, [fd.Fix([0, 1, 2, 3])], [heat])
path = fd.trace(case, load_factors=np.linspace(0.0, 1.0, 9))

x = structure.pattern.vertices[:, 0]
lift = path.displacement.values[-1, np.flatnonzero(x == x.max()), 2].mean()  # m
curvature = 20.0 * layers.curvature
arc = (1.0 - np.cos(curvature * panels * side)) / curvature
print(f"20 K lift the arms by {1e3 * lift:.1f} mm, an arc of the free curvature {1e3 * arc:.1f} mm")
fd.plots.draw_shapes(case, path, points=[0, 4, -1]).savefig("bilayer.png", dpi=80)
