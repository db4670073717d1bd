"""Contact: a tower of paper that snaps shut and bounces off its own panels.

Run it to draw the pictures of the page on contact:  python examples/contact.py docs/images
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import foldyn as fd

HEIGHT = 0.06  # m
OPEN, CLOSED = 0.06, 0.0288  # heights of the two stable states, m
FORCES = (38.0, 50.0, 80.0)  # N on each node of the top, as a half sine of 20 ms
DROP = 0.2  # s
TOP = list(range(6, 12))


def tower(force: float) -> fd.Case:
    """The Kresling tower of the gallery, pushed down on its top."""
    paper = fd.Sheet(
        youngs_modulus=1.219e9, poissons_ratio=0.2, thickness=0.24e-3, density=690.0,
        length_scale_ratio=2.7,
    )  # fmt: skip
    pattern = fd.patterns.kresling(sides=6, radius=0.04, height=HEIGHT, twist=30, storeys=1)
    return fd.Case(
        fd.discretize(pattern, paper),
        supports=[fd.Fix(list(range(6)))],
        loads=[fd.Force(TOP, (0, 0, -force), fd.HalfSine(0.02))],
        damping=fd.Rayleigh(alpha=200.0),
        contact=fd.Contact(),
    )


def compute() -> tuple[dict, dict]:
    """Cases and motions by the force."""
    cases = {force: tower(force) for force in FORCES}
    found = {
        force: fd.simulate(case, DROP, method="auto", every=2e-4) for force, case in cases.items()
    }
    return cases, found


def height(motion) -> np.ndarray:
    """Height of the top over time, m."""
    return HEIGHT + motion.displacement.sel(node=TOP, axis="z").mean("node").values


def check(found: dict) -> None:
    """It closes, does not pass itself, and rests in a stable state."""
    for motion in found.values():
        z = height(motion)
        assert 0.0 < z.min() < 0.01
        assert min(abs(z[-1] - OPEN), abs(z[-1] - CLOSED)) < 1e-3
        assert motion.attrs["energy_error"] < 1e-4
    assert float(found[80.0].contact.max()) > 1e-3  # its panels have met


def draw(cases: dict, found: dict, folder: Path) -> None:
    """Heights over time, and the tower where its panels touch most."""
    figure = Figure(figsize=(7.0, 3.2), layout="constrained")
    axes = figure.subplots()
    for force, motion in found.items():
        axes.plot(1e3 * motion.time, 1e3 * height(motion), label=f"{force:g} N")
    for stable in (OPEN, CLOSED):
        axes.axhline(1e3 * stable, color="0.6", linewidth=0.8, zorder=0)
    axes.set(xlabel="time (ms)", ylabel="height of the top (mm)", xlim=(0, 100))
    axes.legend()
    figure.savefig(folder / "contact-tower.png", dpi=75)
    motion = found[80.0]
    touching = int(motion.contact.values.argmax())
    closed = fd.plots.draw_structure(
        cases[80.0], motion.displacement.values[touching], numbers=False, loads=False
    )
    closed.savefig(folder / "contact-closed.png", dpi=75)


if __name__ == "__main__":
    the_cases, results = compute()
    for part, motion in results.items():
        print(f"{part:g} N: rests at {1e3 * height(motion)[-1]:.2f} mm,", end=" ")
        print(f"energy error {motion.attrs['energy_error']:.1e}")
    check(results)
    draw(the_cases, results, Path(sys.argv[1] if len(sys.argv) > 1 else "."))
