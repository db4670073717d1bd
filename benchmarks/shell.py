"""Time motions of our shell against OpenSees: `python benchmarks/shell.py`; needs `opensees`.

A case study of the paper, its whole motion, with both programs in turn, in one process on one
core. Processor time (user and system, of all threads there are) of everything from the case file
to the motion is counted, so that it matters little what else the machine does; compiled code is
loaded before. Both take the same steps with Newmark's average acceleration. Errors are relative
(L2 over time, nodes and axes) to the finest stored motion of OpenSees; with `--more` our shell is
also timed with a finer mesh, for an error like that of OpenSees.
"""

# ruff: noqa: E402  (the environment must be set before the imports)

from __future__ import annotations

import os

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[_name] = "1"  # before NumPy and Numba are imported

import argparse
import time
from collections.abc import Callable

import machine
import numpy as np

from foldyn.studies.herkal.runs import CASES
from verification.fidelity.compare import markdown
from verification.opensees import compare, run
from verification.opensees.stored import Moved, read_motion, stored_motions

Motion = Callable[[], Moved]


def timed(motion: Motion) -> tuple[float, Moved]:
    """Processor time (s) of a motion, and the motion."""
    start = time.process_time()
    found = motion()
    return time.process_time() - start, found


def measure(motions: dict[str, Motion], rounds: int) -> tuple[dict[str, list[float]], dict]:
    """Processor times of each motion in each round, and the motions."""
    times: dict[str, list[float]] = {name: [] for name in motions}
    found = {}
    for _ in range(rounds):
        for name, motion in motions.items():
            took, found[name] = timed(motion)
            times[name].append(took)
            print(f"    {name}: {took:.1f} s", flush=True)
    return times, found


def main() -> None:
    """Measure, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("case", nargs="?", default="case1", choices=CASES)
    parser.add_argument("--divisions", type=int, default=10, help="of both")
    parser.add_argument("--more", type=int, nargs="*", default=[], help="also of our shell")
    parser.add_argument("--dt", type=float, default=0.005, help="time step of both, s")
    parser.add_argument("--rounds", type=int, default=3, help="interleaved repetitions")
    options = parser.parse_args()
    case, divisions, dt = options.case, options.divisions, options.dt
    print("\n".join(f"- {line}" for line in machine.describe(None)))
    print(f"- opensees {machine.version('opensees')}, mkl {machine.version('mkl')}")
    compare.our_motion(case, 2, 0.01)  # loads what is compiled

    theirs = f"OpenSees, {divisions} divisions"
    motions: dict[str, Motion] = {
        f"Foldyn, {n} divisions": lambda n=n: compare.our_motion(case, n, dt)
        for n in (divisions, *options.more)
    }
    motions[theirs] = lambda: run.motion(case, divisions, dt)
    times, found = measure(motions, options.rounds)

    finest = stored_motions(case)[-1]
    reference = read_motion(case, *finest)
    print(f"\n{case}, steps of {dt:g} s, errors against {finest[0]} divisions of OpenSees\n")
    rows = []
    for name, took in times.items():
        ratio = np.array(took) / times[theirs]
        median, low, high = np.median(ratio), ratio.min(), ratio.max()
        error = compare.percent(compare.motion_away(found[name], reference))
        seconds = f"{np.median(took):.1f}"
        rows.append([name, seconds, f"{median:.3f} ({low:.3f} to {high:.3f})", error])
    print(markdown(("", "processor time, s", "/ OpenSees", "off, %"), rows))


if __name__ == "__main__":
    main()
