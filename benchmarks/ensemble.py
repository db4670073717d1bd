"""Many small models side by side (`simulate_many`) against one after the other (`simulate`).

    python benchmarks/ensemble.py [--models 1024] [--steps 1000] [--laws superlinear]

Specimens of 4 x 3 cells, 111 nodes, 333 dofs, that differ in stiffness and load, by central
differences. Processor time per model and step, without what is done once; of one alone also without
the checks along the way whether its step is still stable. And the throughput of two threads over
that of one, which needs two processors that nothing else uses.
"""

from __future__ import annotations

import argparse
import statistics
import time
import warnings

import machine
import numpy as np
from problem import LAWS, LOAD

import foldyn as fd

warnings.simplefilter("ignore")
CELLS = (4, 3)
REPEATS = 5


def specimen(laws: str, k: int) -> fd.Case:
    """One of them."""
    fold_law, bend_law = LAWS[laws]
    pattern = fd.patterns.miura(CELLS, panel_angle=60.0, dihedral=120.0)
    sheet = fd.Sheet(1e6 * (1.0 + 1e-3 * (k % 100)), 0.25, 0.01, density=1.0)
    structure = fd.discretize(pattern, sheet, fold_law=fold_law, bend_law=bend_law, preset="herkal")
    x = pattern.vertices[:, 0]
    load = fd.Force(np.flatnonzero(x >= x.max() - 1e-9), (0.0, 0.0, -LOAD * (1.0 + 1e-3 * k)))
    held = fd.Fix(np.flatnonzero(x <= 1e-9))
    return fd.Case(structure, [held], [load], fd.Rayleigh(alpha=0.0628))


def alone(case: fd.Case, dt: float, force: bool) -> float:
    """Processor seconds of a step of one model: the difference of runs of two lengths.

    force : without looking whether the step is still stable.
    """

    def run(steps: int) -> float:
        begun = time.process_time()
        fd.simulate(
            case, steps * dt, method="central_difference", dt=dt, every_steps=steps, force=force
        )
        return time.process_time() - begun

    run(8)
    return statistics.median((run(9000) - run(1000)) / 8000 for _ in range(REPEATS))


def main() -> None:
    """Measure and print."""
    given = argparse.ArgumentParser(description=__doc__)
    given.add_argument("--models", type=int, default=1024)
    given.add_argument("--steps", type=int, default=1000)
    given.add_argument("--laws", choices=LAWS, default="superlinear")
    options = given.parse_args()
    cases = [specimen(options.laws, k) for k in range(options.models)]
    dt = 0.4 * fd.critical_step(cases[-1], "central_difference")
    steps = options.steps

    def beside(threads: int) -> dict[str, float]:
        return fd.simulate_many(cases, steps * dt, dt=dt, every_steps=steps, threads=threads).attrs

    fd.simulate_many(cases[:8], 8 * dt, dt=dt)  # compiled now
    single, bare = alone(cases[0], dt, force=False), alone(cases[0], dt, force=True)
    one, two = beside(1), beside(2)
    each = one["processor_seconds"] / steps / len(cases)
    print(*machine.describe(None), sep="\n")
    print(f"{options.models} specimens of 333 dofs, laws {options.laws}, central differences")
    print(f"one after the other: {1e6 * single:8.3f} us a step (processor)")
    print(f"without its checks:  {1e6 * bare:8.3f} us a step (processor)")
    print(f"side by side:        {1e6 * each:8.3f} us a model and step (processor, one thread)")
    print(f"ratio:               {each / single:8.3f}, to a step without checks {each / bare:.3f}")
    gain = one["wall_seconds"] / two["wall_seconds"]
    print(f"two threads:         {gain:8.3f} times the throughput of one (wall)")


if __name__ == "__main__":
    main()
