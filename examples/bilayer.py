"""A gripper of two bonded plastics: warmed, its four arms curl up, in both models.

Run it to draw the picture of docs/loads.md:
python examples/bilayer.py docs/images
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import foldyn as fd

SIDE, ARM = 0.004, 10  # m, panels of an arm
WARMER = 20.0  # K
# thickness (m), Young's modulus (Pa), expansion (1/K), from the back to the front
LAYERS = fd.Laminate([(60e-6, 1.0e9, 150e-6), (60e-6, 2.5e9, 20e-6)])
FACTORS = np.linspace(0.0, 1.0, 9)


def cross() -> fd.Pattern:
    """A square panel with an arm of panels on each of its sides."""
    squares = [(0, 0)]
    for dx, dy in ((1, 0), (0, 1), (-1, 0), (0, -1)):
        squares += [(k * dx, k * dy) for k in range(1, ARM + 1)]
    corners: dict[tuple[int, int], int] = {}
    faces = []
    for i, j in squares:
        around = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
        faces.append([corners.setdefault(corner, len(corners)) for corner in around])
    vertices = [[SIDE * (i - 0.5), SIDE * (j - 0.5), 0.0] for i, j in corners]
    return fd.Pattern(vertices, faces, name="cross")


def warmed(structure) -> fd.Case:
    """The gripper, its middle panel held, under a change of temperature."""
    load = fd.Temperature(WARMER, LAYERS.expansion, LAYERS.curvature)
    return fd.Case(structure, [fd.Fix([0, 1, 2, 3])], [load])


def compute() -> tuple[dict, dict]:
    """Cases, and with each its path."""
    sheet = LAYERS.sheet(0.35, areal_density=0.12)
    stiff = 100.0 * sheet.bending_modulus / SIDE  # its panels are joined without creases
    # in one plane the panels' common edges do not stay straight, as the preset "plate" has them
    bars = {"preset": "herkal", "fold_law": "linear", "bend_law": "linear"}
    bars |= {"crease_stiffness": stiff}
    cases = {
        "bars and hinges": warmed(fd.discretize(cross(), sheet, **bars)),
        "shell": warmed(
            fd.shell(cross(), sheet, divisions=4, fold_law="linear", crease_stiffness=stiff)
        ),
    }
    uncounted = fd.statics.Settings(stability=False)
    found = {
        name: (case, fd.trace(case, load_factors=FACTORS, settings=uncounted))
        for name, case in cases.items()
    }
    return cases, found


def lift(case: fd.Case, path) -> np.ndarray:
    """Height (m) of the middle of an arm's end at each point of a path."""
    x = case.structure.nodes[: len(case.structure.pattern.vertices), 0]
    tip = np.flatnonzero(x > x.max() - 1e-9)
    return path.displacement.values[:, tip, 2].mean(axis=1)


def arc(factor: np.ndarray) -> np.ndarray:
    """The same of an arc with the free curvature of the bilayer."""
    curvature = np.maximum(factor * WARMER * LAYERS.curvature, 1e-12)
    return (1.0 - np.cos(curvature * ARM * SIDE)) / curvature


def check(results: dict) -> None:
    """What physics demands: all arms alike, upwards, near the arc."""
    for case, path in results.values():
        height = lift(case, path)
        assert (np.diff(height) > 0.0).all()
        np.testing.assert_allclose(height[1:], arc(FACTORS[1:]), rtol=0.12)
        end = path.displacement.values[-1, : len(case.structure.pattern.vertices), 2]
        x, y = case.structure.pattern.vertices[:, :2].T
        np.testing.assert_allclose(
            end[x > (ARM + 0.4) * SIDE].mean(), end[y > (ARM + 0.4) * SIDE].mean(), rtol=1e-6
        )


def draw(results: dict, folder: Path) -> None:
    """The gripper at three temperatures."""
    case, path = results["bars and hinges"]
    shapes = fd.plots.draw_shapes(case, path, [0, len(FACTORS) // 2, -1])
    shapes.savefig(folder / "bilayer.png", dpi=80)


if __name__ == "__main__":
    _, computed = compute()
    check(computed)
    for model, (the_case, the_path) in computed.items():
        print(f"{model}: {WARMER:g} K lift the arms by {1e3 * lift(the_case, the_path)[-1]:.1f} mm")
    print(f"arc of the free curvature: {1e3 * arc(np.ones(1))[0]:.1f} mm")
    draw(computed, Path(sys.argv[1] if len(sys.argv) > 1 else "."))
