"""Time Foldyn's RK4 step against its twins: `python benchmarks/run.py`, after `make -C benchmarks`.

All engines get the same Miura sheets and must first agree on the force and on a short motion.
Then each is timed in turn, again and again, on one thread, so that what else the machine does hits
all alike; where Foldyn would use a second thread it is timed with it, too. The table gives minima
with medians beside them; progress goes to stderr.
"""

# ruff: noqa: E402  (the environment must be set before the imports)

from __future__ import annotations

import os

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[_name] = "1"  # before NumPy, Numba and JAX are imported
os.environ["JAX_PLATFORMS"] = "cpu"
os.environ["XLA_FLAGS"] = (
    os.environ.get("XLA_FLAGS", "") + " --xla_cpu_multi_thread_eigen=false"
).strip()

import argparse
import sys
from pathlib import Path

import build
import cpp_twin
import jax_twin
import machine
import numpy as np
from foldyn_engine import FoldynEngine
from numpy_twin import NumpyTwin
from problem import LAWS, Problem, make
from table import HEADINGS, Row, markdown, row, write_csv

from foldyn.mechanics.threads import HINGES_EACH

SIZES = ("1x1", "4x3", "10x10", "30x30", "100x100", "300x300")
SLOW = {"NumPy", "JAX"}
FORCE_TOLERANCE = 1e-12  # relative to the largest force: order of summation and fused operations
MOTION_STEPS = 20
LARGE = 500_000  # dofs from which the motion is compared after fewer steps
LARGE_STEPS = 3
MOTION_TOLERANCE = 1e-11  # relative to the largest displacement
MOST_THREADS = 2
LENGTHS_LOSE = 1e3  # bars from lengths of positions far from the origin cancel digits
# four evaluations of MERLIN2's force in GNU Octave at 333 dof; see docs/benchmarks.md
MERLIN2_MICROSECONDS = 8800.0


def say(text: str) -> None:
    """Progress, to stderr."""
    print(text, file=sys.stderr, flush=True)


def engines(problem: Problem, library: object, skip: set[str]) -> list:
    """Foldyn first, then every twin that can run here."""
    found: list = [FoldynEngine(problem)]
    cores = min(MOST_THREADS, os.cpu_count() or 1)
    if cores > 1 and len(problem.hinges) >= 2 * HINGES_EACH:
        found.append(FoldynEngine(problem, min(cores, len(problem.hinges) // HINGES_EACH)))
    if library is not None:
        found += [cpp_twin.CppTwin(problem, library, name) for name in cpp_twin.kinds(library)]
    if "NumPy" not in skip:
        found.append(NumpyTwin(problem))
    if "JAX" not in skip and not jax_twin.absent():
        found.append(jax_twin.JaxTwin(problem))
    return found


def check(found: list, problem: Problem) -> None:
    """Refuse to time engines that do not compute the same thing."""
    reference, others = found[0], found[1:]
    force = reference.force(problem.start)
    steps = MOTION_STEPS if problem.dofs < LARGE else LARGE_STEPS
    _, motion = reference.run(steps)
    moved = np.abs(motion - problem.start).max()
    if not 0.0 < moved < 1.0:
        raise SystemExit(f"the motion to compare is not one: it moved by {moved:g} m")
    for other in others:
        allowed = LENGTHS_LOSE if "lengths" in other.name else 1.0
        error = np.abs(other.force(problem.start) - force).max() / np.abs(force).max()
        if not error < allowed * FORCE_TOLERANCE:
            raise SystemExit(f"{other.name}: the force differs by {error:.1e} (relative)")
        _, there = other.run(steps)
        drift = np.abs(there - motion).max() / np.abs(motion).max()
        if not drift < allowed * MOTION_TOLERANCE:
            raise SystemExit(f"{other.name}: the motion differs by {drift:.1e} (relative)")
        say(f"    {other.name}: same force to {error:.0e}, same motion to {drift:.0e}")


def measure(found: list, seconds: float, rounds: int) -> dict[str, np.ndarray]:
    """Seconds per step of every engine in every round; slow engines take part in a few rounds."""
    steps = {}
    for engine in found:
        cost = engine.run(2)[0] / 2
        steps[engine.name] = max(2 if engine.name in SLOW else 6, int(seconds / cost))
    times: dict[str, list[float]] = {engine.name: [] for engine in found}
    for number in range(rounds):
        for engine in found:
            if engine.name not in SLOW or number < 3:
                times[engine.name].append(engine.run(steps[engine.name])[0] / steps[engine.name])
    return {name: np.array(values) for name, values in times.items()}


def one(size: str, laws: str, library: object, options: argparse.Namespace, peak: float) -> Row:
    """Row of the table: one size, one set of laws."""
    cells = tuple(int(number) for number in size.split("x"))
    say(f"{size} cells, {laws}: discretize ...")
    problem = make(cells, laws)
    skip = set(options.skip) if problem.dofs <= options.slow_dofs else SLOW
    found = engines(problem, library, skip)
    check(found, problem)
    times = measure(found, options.seconds, options.rounds)
    band = cpp_twin.bandwidth(library, problem.traffic // 4) if library is not None else np.nan
    for name, values in times.items():
        say(f"    {name}: {1e6 * values.min():.4g} us a step, median {1e6 * np.median(values):.4g}")
    return row(size, laws, problem, times, peak, band)


def main() -> None:
    """Check, measure, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", nargs="+", default=SIZES, metavar="NXxNY", help="unit cells")
    parser.add_argument("--laws", nargs="+", default=("enhanced", "superlinear"), choices=LAWS)
    parser.add_argument("--quick", action="store_true", help="up to 30x30, fewer repetitions")
    parser.add_argument("--rounds", type=int, default=11, help="interleaved repetitions")
    parser.add_argument("--seconds", type=float, default=0.15, help="of each repetition, about")
    parser.add_argument("--skip", nargs="+", default=(), choices=sorted(SLOW))
    parser.add_argument(
        "--slow-dofs", type=float, default=np.inf, help="largest size for NumPy and JAX"
    )
    parser.add_argument("--out", type=Path, help="also write the table, .md or .csv")
    options = parser.parse_args()
    if options.out and options.out.suffix not in (".md", ".csv"):
        parser.error(f"--out {options.out}: end it with .md or .csv")
    if options.quick:
        options.sizes = [size for size in options.sizes if size in SIZES[:4]] or SIZES[:2]
        options.rounds, options.seconds = min(options.rounds, 5), min(options.seconds, 0.05)

    library, compiler, peak = None, None, np.nan
    try:
        library, compiler = cpp_twin.load(str(build.library())), build.compiler()
        peak = cpp_twin.flop_peak(library)
    except build.NoCompilerError as error:
        say(f"without the C++ twin: {error}")
    if library is not None and "C++ AVX-512" not in cpp_twin.kinds(library):
        say("this machine has no AVX-512: that twin is left out")
    if jax_twin.absent():
        say("JAX is not installed: its twin is left out (pip install jax)")

    rows = [
        one(size, laws, library, options, peak) for laws in options.laws for size in options.sizes
    ]
    head = machine.describe(compiler)
    if library is not None:
        head.append(
            f"measured on one core: {peak / 1e9:.0f} Gflop/s of fused multiply-adds, triad "
            f"{cpp_twin.bandwidth(library, 1 << 19) / 1e9:.0f} GB/s in the L2 cache and "
            f"{cpp_twin.bandwidth(library, 1 << 29) / 1e9:.0f} GB/s in memory"
        )
    text = markdown(head, rows, MERLIN2_MICROSECONDS)
    print(text)
    if options.out and options.out.suffix == ".md":
        options.out.write_text(text + "\n")
    elif options.out:
        write_csv(options.out, HEADINGS, rows)


if __name__ == "__main__":
    main()
