"""A Miura sheet as a material: Poisson's ratios and stiffness from folded to nearly flat."""

import matplotlib.pyplot as plt
import numpy as np

import foldyn as fd

sheet = fd.Sheet(3e9, 0.3, thickness=1e-4)
dihedrals = np.arange(20, 171, 10)  # degrees
angle = 60.0  # of the panels


def plate(dihedral):
    """The plate that is equivalent to the sheet."""
    pattern = fd.patterns.miura(a=0.03, b=0.03, panel_angle=angle, dihedral=dihedral)
    structure = fd.discretize(pattern, sheet, crease_stiffness=1e-4, fold_law="linear")
    return fd.effective(fd.UnitCell(fd.Case(structure)), check_model=False)  # up to 7 % off


plates = [plate(dihedral) for dihedral in dihedrals]
ratio, bent, modulus, bending = (
    np.array([getattr(found, name).values for found in plates])
    for name in ("poissons_ratio", "bending_poissons_ratio", "modulus", "bending_modulus")
)
# Schenk and Guest, PNAS 110, 2013: of rigid panels tilted by theta
theta = np.radians(180.0 - dihedrals) / 2.0
published = -((np.cos(theta) * np.tan(np.radians(angle))) ** 2)
print("largest difference:", abs(ratio[:, 0] / published - 1.0).max())
figure, (left, right) = plt.subplots(1, 2, figsize=(8.4, 3.6), layout="constrained")
left.plot(dihedrals, published, color="0.6", lw=4.0, label="rigid panels")
left.plot(dihedrals, ratio[:, 0], label="in the plane")
left.plot(dihedrals, bent[:, 0], label="in bending")
left.set(xlabel="dihedral (degrees)", ylabel="Poisson's ratio along x")
left.legend()
for k, axis in enumerate("xy"):
    right.semilogy(dihedrals, bending[:, k], label=f"along {axis}")
right.set(xlabel="dihedral (degrees)", ylabel="bending stiffness (N m)")
right.legend()
figure.savefig("miura-plate.png", dpi=75)
