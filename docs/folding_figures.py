"""Crease patterns, folded from flat by their mountains and valleys.

Run it to print how well each folds and draw the pictures of docs/folding.md:
python docs/folding_figures.py docs/images
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import foldyn as fd
from foldyn.plots import scene, style
from foldyn.plots.scene import Sheet3D, View
from foldyn.plots.sheet import DrawnSheet, edge_keys

VIEW = View(38.0, -62.0)
CELL, COLUMNS = 1.6, 3  # inches; patterns beside each other
BENDS = "square twist, valleys in the middle"
"""The pattern whose panels must bend."""
FILES = Path(__file__).parents[1] / "examples" / "patterns"
PATTERNS = {
    "Miura-ori": (fd.read_pattern(FILES / "miura.fold"), 0.75),
    "waterbomb": (fd.read_pattern(FILES / "waterbomb.fold"), 0.6),
    "Resch": (fd.read_pattern(FILES / "resch.fold"), 0.95),
    "square twist": (fd.read_pattern(FILES / "square-twist.fold"), 0.7),
    BENDS: (fd.patterns.square_twist(panel_angle=60, dihedral=180, symmetric=True), 0.5),
    "bird base": (fd.read_pattern(FILES / "bird-base.fold"), 0.8),
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
    letters = np.array(folding.pattern.assignments)
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
    pictures = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    draw(computed, pictures)
