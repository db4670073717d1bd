"""A Kresling tower of paper that snaps shut, bounces off its own panels and stays closed."""

import matplotlib.pyplot as plt
import numpy as np

import foldyn as fd

paper = fd.Sheet(1.219e9, 0.2, 0.24e-3, density=690.0, length_scale_ratio=2.7)
pattern = fd.patterns.kresling(sides=6, radius=0.04, height=0.06, twist=30)
structure = fd.discretize(pattern, paper, preset="n5b8e")
bottom, top = list(range(6)), list(range(6, 12))
stable = (60.0, 28.8)  # mm, heights of the two stable states
figure, axes = plt.subplots(figsize=(7.0, 3.2), layout="constrained")
heights, motions = {}, {}
for force in (38.0, 50.0, 80.0):  # N on each node of the top, for 20 ms
    case = fd.Case(
        structure,
        supports=[fd.Fix(bottom)],
        loads=[fd.Force(top, (0, 0, -force), fd.HalfSine(0.02))],
        damping=fd.Rayleigh(alpha=200.0),
        contact=fd.Contact(),
    )
    motion = motions[force] = fd.simulate(case, 0.2, method="auto", interval=2e-4)
    z = motion.displacement.sel(node=top, axis="z").mean("node").values
    heights[force] = 1e3 * (0.06 + z)  # mm
    axes.plot(1e3 * motion.time, heights[force], label=f"{force:g} N")
    print(f"{force:g} N: rests at {heights[force][-1]:.1f} mm", motion.attrs["energy_error"])
for height in stable:
    axes.axhline(height, color="0.6", linewidth=0.8, zorder=0)
axes.set(xlabel="time (ms)", ylabel="height of the top (mm)", xlim=(0, 100))
axes.legend()
figure.savefig("contact-tower.png", dpi=75)
closed = motion.displacement.values[np.argmax(motion.contact.values)]
picture = fd.plots.draw_structure(case, closed, numbers=False, loads=False)
picture.savefig("contact-closed.png", dpi=75)
