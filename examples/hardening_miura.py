"""A Miura sheet hardens or softens as it swings, depending on how far it is folded."""

import matplotlib.pyplot as plt
import numpy as np

import foldyn as fd

sheet = fd.Sheet(3e9, 0.3, thickness=2.4e-4, density=1200.0, length_scale_ratio=10.0)
edge = 0.03  # m
dihedrals = np.array([50, 60, 70, 90, 100, 110, 120, 130, 140, 150])  # degrees


def case(dihedral):
    """Four panels: corners on a smooth floor, one side at a smooth wall."""
    pattern = fd.patterns.miura(cells=(1, 1), a=edge, b=edge, panel_angle=60, dihedral=dihedral)
    held = [fd.Fix([0, 1, 2], "x"), fd.Fix([0, 2, 6, 8], "z"), fd.Fix([1], "y")]
    return fd.Case(fd.discretize(pattern, sheet, preset="plate"), held)


modes = np.array([fd.modes(case(one), count=2).frequency.values for one in dihedrals])  # Hz
ends = (1e-3 * edge, 0.05 * edge)  # m
spines = [
    fd.backbone(case(one), 1, amplitudes=ends, harmonics=5, longest_step=0.3) for one in dihedrals
]
shifts = [float(one.frequency[-1] / one.frequency[0]) - 1.0 for one in spines]
print("shift of the frequency (%):", 100 * np.round(shifts, 5))
resonant = np.interp(2.0, modes[:, 1] / modes[:, 0], dihedrals)

figure, (left, right) = plt.subplots(1, 2, figsize=(8.4, 3.6), layout="constrained")
for spine, dihedral in zip(spines[::2], dihedrals[::2], strict=True):
    shift = spine.frequency / spine.frequency[0] - 1.0
    left.plot(100 * shift, 100 * spine.amplitude / edge, label=f"{dihedral}°")
left.set(xlabel="shift of the frequency (%)", ylabel="amplitude / edge (%)")
left.legend(title="dihedral")
right.plot(dihedrals, 100 * np.array(shifts), "o")
right.axvline(resonant, color="0.5", linestyle="--", label="mode 2 at twice mode 1")
right.set(xlabel="dihedral (degrees)", ylabel="shift at 5 % of the edge (%)")
right.legend()
figure.savefig("hardening-miura.png", dpi=75)
