"""Does a solar panel survive its launch? Margins under 20 g, random vibration and a shock."""

import numpy as np

import foldyn as fd
from foldyn.signals import shock_spectrum

G = 9.80665
pattern = fd.patterns.miura(cells=(2, 1), a=0.2, b=0.2, panel_angle=70, dihedral=130)
# CFRP, quasi-isotropic, with a strength of 300 MPa
cfrp = fd.Sheet(60e9, 0.3, thickness=2e-3, density=1600.0, strength=300e6)
rails = [fd.Fix("xmin", along=True), fd.Fix("xmax", along=True)]
panel = fd.Case(fd.superelements(pattern, cfrp), rails, damping=fd.ModalDamping(0.02, count=100))
first = fd.modes(panel, count=1)
print(f"first frequency {first.frequency[0]:.1f} Hz, mass {panel.mass.sum():.2f} kg")

lifted = fd.trace(panel.altered(loads=[fd.Gravity((0, 0, -20 * G))]), steps=1)
launch = fd.SpectralDensity([20, 80, 500], [0.01, 0.04, 0.04], "g2/Hz")
noise = fd.random_response(panel, base={"z": launch}, stresses=True, reactions=True)
pulse = 40 * G * np.sin(np.linspace(0, np.pi, 111))  # 40 g, 11 ms
f = np.geomspace(5, 500, 200)
spectrum = shock_spectrum(pulse, dt=1e-4, frequency=f, damping_ratio=0.02)
shock = fd.spectrum_response(panel, {"z": spectrum}, stresses=True, reactions=True)

least = {}
for name, result in {"20 g": lifted, "launch noise": noise, "shock": shock}.items():
    margins = fd.margins(result, crease_strength=10.0, factor_of_safety=1.5)
    least[name] = margins.attrs["least_margin"]
    print(f"{name}: least margin {least[name]:.2f} in {margins.attrs['least_where']}")
    fd.plots.draw_stresses(margins).savefig(f"solar-panel-{name.replace(' ', '-')}.png", dpi=75)
print(f"on the rails {3 * noise.total_reaction_rms.sel(axis='z'):.0f} N in the noise (3 sigma)")
fd.plots.draw_stresses(noise).savefig("solar-panel.png", dpi=75)
