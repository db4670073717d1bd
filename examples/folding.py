"""Crease patterns, folded from flat by their mountains and valleys.

Run it to print the table and draw the picture of docs/folding.md:
python examples/folding.py docs/images
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import foldyn as fd
from foldyn.plots import scene, style
from foldyn.plots.scene import Sheet3D, View
from foldyn.plots.sheet import DrawnSheet, edge_keys

P = fd.patterns
VIEW = View(38.0, -62.0)
CELL, COLUMNS = 1.6, 3  # inches; patterns beside each other
BENDS = "square twist, valleys in the middle"
"""The pattern whose panels must bend."""


def bird_base() -> fd.Pattern:
    """The bird base, a square of 2 m."""
    t = 2.0 - np.sqrt(2.0)
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    middles = [(0, -1), (1, 0), (0, 1), (-1, 0)]
    inner = [(t * x, t * y) for x, y in middles]
    faces, letters = [], {}
    for k in range(4):
        after, middle, peak = (k + 1) % 4, 4 + k, 8 + k
        faces += [(k, middle, peak), (middle, after, peak), (k, peak, 12), (peak, after, 12)]
        letters |= {(k, peak): "M", (after, peak): "M", (middle, peak): "V", (peak, 12): "M"}
    letters |= {(k, 12): "V" for k in range(4)}
    # only one of the diagonals is folded
    faces = [face for face in faces if 12 not in face]
    faces += [(k, 8 + k, 12, 8 + (k - 1) % 4) for k in (0, 2)]
    faces += [(8 + (k - 1) % 4, k, 12) for k in (1, 3)] + [(12, k, 8 + k) for k in (1, 3)]
    letters = {pair: letter for pair, letter in letters.items() if pair not in ((0, 12), (2, 12))}
    return fd.Pattern([*corners, *middles, *inner, (0, 0)], faces, letters, "bird base")


PATTERNS = {
    "Miura-ori": (P.miura((3, 3), dihedral=180), 0.75),
    "waterbomb": (P.waterbomb((4, 5), dihedral=180), 0.6),
    "Resch": (P.resch((3, 3), dihedral=180), 0.95),
    "square twist": (P.square_twist(dihedral=180), 0.7),
    BENDS: (
        P.square_twist(panel_angle=60, dihedral=180, symmetric=True),
        0.5,
    ),
    "bird base": (bird_base(), 0.8),
}
"""Flat patterns, and how far they are folded."""


def compute() -> tuple[dict, dict]:
    """Foldings by name; once for pictures, once to check."""
    results = {name: fd.fold(flat, fraction=part) for name, (flat, part) in PATTERNS.items()}
    return results, results


def check(results: dict) -> None:
    """Every crease turns its way, and only one pattern asks its panels to bend."""
    for name, folding in results.items():
        assert not folding.wrong, name
        assert not len(folding.crossings), name
        if name != BENDS:
            assert folding.kind == "rigid", name
            assert folding.rigid_path, name
            assert folding.path["strain"].values.max() < 1e-9, name


def row(name: str, folding: fd.Folding) -> str:
    """Row of the table."""
    letters = np.array(folding.assignments)
    turning = np.isin(letters, ["M", "V"])
    size = np.degrees(np.abs(folding.angles[turning]))
    bend = np.degrees(folding.bend) if folding.kind != "rigid" else 0.0
    return (
        f"| {name} | {100 * PATTERNS[name][1]:.0f} % | {turning.sum() - len(folding.wrong)} of "
        f"{turning.sum()} | {size.min():.0f} to {size.max():.0f} | {folding.strain:.0e} | "
        f"{bend:.2g} | {len(folding.crossings)} |"
    )


def draw(results: dict, folder: Path) -> None:
    """All patterns in three columns, each flat and, at the same scale, folded."""
    rows = -(-len(results) // COLUMNS)
    width, height = 2 * CELL * COLUMNS, rows * (CELL + 0.35) + 0.4
    figure = style.new_figure(width, height, "", constrained=False)
    for k, (name, folding) in enumerate(results.items()):
        line, column = divmod(k, COLUMNS)
        top = height - line * (CELL + 0.35)
        positions, sheet = folding.path["position"].values, Sheet3D.of(folding.pattern)
        flat = VIEW.flat(positions[0])
        scale = 0.95 * CELL / np.ptp(flat, axis=0).max()
        for place, points in enumerate((positions[0], positions[-1])):
            seen, shown = scene.Seen.of(points, VIEW), VIEW.flat(points)
            off = scale * (VIEW.flat(seen.middle) - 0.5 * (shown.min(axis=0) + shown.max(axis=0)))
            center = (2 * column + place + 0.5) * CELL + off[0], top - 0.3 - 0.5 * CELL + off[1]
            axes = scene.add_view(figure, seen, center, scale)
            axes.set_axis_off()
            DrawnSheet(axes, sheet, points, VIEW)
        spot = (column + 0.5) / COLUMNS, (top - 0.15) / height
        figure.text(*spot, name, ha="center", va="center", **style.TEXT)
    keys = edge_keys(Sheet3D.of(results[BENDS].pattern))
    style.finish(figure, keys).savefig(folder / "folding.png", dpi=90)


if __name__ == "__main__":
    _, computed = compute()
    check(computed)
    for title, one in computed.items():
        print(row(title, one))
    draw(computed, Path(sys.argv[1] if len(sys.argv) > 1 else "."))
