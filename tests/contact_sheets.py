"""What tests of contact share: a strip of paper, and an oracle of crossings."""

from __future__ import annotations

import numpy as np

import foldyn as fd

SHEET = fd.Sheet(
    youngs_modulus=1.219e9, poissons_ratio=0.2, thickness=0.24e-3, density=690.0,
    length_scale_ratio=2.7,
)  # fmt: skip


def strip(panels: int = 3) -> fd.Structure:
    """A flat strip of paper, panels 40 mm long and 50 mm wide."""
    nodes = [[0.04 * i, 0.05 * j, 0.0] for i in range(panels + 1) for j in (0, 1)]
    faces = [(2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1) for i in range(panels)]
    return fd.discretize(
        fd.Pattern(nodes, faces, name="strip"),
        SHEET,
        fold_law="linear",
        membrane="bars",
        preset="plate",
    )


def on_a_panel(shift=(0.0, 0.0), turn: float = 0.0) -> tuple[fd.Structure, list[int]]:
    """A strip of two panels on a large panel, at a distance of 0.993 t, and the strip's nodes.

    The large one's nodes are 0 to 3 and a center; the strip is turned by an angle (rad).
    """
    x, y, z = 0.2, 0.1, 0.993 * SHEET.thickness
    ground = [[-x, -y, 0.0], [x, -y, 0.0], [x, y, 0.0], [-x, y, 0.0]]
    strip = np.array([[0.04 * i - 0.04, 0.05 * j - 0.025, 0.0] for i in range(3) for j in (0, 1)])
    c, s = np.cos(turn), np.sin(turn)
    strip = strip @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) + [*shift, z]
    faces = [(0, 1, 2, 3), (4, 6, 7, 5), (6, 8, 9, 7)]
    pattern = fd.Pattern(np.vstack([ground, strip]), faces, name="strip on a panel")
    made = fd.discretize(pattern, SHEET, fold_law="linear", membrane="bars", preset="plate")
    return made, [*range(4, 10), *made.centers[1:].tolist()]


def crossing(structure: fd.Structure, displacements) -> int:
    """In how many states triangles cross, by the toolkit of Incremental Potential Contact."""
    import ipctk

    triangles = np.asarray(structure.triangles, np.int32)
    sides = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    edges = np.unique(np.sort(sides, axis=1), axis=0)
    mesh = ipctk.CollisionMesh(np.asfortranarray(structure.nodes), edges, triangles)
    states = [np.asfortranarray(structure.nodes + u) for u in displacements]
    return sum(bool(ipctk.has_intersections(mesh, state)) for state in states)
