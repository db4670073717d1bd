"""Case study 1 of Herkal et al., a sheet struck by a pulse: as bars and hinges and as a shell."""

import numpy as np

import foldyn as fd

path = fd.studies.find_case("herkal/case1")
motions = {
    "shell": fd.read_case(path, model="shell", divisions=4).run(duration=5.0),
    "bars and hinges": fd.read_case(path).run("circumcenter", duration=5.0),
}
for name, motion in motions.items():
    x = motion.displacement.sel(node=0, axis="x").values  # m, a corner of the free edge
    print(f"{name}: largest displacement {1e3 * np.abs(x).max():.1f} mm,", end=" ")
    print(f"energy error {motion.attrs['energy_error']:.1e}")

figure = fd.plots.plot_history(motions, [0], axes="x", max_frequency=5.0)
figure.savefig("both-models.png", dpi=110)
