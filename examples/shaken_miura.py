"""The paper specimen on a base that shakes ever harder: its resonance bends upward."""

import numpy as np

import foldyn as fd

pattern = fd.patterns.miura(cells=(4, 3), a=0.025, b=0.025, panel_angle=60, dihedral=39.2)
paper = fd.Sheet(1.219e9, 0.2, 0.24e-3, density=667.0, length_scale_ratio=2.7)
s = fd.discretize(pattern, paper, preset="plate")
held = [fd.Fix(range(56, 63), "x"), fd.Fix([59], "y"), fd.Fix([57, 59, 61], "z")]
middle = 8.5  # Hz, at which the base has the acceleration
curves = {}
for gravities in (0.01, 0.03, 0.06):
    size = gravities * 9.81 / (2.0 * np.pi * middle) ** 2  # m
    base = fd.BaseMotion("x", history=fd.Harmonic(middle), value=size)
    case = fd.Case(s, [*held, base], damping=fd.Rayleigh(alpha=4.0))
    coarse = {"longest_step": 0.2, "steps": 32}
    curve = fd.response_curve(case, (8.2, 9.4), harmonics=7, modes=6, **coarse)
    peak = curve.isel(point=int(curve.amplitude.values.argmax()))
    print(f"{gravities} g: {1e3 * float(peak.amplitude):.2f} mm", end=" ")
    print(f"at {float(peak.frequency):.2f} Hz, {float(peak.amplitude) / size:.1f} times the base")
    curves[f"{gravities} g"] = curve
fd.plots.plot_response_curve(curves).savefig("shaken-miura.png", dpi=80)
