"""Case study 2 of Herkal et al.: a Miura-ori unit cell, with every mass rule of the case file.

Run it to draw them:  python examples/case_study_2.py FOLDER
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import foldyn as fd


def compute() -> tuple[object, dict]:
    """The shipped case file and its motions by mass rule."""
    case_file = fd.read_case(fd.studies.find_case("herkal/case2"))
    return case_file, {rule: case_file.run(rule) for rule in case_file.masses}


def check(motions: dict) -> None:
    """Energy is kept, and the first peak of the loaded node stands near 1 Hz with every rule."""
    for rule, motion in motions.items():
        assert motion.attrs["energy_error"] < 1e-6, rule
        x = motion.displacement.sel(node=7, axis="x").to_numpy()
        frequency, amplitude = fd.signals.spectrum(x, float(motion.time[1]))
        peak = frequency[1:][np.argmax(amplitude[1:])]
        assert 0.8 < peak < 1.2, (rule, peak)


def draw(case_file, motions: dict, folder: Path) -> None:
    """The motion of the reported nodes, and the structure with its supports and load."""
    figure = fd.plots.plot_history(
        motions, case_file.output.nodes, axes="x", max_frequency=case_file.output.max_frequency
    )
    figure.savefig(folder / "case2.png", dpi=110)
    fd.plots.draw_structure(case_file.case()).savefig(folder / "case2-structure.png", dpi=110)


if __name__ == "__main__":
    found, results = compute()
    check(results)
    draw(found, results, Path(sys.argv[1] if len(sys.argv) > 1 else "."))
