"""A Miura sheet that is pressed between two plates to a block."""

from __future__ import annotations

import numpy as np

import foldyn as fd

T = 0.2e-3
SHEET = fd.Sheet(1.219e9, 0.2, T, density=690.0, length_scale_ratio=2.7)


def press(cells: int = 2, end: float = 0.7) -> tuple[fd.Case, int]:
    """A folded Miura sheet between two plates that close to a share of its layers' thickness.

    Its middle row stands in the plane of symmetry. Returns the case and the number of layers.
    """
    pattern = fd.patterns.miura(cells=(cells, cells), a=0.02, b=0.02, panel_angle=60, dihedral=70)
    s = fd.discretize(pattern, SHEET, fold_law="linear", preset="plate")
    low, high = s.nodes[:, 0].min(), s.nodes[:, 0].max()
    row, layers = 2 * cells + 1, 2 * cells
    middle = list(range(cells * row, cells * row + row))
    supports = [
        fd.Fix(middle, "x"), fd.Fix([middle[cells]], "y"), fd.Fix([middle[0], middle[-1]], "z"),
    ]  # fmt: skip
    half, gap = 0.5 * (high - low - end * layers * T), 0.495 * T
    planes = [
        fd.Plane((low - gap, 0, 0), (1, 0, 0), motion=(half, 0, 0)),
        fd.Plane((high + gap, 0, 0), (-1, 0, 0), motion=(-half, 0, 0)),
    ]
    return fd.Case(s, supports, contact=fd.Contact(planes=planes)), layers


def plates(case: fd.Case, path) -> tuple[np.ndarray, np.ndarray]:
    """Force of the first plane along its normal, N, and length of the sheet along x, m."""
    x = (case.structure.nodes + path.displacement.values)[:, :, 0]
    return path.plane_force.values[:, 0] @ case.contact.planes[0].normal, np.ptp(x, axis=1)


def cycle(dragged) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Work of each cycle of a sheet that is dragged forth and back, what it loses, and its energy.

    dragged : returns its path over some load factors, first. The energy is that at cycles' ends.
    """
    turn = np.append(np.linspace(0.0, 0.02, 61), 2.0)  # the springs turn within the first ones
    path = dragged([0.0, *(1.0 - turn), *(turn[1:] - 1.0)])[0]
    ends = np.flatnonzero(path.load_factor.values == 1.0)
    work, lost = (np.diff(path[name].values[ends]) for name in ("work", "dissipated"))
    return work, lost, sum(path[group].values for group in ("strain_bars", "contact"))[ends]
