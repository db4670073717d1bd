"""Folded boards of foam fall through air: terminal velocities against weight and drag by hand."""

import matplotlib.pyplot as plt
import numpy as np

import foldyn as fd

G, AIR = 9.81, fd.Air(drag_coefficient=1.2)
foam = fd.Sheet(youngs_modulus=3e7, poissons_ratio=0.2, thickness=4e-3, density=22.5)
speeds, by_hand = {}, {}
for dihedral in (180, 120, 90):
    # the ridge points down, so that the sheet falls without turning over
    pattern = fd.patterns.simple_fold(a=0.05, b=0.1, dihedral=dihedral)
    pattern = fd.Pattern(pattern.vertices * (1, -1, -1), pattern.faces)
    stiff = {"fold_law": "linear", "bend_law": "linear", "crease_stiffness": 10.0}
    structure = fd.discretize(pattern, foam, **stiff)
    case = fd.Case(structure, loads=[fd.Gravity((0, 0, -G))], air=AIR)
    motion = fd.simulate(case, 1.0, method="central_difference", interval=0.02)
    weights = structure.nodal_mass / structure.nodal_mass.sum()
    speeds[dihedral] = -motion.velocity.values[:, :, 2] @ weights  # m/s
    # each panel: 1/2 rho Cd A (v cos)^2 along its normal, which leans by the angle
    lean, area = np.radians(90 - dihedral / 2), 2 * 0.05 * 0.1
    drag = 0.5 * AIR.density * AIR.drag_coefficient * area * np.cos(lean) ** 3  # over v^2
    by_hand[dihedral] = np.sqrt(case.total_mass * G / drag)
    last, lost = speeds[dihedral][-1], float(motion.air[-1] / motion.work[-1])
    print(f"{dihedral} degrees: {last:.4f} m/s, by hand {by_hand[dihedral]:.4f}, {lost:.0%} lost")

figure, axes = plt.subplots(figsize=(6.5, 4.0), layout="constrained")
axes.plot(motion.time, G * motion.time, color="0.7", label="in vacuum")
for dihedral, speed in speeds.items():
    (line,) = axes.plot(motion.time, speed, label=f"{dihedral}°")
    axes.axhline(by_hand[dihedral], color=line.get_color(), linestyle="dotted")
axes.set(xlabel="time (s)", ylabel="speed (m/s)", ylim=(0.0, 2.4))
axes.legend(title="dihedral; dotted by hand")
figure.savefig("air-fall.png", dpi=80)
