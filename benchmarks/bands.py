"""Bands of a cell beside SciPy's eigenproblems alone: `python benchmarks/bands.py`.

A Miura cell of 64 nodes, vertices and centers of panels counted once, at 200 wave vectors along
G-X-M-G, its ten lowest bands. The reference solves 200 Hermitian eigenproblems of its matrices,
which are ready: `scipy.linalg.eigh` for as many eigenvalues, with full matrices, in threads on all
cores as the bands are; and `eigsh` about a shift with sparse ones. Rounds take turns; the table has
medians.
"""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from scipy import linalg
from scipy.sparse.linalg import eigsh
from threadpoolctl import threadpool_limits

import foldyn as fd
from foldyn.linear.linearized_cell import linearize_cell
from foldyn.threads import processors

COUNT, PHASES, ROUNDS = 10, 200, 7


def cell(mass: str) -> fd.UnitCell:
    """A cell of 64 nodes."""
    pattern = fd.patterns.miura(cells=(4, 2), a=0.03, b=0.03)
    sheet = fd.Sheet(1e9, 0.3, 1e-3, density=1000.0)
    nodal = fd.discretize(pattern, sheet, mass=mass, preset="plate")
    return fd.UnitCell(fd.Case(nodal))


def main() -> None:
    """Time both and print the ratios."""
    print("| mass | dofs | bands (s) | eigh (s) | eigsh (s) | ratio to eigh | to the faster |")
    for mass in ("consistent", "mixed_voronoi"):
        own = cell(mass)
        phases = own.path("G-X-M-G", PHASES)
        bloch = linearize_cell(own).bloch
        factors = [bloch.factors(phase) for phase in phases.values]
        full = [(bloch.stiffness.at(f), bloch.mass.at(f)) for f in factors]
        few = [(bloch.stiffness.sparse_at(f), bloch.mass.sparse_at(f)) for f in factors]
        shift = -1e-6 * full[0][0].trace().real / full[0][1].trace().real

        def dense(pair):
            return linalg.eigh(*pair, subset_by_index=[0, COUNT - 1])

        def lanczos(pair, shift=shift):
            return eigsh(pair[0], COUNT, pair[1], sigma=shift)

        def all_of(solve, pairs):
            with threadpool_limits(1), ThreadPoolExecutor(processors()) as pool:
                return list(pool.map(solve, pairs))

        tasks = {
            "bands": lambda own=own, phases=phases: fd.bands(own, phases, count=COUNT),
            "eigh": lambda full=full, solve=dense: all_of(solve, full),
            "eigsh": lambda few=few, solve=lanczos: all_of(solve, few),
        }
        times = {name: [] for name in tasks}
        for _ in range(ROUNDS):
            for name, task in tasks.items():
                began = time.perf_counter()
                task()
                times[name].append(time.perf_counter() - began)
        bands, eigh, sparse = (float(np.median(times[name])) for name in tasks)
        print(
            f"| {mass} | {bloch.size} | {bands:.3f} | {eigh:.3f} | {sparse:.3f} | "
            f"{bands / eigh:.2f} | {bands / min(eigh, sparse):.2f} |"
        )


if __name__ == "__main__":
    main()
