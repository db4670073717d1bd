"""Steps of central differences: the preset n5b8e, with edge angles, over `plate`.

    python benchmarks/edge_angles.py [--threads 2]

Microseconds for a step of Miura sheets, minima of three runs in turn, and their ratio. The runs
include the checks of the critical step, which come every 4000 steps with edge angles.
"""

from __future__ import annotations

import argparse
import os
import warnings

CELLS = {2: 20_000, 4: 10_000, 8: 5_000, 16: 1_000, 30: 300}  # cells in a row, steps
ROUNDS = 3


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--threads", type=int, default=1)
    os.environ["NUMBA_NUM_THREADS"] = str(parser.parse_args().threads)
    import foldyn as fd
    from foldyn.errors import FoldynWarning

    warnings.simplefilter("ignore", FoldynWarning)
    sheet = fd.Sheet(3e9, 0.3, 1e-3, 1000.0)
    print("  dofs  plate n5b8e  ratio  threads")
    for cells, steps in CELLS.items():
        pattern = fd.patterns.miura((cells, cells), a=0.1, b=0.1, panel_angle=60, dihedral=120)
        best, threads = {}, {}
        for _ in range(ROUNDS):
            for preset in ("plate", "n5b8e"):
                made = fd.discretize(pattern, sheet, preset=preset)
                loads = [fd.Force("xmax", (0, 0, 1e-3))]
                case = fd.Case(made, [fd.Fix("xmin")], loads, fd.Rayleigh(1.0))
                dt = 0.5 * fd.critical_step(case, "central_difference")
                found = fd.simulate(
                    case, steps * dt, method="central_difference", dt=dt, every_steps=steps
                )
                took = found.attrs["wall_seconds"] / found.attrs["steps"] * 1e6
                best[preset] = min(took, best.get(preset, took))
                threads[preset] = found.attrs["threads"]
        one, other = best["plate"], best["n5b8e"]
        print(
            f"{made.nodes.size:6} {one:6.1f} {other:5.1f} {other / one:6.2f}  "
            f"{threads['plate']}, {threads['n5b8e']}"
        )


if __name__ == "__main__":
    main()
