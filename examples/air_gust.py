"""A gust throws a hinged flap over; then drag takes from its swings what it does by hand."""

import matplotlib.pyplot as plt
import numpy as np
from scipy.signal import argrelmax

import foldyn as fd

A, B, STIFFNESS = 0.06, 0.12, 0.004  # m, m, N m/rad
foam = fd.Sheet(youngs_modulus=1e7, poissons_ratio=0.2, thickness=3e-3, density=60.0)
corners = [(x * A, y * B) for x in (0, 1, 2) for y in (0, 1)]
pattern = fd.Pattern(corners, [(0, 2, 3, 1), (2, 4, 5, 3)])
laws = {"fold_law": "linear", "bend_law": "linear", "crease_stiffness": STIFFNESS / B}
structure = fd.discretize(pattern, foam, **laws)
gust = fd.Air(velocity=(0, 0, 4.0), history=fd.HalfSine(0.1), drag_coefficient=1.2)
case = fd.Case(structure, [fd.Fix([0, 1, 2, 3])], air=gust)
motion = fd.simulate(case, 1.5, method="central_difference", interval=0.002)
x, _, z = (structure.nodes[4] + motion.displacement.values[:, 4]).T
angle = np.arctan2(z, x - A)  # rad
# I phi'' + c |phi'| phi' + k phi = 0: half a swing takes 4/3 c/I phi^2 from its angle phi
modes = fd.modes(case.altered(air=fd.Air()), 1)
inertia = STIFFNESS / (2.0 * np.pi * modes.frequency.values[0]) ** 2
drag = 0.5 * gust.density * gust.drag_coefficient * B * A**4 / 4.0
size = np.abs(angle)
turns = argrelmax(size)[0][1:]  # after the gust
by_hand = [size[turns[0]]]
for _ in turns[1:]:
    by_hand.append(by_hand[-1] - 4.0 / 3.0 * drag / inertia * by_hand[-1] ** 2)
first, last, computed = np.degrees([size[turns[0]], size[turns[-1]], by_hand[-1]])
print(f"swings from {first:.1f} to {last:.2f} degrees, by hand {computed:.2f}")

figure, axes = plt.subplots(figsize=(6.5, 4.0), layout="constrained")
axes.plot(motion.time, np.degrees(angle), label="flap")
signed = np.degrees(np.sign(angle[turns]) * by_hand)
axes.plot(motion.time[turns], signed, "o", mfc="none", label="turns by hand")
axes.axvspan(0.0, 0.1, color="0.9", label="gust")
axes.set(xlabel="time (s)", ylabel="angle (degrees)")
axes.legend()
figure.savefig("air-gust.png", dpi=80)
