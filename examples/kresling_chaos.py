"""A bistable tower, shaken: it stays in one state, jumps without order, or jumps in each cycle."""

import matplotlib.pyplot as plt

import foldyn as fd

pattern = fd.patterns.kresling(sides=6, radius=0.04, height=0.06, twist=30)
paper = fd.Sheet(1.219e9, 0.2, 0.24e-3, density=667.0, length_scale_ratio=2.7)
top, period = range(6, 12), 1.0 / 8.0  # s
case = fd.Case(
    fd.discretize(pattern, paper, preset="n5b8e"),
    [fd.Fix(range(6))],
    damping=fd.Rayleigh(alpha=40.0),
    masses=[fd.PointMass(top, 0.05)],
)
rows = {"sharex": "row", "sharey": "row"}
figure, axes = plt.subplots(2, 3, figsize=(9.0, 5.4), layout="constrained", **rows)
heights, exponents = {}, {}
for force, (above, below) in zip((4.0, 7.0, 8.0), axes.T, strict=True):  # N, on each corner
    push = fd.Force(top, (0, 0, force), history=fd.Harmonic(1.0 / period))
    shaken = case.altered(loads=[push])
    motion = fd.simulate(shaken, 160 * period, method="rk4", interval=period / 32)
    steady = motion.isel(time=slice(32 * 40, None))  # transients have died away
    z = 60.0 + 1e3 * steady.displacement.sel(node=6, axis="z").values  # mm
    speed = steady.velocity.sel(node=6, axis="z").values  # m/s
    found = fd.lyapunov_exponent(shaken, 160 * period, settle=40 * period, method="rk4")
    print(f"{force} N: height {z.min():.1f} to {z.max():.1f} mm", end=", ")
    print(f"largest exponent {float(found.exponent):.1f} 1/s")
    above.plot(steady.time[:640], z[:640], linewidth=1.0)
    above.set(title=f"{force:g} N", xlabel="time (s)")
    below.plot(z, speed, linewidth=0.3, color="0.6")
    below.plot(z[::32], speed[::32], ".", color="tab:red", markersize=4)  # once a period
    below.set(xlabel="height (mm)")
    heights[force], exponents[force] = z, float(found.exponent)
axes[0, 0].set_ylabel("height of the tower (mm)")
axes[1, 0].set_ylabel("speed of its top (m/s)")
figure.savefig("kresling-chaos.png", dpi=80)
