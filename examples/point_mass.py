"""Weights on the tip of a folded sheet: frequencies fall as a cantilever's do.

Run it to draw the pictures of the page on point masses:  python examples/point_mass.py docs/images
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import foldyn as fd

ROOT = [0, 1, 2]
TIP = [12, 13, 14]
ADDED = (0.0, 0.25, 1.0, 4.0)  # in all, as parts of the sheet's mass
F = np.linspace(0.0, 0.08, 401)


def sheet_with(added: float) -> fd.Case:
    """A Miura sheet, clamped at one end, with weights on the other."""
    sheet = fd.Sheet(youngs_modulus=1e6, poissons_ratio=0.3, thickness=0.01, density=100.0)
    structure = fd.discretize(fd.patterns.miura(cells=(2, 1)), sheet, clamped=[(0, 1), (1, 2)])
    mass = added * structure.total_mass / len(TIP)
    weights = [fd.PointMass(TIP, mass)] if added else []
    return fd.Case(structure, [fd.Fix(ROOT)], damping=fd.Rayleigh(alpha=0.01), masses=weights)


def compute() -> tuple[dict, dict]:
    """Cases, and modes and responses of the tip, by the mass added."""
    cases = {added: sheet_with(added) for added in ADDED}
    found = {
        added: (
            fd.modes(case, 2),
            fd.frf(case, [fd.Force(TIP, (0, 1, 0))], F, method="direct"),
        )
        for added, case in cases.items()
    }
    return cases, found


def effective(found: dict) -> tuple[float, float]:
    """Stiffness (as a square of Hz) and own share of the sheet's mass: 1 / f^2 is a line."""
    inverse = [1.0 / float(modes.frequency[0]) ** 2 for modes, _ in found.values()]
    slope, start = np.polyfit(ADDED, inverse, 1)
    return 1.0 / slope, start / slope


def check(found: dict) -> None:
    """f = sqrt(k / (M + c m)): one k and one c for all weights, and peaks at the frequencies."""
    squared, share = effective(found)
    for added, (modes, response) in found.items():
        first = float(modes.frequency[0])
        assert abs(first / np.sqrt(squared / (added + share)) - 1.0) < 0.02, added
        along = np.abs(response.receptance.sel(node=TIP[1], axis="y").values)
        assert abs(F[along.argmax()] - first) < 2.0 * (F[1] - F[0]), added


def draw(cases: dict, found: dict, folder: Path) -> None:
    """The sheet with its weights, and the response of its tip."""
    fd.plots.draw_structure(cases[1.0]).savefig(folder / "point-mass.png", dpi=75)
    labels = ("sheet alone", "a quarter of its mass added", "its mass added")
    responses = {name: found[part][1] for name, part in zip(labels, ADDED, strict=False)}
    figure = fd.plots.plot_frf(responses, TIP[1:2], "y")
    figure.savefig(folder / "point-mass-response.png", dpi=75)


if __name__ == "__main__":
    the_cases, results = compute()
    for part, (modes, _) in results.items():
        print(f"{part:5g}", *(f"{f:.4f}" for f in modes.frequency.values), "Hz")
    print("share of the sheet's own mass: {1:.3f}".format(*effective(results)))
    check(results)
    draw(the_cases, results, Path(sys.argv[1] if len(sys.argv) > 1 else "."))
