"""Long motions: an arch of two bars, which is Duffing's oscillator, and a Kresling tower.

Run it to print the numbers and draw the pictures of docs/long-motions.md; the tower takes minutes:
python docs/long_motions_figures.py docs/images
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

import foldyn as fd

PAGE = Path(__file__).with_name("long-motions.md")
TOP = list(range(6, 12))  # of the tower
STROKE, SPEED = 0.034, 1.5  # m, m/s: the grid of its starts
TURN = 2.0 * np.pi


def arch(**values: float) -> fd.Case:
    """The arch of the page, with some of its numbers changed."""
    block = re.findall(r"^```python\n(.*?)^```$", PAGE.read_text("utf-8"), re.M | re.S)[0]
    names: dict[str, Any] = {}
    exec(compile(block, str(PAGE), "exec"), names)
    return names["arch"](**values)


def height(u: np.ndarray, v: np.ndarray, t: float) -> float:
    """Of the node between both bars (mm)."""
    return 1e3 * u[1, 2]


X = fd.Quantity("mm", "deflection", function=height)


def hardening() -> xr.Dataset:
    """A stepped sine over the bent resonance of a flat arch on a spring."""
    case = arch(linear=1.0, alpha=0.05, force=0.06)
    return fd.bifurcation_diagram(
        case, X, frequencies=np.arange(0.9, 1.56, 0.02) / TURN, settle=150, record=4, dt=TURN / 100
    )


def doublings() -> xr.Dataset:
    """From a vibration in one state to chaos between both, as the force grows."""
    case = arch(linear=-1.0, alpha=0.3, force=1.0, omega=1.2)
    return fd.bifurcation_diagram(
        case, X, amplitudes=np.linspace(0.2, 0.65, 226), sweep="up", settle=200, record=48,
        resolution=0.01, dt=TURN / 100,
    )  # fmt: skip


def tower() -> fd.Case:
    """The paper tower of the gallery, with 50 g on each corner of its top."""
    pattern = fd.patterns.kresling(sides=6, radius=0.04, height=0.06, twist=30)
    sheet = fd.Sheet(1.219e9, 0.2, 0.24e-3, density=667.0, length_scale_ratio=2.7)
    s = fd.discretize(pattern, sheet, preset="n5b8e")
    held, damping = [fd.Fix(range(6))], fd.Rayleigh(alpha=15.0)
    return fd.Case(s, held, damping=damping, masses=[fd.PointMass(TOP, 0.05)])


def pressed(case: fd.Case) -> xr.Dataset:
    """Its path from one state to the other."""
    return fd.trace(
        case.altered(loads=[fd.Force(TOP, (0, 0, -1))]), "arc_length", steps=200, first_step=0.5,
        settings=fd.statics.Settings(largest_turn=3.0),
        until={"node": 6, "axis": "z", "displacement": -0.036},
    )  # fmt: skip


def starts(path: xr.Dataset) -> Callable[[float, float], fd.State]:
    """States on the path, by stroke (m), whose top moves down with a speed (m/s)."""
    shapes = path.displacement.values
    strokes = -shapes[:, TOP, 2].mean(axis=1)

    def start(stroke: float, speed: float = 0.0) -> fd.State:
        at = np.interp(stroke, strokes, np.arange(len(strokes)))
        k = min(int(at), len(strokes) - 2)
        v = np.zeros_like(shapes[0])
        v[TOP, 2] = -speed
        return fd.State(shapes[k] + (at - k) * (shapes[k + 1] - shapes[k]), v)

    return start


def shaken(force: float = 1.0) -> fd.Case:
    """The tower with a force (N) on each corner of its top that swings at 12 Hz."""
    return tower().altered(loads=[fd.Force(TOP, (0, 0, force), fd.Harmonic(12.0))])


def tower_doublings() -> xr.Dataset:
    """What the tower makes of a growing force."""
    rise = fd.Quantity("mm", "height of the top", function=lambda u, v, t: 1e3 * u[TOP, 2].mean())
    forces = np.concatenate([np.arange(0.5, 2.6, 0.05), np.arange(2.6, 3.055, 0.01)])
    return fd.bifurcation_diagram(
        shaken(), rise, amplitudes=forces, settle=100, record=32, resolution=0.005
    )


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    stepped = hardening()
    print("jumps (rad/s)", (TURN * stepped.jump_between.values).round(4).tolist())
    fd.plots.plot_amplitudes(stepped).savefig(folder / "long-motions-jumps.png")
    fd.plots.plot_bifurcation_diagram(doublings()).savefig(folder / "long-motions-doublings.png")
    ueda = arch(alpha=0.05, force=7.5)
    motion = fd.simulate(ueda, 4000 * TURN, method="rk4", dt=TURN / 100, interval=TURN)
    section = fd.poincare_section(motion, TURN, after=50 * TURN)
    fd.plots.plot_poincare_section(section, 1, axis="z").savefig(
        folder / "long-motions-section.png"
    )
    found = fd.lyapunov_exponent(ueda, 20_000 * TURN, settle=100 * TURN, dt=TURN / 100)
    print(f"exponent {float(found.exponent):.4f} +- {float(found.error):.4f}")
    doubled = tower_doublings()
    fd.plots.plot_bifurcation_diagram(doubled).savefig(folder / "kresling-doublings.png")
    for k in np.flatnonzero(np.diff(doubled.periods.values[0])) + 1:
        print(f"periods {doubled.periods.values[0, k]} from {doubled.level.values[k]:.3f} N")
    for force in (2.9, 3.05):
        found = fd.lyapunov_exponent(shaken(force), 60.0, settle=10.0)
        print(f"exponent at {force} N {float(found.exponent):.2f} +- {float(found.error):.2f}")
    case = tower()
    path = pressed(case)
    for state in fd.landscape(path).states:
        print(f"{1e3 * state.stroke:.2f} mm, {state.energy:.4f} J, stable: {state.stable}")
    grid = {"stroke": np.linspace(0.0, STROKE, 26), "speed": np.linspace(-SPEED, SPEED, 26)}
    basins = fd.basins(case, starts(path), grid=grid, duration=1.5, dt=2.5e-4)
    print("shares", basins.share.values, f"in {basins.attrs['wall_seconds']:.0f} s")
    figure = fd.plots.plot_basins(basins)
    figure.axes[0].set(xlabel="stroke (m)", ylabel="speed of the top, downward (m/s)")
    figure.savefig(folder / "kresling-basins.png")
