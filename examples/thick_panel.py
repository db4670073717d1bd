"""A ramp of thick boards that folds up: valleys hinged in the upper faces, mountains in the lower.

Run it to print the table and draw the picture of docs/sheets.md:
python examples/thick_panel.py docs/images
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import foldyn as fd

BOARDS, WIDTH, LENGTH, THICKNESS = 6, 0.5, 0.8, 0.05  # m
PLYWOOD = fd.Sheet(youngs_modulus=8e9, poissons_ratio=0.3, thickness=THICKNESS, density=600.0)
STEPS = 20
SHOWN = (0, 7, 14, 20)  # points of the path


def ramp() -> fd.Pattern:
    """The boards, flat, side by side along x."""
    x, n = WIDTH * np.arange(BOARDS + 1), BOARDS + 1
    vertices = [(place, y) for y in (0.0, LENGTH) for place in x]
    faces = [(k, k + 1, n + k + 1, n + k) for k in range(BOARDS)]
    letters = {(k, n + k): "V" if k % 2 else "M" for k in range(1, BOARDS)}
    return fd.thicken(fd.Pattern(vertices, faces, letters, "ramp"), THICKNESS)


def folded(pattern: fd.Pattern, model: str) -> tuple[fd.Case, object]:
    """The path on which all hinges fold by the same fraction, until the faces touch."""
    structure = (
        fd.shell(pattern, PLYWOOD, divisions=2)
        if model == "shell"
        else fd.discretize(pattern, PLYWOOD)
    )
    last = BOARDS + 1
    case = fd.Case(
        structure,
        supports=[fd.Fix([0, 1, last])],
        loads=[fd.Actuate("all", fraction="100%")],
    )
    return case, fd.trace(case, method="displacement", steps=STEPS)


def compute() -> tuple[object, dict]:
    """The case, and its paths in both models."""
    pattern = ramp()
    case, bars = folded(pattern, "bars and hinges")
    return case, {"bars and hinges": bars, "shell": folded(pattern, "shell")[1]}


def reaches(case: fd.Case, path) -> tuple[np.ndarray, np.ndarray]:
    """Distance (m) of every second hinge line, at each point, and what trigonometry says."""
    x = case.structure.pattern.vertices[: BOARDS + 1]
    moved = x + path.displacement.to_numpy()[:, : BOARDS + 1]
    found = np.linalg.norm(moved[:, 2:] - moved[:, :-2], axis=2)
    half = np.radians(90.0 * path.load_factor.to_numpy())
    return found, 2.0 * (WIDTH * np.cos(half) + THICKNESS * np.sin(half))


def check(results: dict) -> None:
    """Trigonometry, and a closed stack that is as high as its boards together."""
    case = fd.Case(fd.discretize(ramp(), PLYWOOD))
    for path in results.values():
        found, wanted = reaches(case, path)
        np.testing.assert_allclose(found.T, [wanted] * (BOARDS - 1), rtol=1e-8)
        x = case.structure.pattern.vertices[: BOARDS + 1]
        last = x + path.displacement.to_numpy()[-1, : BOARDS + 1]
        np.testing.assert_allclose(last[-1] - last[0], [0.0, 0.0, BOARDS * THICKNESS], atol=1e-9)


def draw(case: fd.Case, path, folder: Path) -> None:
    """The boards, flat, on the way, and closed."""
    states = path.displacement.to_numpy()[list(SHOWN)]
    captions = [f"fold angles {180 * float(path.load_factor[k]):.0f}°" for k in SHOWN]
    figure = fd.plots.draw_boards(case, states, captions, view=(14.0, -75.0))
    figure.savefig(folder / "thick-panel.png", dpi=80)


if __name__ == "__main__":
    the_case, computed = compute()
    check(computed)
    for name, path in computed.items():
        found, wanted = reaches(the_case, path)
        error = np.abs(found - wanted[:, None]).max()
        print(f"{name}: every second hinge line {found[-1, 0]:.4f} m apart, error {error:.1e} m")
    target = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    draw(the_case, computed["bars and hinges"], target)
