"""A folded cell whose resonance bends with the force until the response jumps."""

import foldyn as fd

pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=60)
s = fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.01, density=1.0), preset="plate")
held = [fd.Fix([0, 1, 2], "x"), fd.Fix([0, 2, 6, 8], "z"), fd.Fix([1], "y")]
curves = {}
for force in (5e-5, 1e-4, 2e-4):  # N
    push = fd.Force([5], (force, 0, 0), history=fd.Harmonic(0.6))
    case = fd.Case(s, held, [push], fd.Rayleigh(alpha=0.08))
    curve = fd.response_curve(case, (0.58, 0.66), harmonics=7, longest_step=0.2, steps=32)
    folds = curve.frequency.values[curve.bifurcation.values == "fold"]
    print(f"{1e3 * force:.2f} mN: largest swing {float(curve.amplitude.max()):.4f} m", end=", ")
    print(
        f"jumps at {folds.max():.4f} Hz up, {folds.min():.4f} Hz down" if folds.size else "smooth"
    )
    curves[f"{1e3 * force:g} mN"] = curve
spine = fd.backbone(case, mode=1, amplitudes=(1e-4, 0.06), harmonics=7)
fd.plots.plot_response_curve(curves, spine).savefig("response-curve.png", dpi=90)
