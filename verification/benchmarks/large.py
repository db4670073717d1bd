"""Large displacements: a cantilever, snapping roofs, a frame.

K. Y. Sze, X. H. Liu, S. H. Lo, Popular benchmark problems for geometric nonlinear analysis of
shells, Finite Elem. Anal. Des. 40, 1551-1569, 2004. S. L. Lee, F. S. Manuel, E. C. Rossow, Large
deflections and stability of elastic frames, J. Eng. Mech. Div. ASCE 94, 521-547, 1968.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import foldyn as fd
from verification.benchmarks.benchmark import Benchmark
from verification.benchmarks.facets import cylinder, facets, welded

STRIP = fd.Sheet(1.2e6, 0.0, 0.1)
# load over 4: shortening and lift of the tip, L = 10 (Sze et al., table 1)
END_SHEAR = {
    0.1: (0.103, 1.309), 0.2: (0.381, 2.493), 0.4: (1.184, 4.292), 0.6: (2.002, 5.444),
    0.8: (2.705, 6.190), 1.0: (3.286, 6.698),
}  # fmt: skip


def end_shear(cells: int = 32) -> NDArray:
    """Shortening and lift of the tip (loads, 2) of a cantilever 10 x 1 at the loads of the table.

    It is cut into strips, which are welded.
    """
    x = np.linspace(0.0, 10.0, cells + 1)[:, None] * np.eye(3)[0]
    pattern = welded(facets(x, 1.0, cells // 8))
    held, load = fd.Fix("xmin"), fd.LineLoad("xmax", (0.0, 0.0, 4.0))
    case = fd.Case(fd.shell(pattern, STRIP, divisions=1, clamped="xmin"), [held], [load])
    path = fd.trace(case, load_factors=list(END_SHEAR), settings={"stability": False})
    tip = pattern.vertices[:, 0] > 10.0 - 1e-9
    moved = path.displacement.values[:, : len(tip)][:, tip].mean(axis=1)
    return np.abs(moved[:, [0, 2]])


def limit_load(case: fd.Case, node: int, down: float, first_step: float) -> float:
    """Load factor of the first limit point; the path ends where a node has moved down so far."""
    path = fd.trace(
        case, "arc_length", first_step=first_step,
        until={"node": node, "axis": "z", "displacement": -down},
    )  # fmt: skip
    return float(path.load_factor[path.point == "limit"][0])


def roof(thickness: float, cells: int = 24) -> float:
    """Limit load (N) of a cylindrical roof, hinged along its straight edges, pushed in its middle.

    Of mm and N: radius 2540, half angle 0.1, length 508.
    """
    pattern = cylinder(2540.0, 0.1, 508.0, cells, cells)
    made = fd.shell(pattern, fd.Sheet(3102.75, 0.3, thickness), divisions=1)
    middle = int(np.linalg.norm(made.nodes - [0.0, 254.0, 0.0], axis=1).argmin())
    held, push = fd.Fix("xmin or xmax", along=True), fd.Force([middle], (0.0, 0.0, -3000.0))
    return 3000.0 * limit_load(fd.Case(made, [held], [push]), middle, 14.0, 0.02 * thickness / 6.35)


LEG = 120.0
FRAME = fd.Sheet(720.0, 0.0, 2.0)  # 3 wide: A = 6, I = 2


def lee_frame(cells: int = 20) -> float:
    """Limit load of a right-angled frame, hinged at both ends, with a force at a fifth of a leg."""
    part = LEG * np.arange(cells + 1)[:, None] / cells
    post, beam = part * np.eye(3)[2], LEG * np.eye(3)[2] + part[1:] * np.eye(3)[0]
    line = np.concatenate([post, beam])
    n = len(line)
    made = fd.shell(welded(facets(line, 3.0, 1)), FRAME, divisions=2)
    ends = fd.Fix([0, n, n - 1, 2 * n - 1], "xz", along=True)
    flat = fd.Fix(range(len(made.nodes)), "y")
    pushed = cells + cells // 5
    push = fd.LineLoad([(pushed, n + pushed)], (0.0, 0.0, -1.0 / 3.0))
    return limit_load(fd.Case(made, [ends, flat], [push]), pushed, 55.0, 0.2)


LIMIT = {"quantity": "limit load", "unit": "N"}
SZE = "Sze et al. (2004), shells of another program"
BENCHMARKS = [
    Benchmark(
        "Sze's cantilever under end shear", SZE, "shell", "32 x 4 facets",
        "shortening and lift of the tip at full load", "m", END_SHEAR[1.0], 0.004,
        lambda: end_shear()[-1],
    ),
    # table 9: the largest load, over 3000
    Benchmark(
        "Sze's hinged roof, 12.7 mm", SZE, "shell", "24 x 24 facets", **LIMIT,
        reference=(0.7421 * 3000.0,), error=0.01, compute=lambda: roof(12.7),
    ),
    Benchmark(
        "Sze's hinged roof, 6.35 mm", SZE, "shell", "24 x 24 facets", **LIMIT,
        reference=(0.1953 * 3000.0,), error=0.02, compute=lambda: roof(6.35),
    ),
    Benchmark(
        "Lee's frame", "elastica with stretching, shooting", "shell", "40 facets, 2 divisions",
        "limit load", "", (1.8557,), 0.002, lee_frame,
    ),
]  # fmt: skip
