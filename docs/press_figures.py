"""Contact in statics: a folded Miura sheet that two plates press to a block.

Run it to draw the pictures of the page on contact:  python docs/press_figures.py docs/images
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import foldyn as fd

THICKNESS = 0.2e-3  # m
CELLS = 2
LAYERS = 2 * CELLS
END = 0.7  # of the thickness of all layers: where the path ends


def sheet() -> fd.Structure:
    """The sheet, 20 mm panels of paper, folded to dihedrals of 70 degrees."""
    paper = fd.Sheet(1.219e9, 0.2, THICKNESS, density=690.0, length_scale_ratio=2.7)
    pattern = fd.patterns.miura(cells=(CELLS, CELLS), a=0.02, b=0.02, panel_angle=60, dihedral=70)
    return fd.discretize(pattern, paper, fold_law="linear", preset="plate")


def press() -> fd.Case:
    """It stands between two planes that close along x; supports hold its place only."""
    s = sheet()
    low, high = s.nodes[:, 0].min(), s.nodes[:, 0].max()
    row = 2 * CELLS + 1
    middle = list(range(CELLS * row, CELLS * row + row))  # in the plane of symmetry
    supports = [
        fd.Fix(middle, "x"), fd.Fix([middle[CELLS]], "y"), fd.Fix([middle[0], middle[-1]], "z"),
    ]  # fmt: skip
    way = 0.5 * (high - low - END * LAYERS * THICKNESS)
    gap = 0.495 * THICKNESS
    plates = [
        fd.Plane((low - gap, 0, 0), (1, 0, 0), motion=(way, 0, 0)),
        fd.Plane((high + gap, 0, 0), (-1, 0, 0), motion=(-way, 0, 0)),
    ]
    return fd.Case(s, supports, contact=fd.Contact(planes=plates))


def compute():
    """The case, and its path until the layers are near and from there on, in finer steps."""
    case = press()
    near = 1.0 - (2.4 - END) * LAYERS * THICKNESS / (2.0 * case.contact.planes[0].motion[0])
    closing = fd.trace(case, "displacement", load_factors=np.linspace(0.0, near, 20).tolist())
    block = fd.trace(
        case, "arc_length", load_factors=[near, 1.0], steps=300, first_step=(1.0 - near) / 40,
        initial=fd.initial_state(closing),
    )  # fmt: skip
    return case, (closing, block)


def curve(paths) -> tuple[np.ndarray, np.ndarray]:
    """Length of the sheet (m) and force of a plate (N) along the path."""
    lengths, forces = zip(*map(_curve, paths), strict=True)
    return np.concatenate(lengths), np.concatenate(forces)


def _curve(path) -> tuple[np.ndarray, np.ndarray]:
    x = (path.rest_position + path.displacement).sel(axis="x")
    length = x.max("node") - x.min("node")
    return length.values, path.plane_force.sel(axis="x").values[:, 0]


def check(paths) -> None:
    """It carries load where its layers meet, and panels do not cross."""
    length, force = curve(paths)
    over = length / (LAYERS * THICKNESS)
    assert over.min() < 0.9
    at = [float(np.interp(-x, -over, force)) for x in (2.2, 1.1, 0.9)]
    assert at[1] > 30.0 * at[0]
    assert at[2] > 1.5 * at[1]
    assert not any(path.sizes.get("crossing", 0) for path in paths)


def draw(case: fd.Case, paths, folder: Path) -> None:
    """Force over length, and the sheet before and at the end."""
    length, force = curve(paths)
    figure = Figure(figsize=(7.0, 3.2), layout="constrained")
    axes = figure.subplots()
    axes.semilogy(1e3 * length[1:], force[1:], marker=".")
    block = 1e3 * LAYERS * THICKNESS
    axes.axvline(block, color="0.6", linewidth=0.8, zorder=0)
    axes.annotate(
        f"{LAYERS} layers of {1e3 * THICKNESS:g} mm", (block, force[1]), xytext=(6, 4),
        textcoords="offset points", color="0.4",
    )  # fmt: skip
    axes.set(xlabel="length between the plates (mm)", ylabel="force (N)", xscale="log")
    ticks = [0.6, 0.8, 1, 2, 4, 8, 16]
    axes.set_xticks(ticks, [f"{x:g}" for x in ticks])
    axes.minorticks_off()
    figure.savefig(folder / "contact-press.png", dpi=75)
    closing = fd.plots.draw_structure(
        case, paths[0].displacement.values[-1], numbers=False, loads=False
    )
    closing.savefig(folder / "contact-pressed.png", dpi=75)


if __name__ == "__main__":
    the_case, the_paths = compute()
    the_length, the_force = curve(the_paths)
    for x in (2.2, 1.7, 1.3, 1.1, 1.0, 0.9):
        there = np.interp(-x * LAYERS * THICKNESS, -the_length, the_force)
        print(f"{x:g} of the layers' thickness: {there:.3g} N")
    for part in the_paths:
        effort = part.attrs["newton_iterations"] / part.sizes["step"]
        print(f"{part.sizes['step']} points, {effort:.1f} iterations each")
    check(the_paths)
    draw(the_case, the_paths, Path(sys.argv[1] if len(sys.argv) > 1 else "."))
