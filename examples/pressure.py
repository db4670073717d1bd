"""A Miura tube of cardboard with air inside: it opens and shortens, in both models.

Run it to draw the pictures of docs/loads.md:
python examples/pressure.py docs/images
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import foldyn as fd
from foldyn.plots import style

CELLS = 2  # along the tube
SIDE, ANGLE, DIHEDRAL = 0.05, 60.0, 90.0  # m, degrees
PRESSURE = 1000.0  # Pa
FACTORS = np.linspace(0.0, 1.0, 13) ** 2  # it moves most under the first of the pressure
CARDBOARD = fd.Sheet(1.219e9, 0.2, 0.6e-3, density=667.0)
FOLD = 0.02  # N m/rad, of each crease
RIDGE, SEAM, END = 1, 2, 6 * CELLS  # vertices on the ridge, the other seam, the other end


def tube() -> fd.Pattern:
    """A strip of Miura cells and its mirror image, joined along both seams; fronts are outside."""
    strip = fd.patterns.miura((CELLS, 1), SIDE, SIDE, ANGLE, DIHEDRAL)
    top = strip.vertices - [0.0, 0.0, strip.vertices[0, 2]]
    ridge = np.arange(len(top)) % 3 == RIDGE
    below = np.arange(len(top))
    below[ridge] = len(top) + np.arange(ridge.sum())
    mirrored = [below[list(face)][::-1].tolist() for face in strip.faces]
    vertices = np.concatenate([top, top[ridge] * [1.0, 1.0, -1.0]])
    return fd.Pattern(vertices, [*strip.faces, *mirrored], name="tube")


def inflated(structure) -> fd.Case:
    """The tube, held as a rigid body, with air inside; its ends are open."""
    held = [fd.Fix([0], "xyz"), fd.Fix([SEAM], "z"), fd.Fix([END], "yz")]
    return fd.Case(structure, held, [fd.Pressure(PRESSURE)])


def sizes(case: fd.Case, path) -> tuple[np.ndarray, np.ndarray]:
    """Length and height (m) of the tube at each point of a path."""
    x = case.structure.nodes + path.displacement.values
    return x[:, END, 0], 2.0 * x[:, RIDGE, 2]


def compute() -> tuple[dict, dict]:
    """Cases, and with each its path."""
    folds = {"fold_law": "linear", "crease_stiffness": FOLD}
    cases = {
        "bars and hinges": inflated(fd.discretize(tube(), CARDBOARD, **folds)),
        "shell": inflated(fd.shell(tube(), CARDBOARD, divisions=4, **folds)),
    }
    uncounted = fd.statics.Settings(stability=False)
    found = {
        name: (case, fd.trace(case, load_factors=FACTORS, settings=uncounted))
        for name, case in cases.items()
    }
    return cases, found


def check(results: dict) -> None:
    """What physics demands: the work of the air is in the folds and panels."""
    for case, path in results.values():
        strain = sum(float(path[name][-1]) for name in case.energy_groups)
        assert abs(float(path.work[-1]) / strain - 1.0) < 0.01  # trapezoids over 12 steps
        length, height = sizes(case, path)
        assert (np.diff(length) < 0.0).all()
        assert (np.diff(height) > 0.0).all()
    reduced, full = (np.ptp(sizes(case, path), axis=1) for case, path in results.values())
    np.testing.assert_allclose(reduced, full, rtol=0.1)  # of what the tube shortens and opens


def draw(results: dict, folder: Path) -> None:
    """The tube at three pressures, and its length and height."""
    case, path = results["bars and hinges"]
    shapes = fd.plots.draw_shapes(case, path, [0, 6, -1])
    shapes.savefig(folder / "pressure.png", dpi=80)
    labels = ["length (mm)", "height (mm)"]
    figure, rows = style.rows((6.5, 4.6), "", "pressure (kPa)", labels)
    handles = []
    for k, (name, (case, path)) in enumerate(results.items()):
        kilopascal = 1e-3 * PRESSURE * path.load_factor.values
        look = style.line_style(k) | {"linewidth": 1.6}
        for row, size in zip(rows, sizes(case, path), strict=True):
            drawn = row.plot(kilopascal, 1e3 * size, label=name, **look)
        handles += drawn
    style.finish(figure, handles, columns=2).savefig(folder / "pressure-curve.png", dpi=80)


if __name__ == "__main__":
    _, computed = compute()
    check(computed)
    for model, (the_case, the_path) in computed.items():
        lengths, heights = sizes(the_case, the_path)
        print(
            f"{model}: at {1e-3 * PRESSURE:g} kPa the tube is {1e3 * lengths[-1]:.1f} mm long "
            f"({1e3 * lengths[0]:.1f} at rest) and {1e3 * heights[-1]:.1f} mm high "
            f"({1e3 * heights[0]:.1f})"
        )
    draw(computed, Path(sys.argv[1] if len(sys.argv) > 1 else "."))
