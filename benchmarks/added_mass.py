"""Added mass of a square plate by many boundary elements: `python benchmarks/added_mass.py`.

The time to make the operator, the largest memory of the process, and the time of a product beside
that of a full matrix with a row for each element, the median of some.
"""

from __future__ import annotations

import resource
import time

import numpy as np

import foldyn as fd

ELEMENTS_ALONG = (20, 40, 72)
PRODUCTS = 15


def plate() -> fd.Structure:
    """A square panel."""
    square = fd.Pattern([(0, 0), (1, 0), (1, 1), (0, 1)], [(0, 1, 2, 3)])
    return fd.discretize(square, fd.Sheet(1e9, 0.3, 1e-3, density=700.0), preset="plate")


def median(matrix, vector: np.ndarray) -> float:
    """Median time (s) of a product."""
    times = []
    for _ in range(PRODUCTS):
        began = time.perf_counter()
        _ = matrix @ vector
        times.append(time.perf_counter() - began)
    return float(np.median(times))


def main() -> None:
    """Print a row for each number of elements."""
    structure = plate()
    fd.Case(structure, air=fd.Air(resolution=4)).added_mass()  # compiles
    print("| elements | made (s) | memory (GiB) | product (ms) | full matrix (ms) | over theory |")
    for along in ELEMENTS_ALONG:
        began = time.perf_counter()
        added = fd.Case(structure, air=fd.Air(density=1.0, resolution=along)).added_mass()
        made = time.perf_counter() - began
        lift = np.tile([0.0, 0.0, 1.0], len(structure.nodes))
        full, vector = np.ones((along**2, along**2)), np.ones(along**2)
        product, dense = median(added, lift), median(full, vector)
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
        mass = float(lift @ (added @ lift)) / (0.579 * np.pi / 4)
        print(
            f"| {along**2} | {made:.2f} | {memory:.2f} | {1e3 * product:.3f} | {1e3 * dense:.3f} "
            f"| {mass:.5f} |"
        )


if __name__ == "__main__":
    main()
