"""A Miura sheet built in at one end, as bars and hinges and as a shell.

Run it to draw the pictures of the page on supports:  python examples/clamped.py docs/images
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import foldyn as fd

ROOT, TIP = [0, 1, 2], 14
CLAMPED = [(0, 1), (1, 2)]


def compute() -> tuple[dict, dict]:
    """Cases and their lowest modes, by model, clamped and with hinged ends."""
    pattern = fd.patterns.miura(cells=(2, 1))
    sheet = fd.Sheet(youngs_modulus=1e6, poissons_ratio=0.3, thickness=0.01, density=100.0)
    structures = {
        "bars and hinges": fd.discretize(pattern, sheet, clamped=CLAMPED),
        "shell": fd.shell(pattern, sheet, divisions=8, clamped=CLAMPED),
        "bars and hinges, hinged": fd.discretize(pattern, sheet),
        "shell, hinged": fd.shell(pattern, sheet, divisions=8),
    }
    cases = {name: fd.Case(structure, [fd.Fix(ROOT)]) for name, structure in structures.items()}
    return cases, {name: fd.modes(case, 3) for name, case in cases.items()}


def check(found: dict) -> None:
    """Both models agree to 10 %, and without the clamp the sheet swings more slowly."""
    frequency = {name: modes.frequency.values for name, modes in found.items()}
    reduced, shell = frequency["bars and hinges"], frequency["shell"]
    np.testing.assert_allclose(reduced[:2], shell[:2], rtol=0.1)
    for model, clamped in (("bars and hinges", reduced), ("shell", shell)):
        assert frequency[f"{model}, hinged"][0] < 0.96 * clamped[0]


def draw(cases: dict, found: dict, folder: Path) -> None:
    """The two lowest modes with both models."""
    for name, file in (("bars and hinges", "clamped-reduced"), ("shell", "clamped-shell")):
        shape = found[name]["shape"]
        modes = found[name].assign(shape=shape * np.sign(shape[:, TIP, 1]))  # alike in both
        figure = fd.plots.draw_modes(cases[name], modes, [1, 2], title=name)
        figure.savefig(folder / f"{file}.png", dpi=70)


if __name__ == "__main__":
    the_cases, results = compute()
    for label, modes in results.items():
        print(f"{label:26s}", *(f"{f:.4f}" for f in modes.frequency.values), "Hz")
    check(results)
    draw(the_cases, results, Path(sys.argv[1] if len(sys.argv) > 1 else "."))
