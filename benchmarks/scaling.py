"""Cost against size, for every method: `python benchmarks/scaling.py`, after `make -C benchmarks`.

Miura sheets of growing size, as `problem.py` makes them: one step of every integrator, one
iteration of Newton's method in statics, six modes; beside them a step of the Runge-Kutta twins in
C++, JAX and NumPy, and MERLIN2's stored number. Methods take turns, round after round, on one
thread; the table gives medians. `--picture scaling.svg` draws it.
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
import csv
import sys
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from statistics import median

import build
import cpp_twin
import jax_twin
import machine
import matplotlib as mpl
import numpy as np
from numpy_twin import NumpyTwin
from problem import Problem, make

import foldyn as fd
from foldyn.dynamics import METHODS
from foldyn.errors import FoldynWarning

SIZES = ("1x1", "4x3", "10x10", "30x30", "100x100")
IMPLICIT_STEP = 50.0  # steps of Runge-Kutta in a step of the implicit methods
MODES = 6
SLOW_DOFS = 30_000  # above which NumPy and JAX are left out
# four evaluations of MERLIN2's force in GNU Octave at 333 dof; see docs/benchmarks.md
MERLIN2 = "four forces of MERLIN2 in Octave (stored)"
MERLIN2_SECONDS, MERLIN2_DOFS = 8.8e-3, 333


Times = dict[str, dict[int, float]]
"""Seconds of each work at each number of dofs."""


def say(text: str) -> None:
    """Progress, to stderr."""
    print(text, file=sys.stderr, flush=True)


def stepping(problem: Problem, method: str, seconds: float) -> Callable[[], float]:
    """A step of a method: a call that gives its time (s); Dormand and Prince's is the largest."""
    dt = problem.dt * (IMPLICIT_STEP if METHODS[method].scheme else 1.0)
    start = fd.State(displacement=problem.start[np.argsort(problem.order)])

    def run(steps: int) -> float:
        motion = fd.simulate(
            problem.case,
            steps * dt,
            method=method,
            dt=dt,
            every_steps=steps,
            initial=start,
            force=True,
        )
        return motion.attrs["wall_seconds"] / motion.attrs["steps"]

    run(2)  # compiles
    steps = max(2, int(seconds / run(4)))
    return lambda: run(steps)


def iteration(problem: Problem) -> Callable[[], float]:
    """An iteration of Newton's method: tangent, factorization, solution, force."""

    def solve() -> float:
        path = fd.trace(problem.case, method="newton", steps=2)
        return path.attrs["wall_seconds"] / int(path.iterations.sum())

    solve()
    return solve


def vibrating(problem: Problem) -> Callable[[], float]:
    """The lowest modes."""

    def solve() -> float:
        return fd.modes(problem.case, count=MODES).attrs["wall_seconds"]

    solve()
    return solve


def twins(problem: Problem, library: object, seconds: float) -> dict[str, Callable[[], float]]:
    """A step of each twin that can run here."""
    found: list = []
    if library is not None:
        found += [cpp_twin.CppTwin(problem, library, name) for name in cpp_twin.kinds(library)]
    if problem.dofs <= SLOW_DOFS:
        found.append(NumpyTwin(problem))
        if not jax_twin.absent():
            found.append(jax_twin.JaxTwin(problem))

    def of(twin: object) -> Callable[[], float]:
        steps = max(2, int(seconds / (twin.run(2)[0] / 2)))
        return lambda: twin.run(steps)[0] / steps

    return {f"rk4, {twin.name}": of(twin) for twin in found if "lengths" not in twin.name}


def works(problem: Problem, library: object, seconds: float) -> dict[str, Callable[[], float]]:
    """All that is timed for one sheet."""
    own = {name: stepping(problem, name, seconds) for name in METHODS}
    others = {
        "statics, an iteration": iteration(problem),
        f"{MODES} modes": vibrating(problem),
        **twins(problem, library, seconds),
    }
    return own | others


def measured(sizes: list[str], rounds: int, seconds: float, library: object) -> Times:
    """Medians (s) of each work at each number of dofs."""
    found: Times = {}
    for size in sizes:
        problem = make(tuple(int(number) for number in size.split("x")), "enhanced")
        say(f"{size} cells, {problem.dofs} dofs ...")
        each = works(problem, library, seconds)
        laps: dict[str, list[float]] = {name: [] for name in each}
        for _ in range(rounds):
            for name, work in each.items():
                laps[name].append(work())
        for name, values in laps.items():
            found.setdefault(name, {})[problem.dofs] = median(values)
            say(f"    {name}: {1e6 * median(values):.4g} us")
    found[MERLIN2] = {MERLIN2_DOFS: MERLIN2_SECONDS}
    return found


def slope(times: Mapping[int, float]) -> str:
    """Exponent of the growth between the two largest sizes."""
    if len(times) < 2:
        return "-"
    (a, b), (first, second) = sorted(times)[-2:], [times[n] for n in sorted(times)[-2:]]
    return f"{np.log(second / first) / np.log(b / a):.2f}"


def table(times: Times) -> list[list[str]]:
    """Rows: a method, its microseconds at each size, the exponent of its growth."""
    sizes = sorted({dofs for each in times.values() for dofs in each})
    rows = [["", *(f"{dofs:,} dofs" for dofs in sizes), "grows as dofs to the"]]
    for name, each in times.items():
        cells = [f"{1e6 * each[dofs]:.3g}" if dofs in each else "-" for dofs in sizes]
        rows.append([name, *cells, slope(each)])
    return rows


def draw(times: Times, path: Path) -> None:
    """Log-log picture of all methods."""
    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(figsize=(7.5, 5.2), layout="constrained")
    colors, others = iter(plt.get_cmap("tab10").colors), iter("os^vD")
    for name, each in times.items():
        sizes = sorted(each)
        if name == MERLIN2 or name.startswith("rk4, "):
            style = {"color": "0.45", "linestyle": "--", "marker": next(others)}
        else:
            style = {"color": next(colors), "marker": "."}
        axes.loglog(sizes, [each[n] for n in sizes], label=name, **style)
    axes.set_xlabel("degrees of freedom")
    axes.set_ylabel("time (s)")
    axes.grid(True, which="major", alpha=0.3)
    axes.legend(fontsize=8, loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False)
    figure.savefig(path)


def main() -> None:
    """Measure, print, draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", nargs="+", default=SIZES, metavar="NXxNY", help="unit cells")
    parser.add_argument("--rounds", type=int, default=3, help="interleaved repetitions")
    parser.add_argument("--seconds", type=float, default=0.3, help="of each repetition, about")
    parser.add_argument("--out", type=Path, help="also write the table as CSV")
    parser.add_argument("--picture", type=Path, help="also draw it: .svg, .png or .pdf")
    given = parser.parse_args()
    library, compiler = None, None
    try:
        library, compiler = cpp_twin.load(str(build.library())), build.compiler()
    except build.NoCompilerError as error:
        say(f"without the C++ twin: {error}")
    warnings.simplefilter("ignore", FoldynWarning)  # steps are chosen for their cost alone
    times = measured(given.sizes, given.rounds, given.seconds, library)
    rows = table(times)
    print("\n".join(f"- {line}" for line in machine.describe(compiler)))
    print("\nMicroseconds, medians.\n")
    for number, row in enumerate(rows):
        print(f"| {' | '.join(row)} |")
        if number == 0:
            print("|" + "---|" * len(row))
    if given.out:
        with given.out.open("w", newline="") as file:
            csv.writer(file).writerows(rows)
    if given.picture:
        draw(times, given.picture)


if __name__ == "__main__":
    main()
