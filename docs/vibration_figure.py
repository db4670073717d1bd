"""Response curves of a Miura sheet whose resonance bends with the force.

Run it to draw the picture of the page on nonlinear vibration:

    python docs/vibration_figure.py docs/images
"""

from __future__ import annotations

import sys
from pathlib import Path

import foldyn as fd


def sheet(force: float) -> fd.Case:
    """A unit cell, driven along x."""
    pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=60)
    s = fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.01, density=1.0))
    held = [fd.Fix([0, 1, 2], "x"), fd.Fix([0, 2, 6, 8], "z"), fd.Fix([1], "y")]
    push = fd.Force([5], (force, 0, 0), history=fd.Harmonic(0.6))
    return fd.Case(s, held, [push], fd.Rayleigh(alpha=0.08))


def draw(folder: Path) -> None:
    """Save the picture."""
    curves = {
        f"{1e3 * force:g} mN": fd.response_curve(sheet(force), (0.58, 0.66), 7)
        for force in (5e-5, 1e-4, 2e-4)
    }
    spine = fd.backbone(sheet(1.0), amplitudes=(1e-4, 0.06), harmonics=7)
    figure = fd.plots.plot_response_curve(curves, spine)
    figure.savefig(folder / "response-curve.png", dpi=110)


if __name__ == "__main__":
    draw(Path(sys.argv[1]))
