"""Modes of a large sheet, time and memory: `python benchmarks/modes_large.py [cells] [solver]`.

A Miura sheet of the specimen's paper, one edge held, secant slopes of 1 degree; the default of
100 x 100 cells has 241,203 dofs. Peak memory is that of the process. Every step is timed on its
own: mesh and matrices, the modes with their first factorization, the count behind the last mode.
"""

from __future__ import annotations

import argparse
import resource
import time

import numpy as np

import foldyn as fd
from foldyn.algebra.eigen import Pencil, lowest
from foldyn.linear import linearize
from foldyn.linear.modes import rigid_space, unresisted


def sheet(cells: int) -> fd.Case:
    """A sheet of cells x cells, the edge at x = 0 held."""
    pattern = fd.patterns.miura(cells=(cells, cells), a=0.025, b=0.025, panel_angle=60, dihedral=60)
    paper = fd.Sheet(1219e6, 0.2, 0.24e-3, 667.0, length_scale_ratio=2.7)
    structure = fd.discretize(pattern, paper, preset="herkal")
    return fd.Case(structure, [fd.Fix(range(2 * cells + 1), "xyz")])


def main() -> None:
    """Compute twenty modes and print what it took."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cells", type=int, nargs="?", default=100)
    parser.add_argument("solver", nargs="?", default="auto")
    parser.add_argument("--count", type=int, default=20)
    given = parser.parse_args()
    linearize(sheet(2), secant=1.0)  # compiled kernels are loaded before the clock runs

    def lap(text: str) -> None:
        nonlocal before
        now = time.perf_counter()
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
        print(f"{text:42s} {now - before:8.1f} s   peak {peak:6.2f} GiB", flush=True)
        before = now

    before = time.perf_counter()
    case = sheet(given.cells)
    linear = linearize(case, secant=1.0)
    lap(f"matrices of {len(linear.free)} free dofs")
    pencil = Pencil(linear.stiffness, linear.mass, given.solver)
    known = unresisted(linear, rigid_space(linear))
    found = lowest(pencil, given.count, known, verify=False)
    lap(f"{given.count} modes, one factorization ({pencil.backend})")
    middle = 0.5 * (found.values[-2] + found.values[-1])
    below = pencil.below(middle)
    lap(f"count below the last mode: {below} of {given.count - 1}")
    residual = pencil.residuals(found.values, found.shapes).max()
    noise = (pencil.noise(found.shapes) / found.values).max()
    print(f"largest residual {residual:.1e}; rounding of the eigenvalues at most {noise:.1e}")
    print("frequencies (Hz):", np.array2string(np.sqrt(found.values) / (2 * np.pi), precision=5))


if __name__ == "__main__":
    main()
