"""A large, light sheet that its creases unfold, in vacuum and in air, which it pushes aside."""

import matplotlib.pyplot as plt
import numpy as np

import foldyn as fd

foam = fd.Sheet(youngs_modulus=4e6, poissons_ratio=0.2, thickness=0.01, density=8.0)
pattern = fd.patterns.miura(cells=(2, 2), a=0.25, b=0.25, panel_angle=60, dihedral=60)
laws = {"fold_law": "linear", "bend_law": "linear", "crease_stiffness": 0.01}
structure = fd.discretize(pattern, foam, **laws)
unfold = fd.Actuate("all", angle=110.0)  # at once
fluids = {"vacuum": None, "air, drag alone": fd.Air(added_mass=False), "air": fd.Air(resolution=2)}
motions = {}
figure, axes = plt.subplots(figsize=(6.5, 4.0), layout="constrained")
for name, fluid in fluids.items():
    case = fd.Case(structure, loads=[unfold], air=fluid)
    motions[name] = motion = fd.simulate(case, 0.4, method="central_difference", interval=0.005)
    length = np.ptp(structure.nodes[:, 0] + motion.displacement.values[:, :, 0], axis=1)
    when = np.interp(0.8, length[: length.argmax()], motion.time[: length.argmax()])
    taken = 0.0 if fluid is None else float(motion.air[-1])
    print(f"{name}: 0.8 m long after {1e3 * when:.0f} ms, {1e3 * taken:.1f} mJ lost to the air")
    axes.plot(motion.time, length, label=name)
axes.set(xlabel="time (s)", ylabel="length (m)")
axes.legend()
figure.savefig("air-deployment.png", dpi=80)
