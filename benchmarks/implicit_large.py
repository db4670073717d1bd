"""An implicit step, statics and modes of a large sheet: `python benchmarks/implicit_large.py`.

The Miura sheet of `modes_large.py` with one edge held starts to fall under its weight; the default
of 100 x 100 cells has 241,203 dofs. The unit of all numbers is a bare factorization and solution of
the step's own matrix by the same solver, its order known. A step of two Newton iterations, each
with a new matrix, is put together from what its parts take in the motion: the three residuals, two
tangents, two factorizations and two solutions. Beside it stands what a step of that motion takes,
which keeps its matrix while the residual falls fast.

Processor time, medians: others may use the machine. Peak memory is that of the process so far.
"""

from __future__ import annotations

import argparse
import gc
import resource
import time
from collections import defaultdict
from typing import Any

import machine
import numpy as np
from modes_large import sheet

import foldyn as fd
from foldyn.algebra.solvers import SOLVERS, factorizer
from foldyn.dynamics.generalized_alpha import Alpha
from foldyn.dynamics.implicit.matrix import StepMatrix

DT = 1e-3  # s
FALL = [fd.Gravity((0.0, 0.0, -9.81))]
PARTS = {"residual": 3, "tangent": 2, "factorize": 2, "solve": 2}  # of a step, and how often


class Clock:
    """Times calls of methods by name, and keeps the matrix that was factorized last."""

    def __init__(self) -> None:
        self.taken: dict[str, list[float]] = defaultdict(list)
        self.matrix: Any = None

    def watch(self, owner: type, name: str) -> None:
        """Time a method of a class from now on."""
        method = getattr(owner, name)

        def timed(*arguments: Any, **named: Any) -> Any:
            begun = time.process_time()
            out = method(*arguments, **named)
            self.taken[name].append(time.process_time() - begun)
            return out

        setattr(owner, name, timed)


def peak() -> float:
    """Largest memory of the process so far, GiB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20


def tell(what: str, seconds: float, unit: float) -> None:
    """Print a row."""
    print(f"| {what} | {seconds:.2f} | {seconds / unit:.2f} | {peak():.2f} |", flush=True)


def moving(case: fd.Case, steps: int, clock: Clock) -> tuple[float, str]:
    """Seconds of a step of a motion, and how many iterations and factorizations."""
    loaded = fd.Case(case.structure, case.supports, FALL)
    clock.taken.clear()
    motion = fd.simulate(loaded, steps * DT, method="generalized_alpha", dt=DT, interval=steps * DT)
    taken, a = clock.taken, motion.attrs
    first, *others = taken["factorize"]  # the first one with its order
    whole = sum(sum(taken[name]) for name in PARTS) - first + float(np.median(others))
    each = f"{a['iterations'] / steps:.1f} iterations, {a['factorizations'] / steps:.2f} matrices"
    return whole / steps, each


def bare(matrix: Any, rounds: int, solver: str = "auto") -> tuple[float, float]:
    """Seconds of a factorization with a solution, its order known or not."""
    factorize, b = factorizer(solver, matrix.shape[0])[1], np.ones(matrix.shape[0])
    times = []
    for _ in range(rounds + 1):
        begun = time.process_time()
        factors = factorize(matrix)
        factors.solve(b)
        times.append(time.process_time() - begun)
        del factors  # its memory serves the next
    return float(np.median(times[1:])), times[0]


def main() -> None:
    """Measure, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cells", type=int, nargs="?", default=100)
    parser.add_argument("--steps", type=int, default=8, help="of the motion")
    parser.add_argument("--rounds", type=int, default=3, help="bare factorizations")
    parser.add_argument("--solver", default="auto", help="of the step and the bare ones")
    parser.add_argument("--others", action="store_true", help="the bare one by other solvers too")
    parser.add_argument("--only-step", action="store_true", help="neither statics nor modes")
    given = parser.parse_args()
    small, clock = sheet(6), Clock()
    moving_once = fd.Case(small.structure, small.supports, FALL)
    fd.simulate(
        moving_once, DT, method="generalized_alpha", dt=DT
    )  # compiled before the clock runs
    fd.trace(moving_once, load_factors=[1e-3])
    fd.modes(small, 6, secant=1.0)
    for name in ("residual", "tangent"):
        clock.watch(Alpha, name)
    for name in ("factorize", "solve"):
        clock.watch(StepMatrix, name)
    from foldyn.dynamics.implicit import matrix as module

    real = module.factorizer

    def keeping(name: str, size: int) -> Any:
        told, factorize = real(given.solver, size)

        def kept(matrix: Any) -> Any:
            clock.matrix = matrix
            return factorize(matrix)

        return told, kept

    module.factorizer = keeping
    case = sheet(given.cells)
    step, each = moving(case, given.steps, clock)
    module.factorizer = real
    solver = factorizer(given.solver, clock.matrix.shape[0])[0]
    print("\n".join(f"- {line}" for line in machine.describe(None)))
    print(f"- {case.structure.nodes.size:,} dofs, {solver}\n")
    print("| | s of processor time | of bare ones | peak GiB |\n|---|---|---|---|")
    gc.collect()
    unit, first = bare(clock.matrix, given.rounds, solver)
    tell("bare factorization and solution", unit, unit)
    tell("the same with the order", first, unit)
    if given.others:
        for name in [name for name in SOLVERS if name != solver and SOLVERS[name].found()]:
            tell(f"the same by {name}", bare(clock.matrix, 1, name)[0], unit)
    clock.taken["factorize"].pop(0)  # with the order
    typical = {name: float(np.median(clock.taken[name])) for name in PARTS}
    for name, seconds in typical.items():
        tell(f"{name} of an iteration", seconds, unit)
    two = sum(n * typical[name] for name, n in PARTS.items())
    tell("step of two Newton iterations", two, unit)
    tell(f"step of the motion ({each})", step, unit)
    clock.matrix = None
    gc.collect()
    if given.only_step:
        return
    begun = time.process_time()
    found = fd.modes(case, 6, secant=1.0)
    tell(f"six modes ({found.attrs['factorizations']} matrices)", time.process_time() - begun, unit)
    del found
    light = [fd.Gravity((0.0, 0.0, -9.81e-3))]
    begun = time.process_time()
    path = fd.trace(fd.Case(case.structure, case.supports, light), load_factors=[1.0])
    each = f"{path.attrs['newton_iterations']} iterations, {path.attrs['factorizations']} matrices"
    tell(f"equilibrium under 1/1000 of gravity ({each})", time.process_time() - begun, unit)


if __name__ == "__main__":
    main()
