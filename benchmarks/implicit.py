"""Time implicit integration against RK4 on the paper specimen: `python benchmarks/implicit.py`.

The specimen is pressed together until it carries 0.226 N and let go: one second of its free
vibration, once with damping in proportion to mass, and with `--beta` once with the pair of
coefficients that the paper's half-power bandwidths give. There RK4 needs millions of steps, for
minutes; its motion is kept in the file named after `--keep` and used again. All on one thread.

Errors are those of the displacement against RK4's, relative to the largest displacement: of the
mean of the top edge, which a camera would follow, the root mean square over all nodes, and of the
worst node.
"""

# ruff: noqa: E402  (the environment must be set before the imports)

from __future__ import annotations

import os

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[_name] = "1"  # before NumPy and Numba are imported

import argparse
import warnings
from pathlib import Path

import machine
import numpy as np
import xarray
from numpy.typing import NDArray

import foldyn as fd
from foldyn.studies import find_case

TOP = range(7)
PRESSED = 0.0347  # m, where the top carries 0.226 N
TOLERANCES = (1e-3, 3e-4, 1e-4, 2e-5)
METHODS = ("generalized_alpha", "newmark", "energy_momentum")
EVERY = 0.005  # s


def specimen() -> tuple[fd.Structure, list[fd.Fix], fd.State]:
    """Structure, the supports that stay, and the state from which it is let go."""
    case = fd.read_case(find_case("herkal/specimen")).case()
    supports = [support for support in case.supports if isinstance(support, fd.Fix)]
    pressed = fd.Case(case.structure, [*supports, fd.Impose(list(TOP), "x", PRESSED)])
    path = fd.trace(pressed, method="displacement", steps=14)
    force = float(path.reaction[-1][np.isin(path.support_node, TOP)].sum())
    print(f"- pressed together by {1e3 * PRESSED:.2f} mm, the top carries {force:.4f} N")
    return case.structure, supports, fd.initial_state(path)


def reference(case: fd.Case, start: fd.State, keep: Path | None) -> xarray.Dataset:
    """Motion by RK4 with its default step, from the file if it is there."""
    if keep is not None and keep.exists():
        motion = fd.load(keep)
        return motion.isel(time=slice(None, None, round(EVERY / float(motion.time[1]))))
    motion = fd.simulate(case, 1.0, method="rk4", interval=EVERY, initial=start)
    if keep is not None:
        fd.save(motion, keep)
    return motion


def errors(motion: xarray.Dataset, exact: NDArray) -> tuple[float, float, float]:
    """Error of the top's mean, of the root mean square and of the worst node; see above."""
    found = motion.displacement.to_numpy()
    peak = float(np.abs(exact).max())
    apart = found - exact
    top = np.abs(apart[:, TOP, 0].mean(axis=1)).max()
    square = np.sqrt((apart**2).sum(axis=2).mean(axis=1)).max()
    return top / peak, square / peak, float(np.abs(apart).max()) / peak


def compare(case: fd.Case, start: fd.State, rounds: int, keep: Path | None) -> None:
    """Print a table of implicit runs beside the explicit one."""
    explicit = reference(case, start, keep)
    exact, a = explicit.displacement.to_numpy(), explicit.attrs
    head = ("method", "tolerance", "steps", "factorizations", "s, median (min)", "RK4 /")
    print(f"\nalpha = {case.damping.alpha:g} 1/s, beta = {case.damping.beta:g} s: RK4 takes")
    print(f"{a['steps']:,} steps of {a['dt']:.3g} s in {a['wall_seconds']:.3g} s\n")
    print(f"| {' | '.join(head)} | top | rms | worst |\n|{'---|' * 9}")
    runs = [(method, tolerance) for method in METHODS for tolerance in TOLERANCES]
    times: dict[tuple[str, float], list[float]] = {run: [] for run in runs}
    for number in range(rounds):
        for method, tolerance in runs:
            options = {"tolerance": tolerance, "interval": EVERY, "initial": start}
            if number == 0:
                fd.simulate(case, EVERY, method=method, **options)  # compiles
            motion = fd.simulate(case, 1.0, method=method, **options)
            times[method, tolerance].append(motion.attrs["wall_seconds"])
            if number < rounds - 1:
                continue
            took, b = np.array(times[method, tolerance]), motion.attrs
            top, square, worst = (f"{100 * error:.2f} %" for error in errors(motion, exact))
            print(
                f"| {method} | {tolerance:g} | {b['steps']:,} | {b['factorizations']:,} | "
                f"{np.median(took):.2f} ({took.min():.2f}) | "
                f"{a['wall_seconds'] / np.median(took):.3g} | {top} | {square} | {worst} |"
            )


def main() -> None:
    """Measure, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--beta", action="store_true", help="also with beta = 4.1e-4 s: minutes")
    parser.add_argument("--rounds", type=int, default=3, help="interleaved repetitions")
    parser.add_argument("--keep", type=Path, help="file for RK4's motion with beta, .nc")
    options = parser.parse_args()
    warnings.simplefilter("ignore", fd.errors.FoldynWarning)
    print("\n".join(f"- {line}" for line in machine.describe(None)))
    structure, supports, start = specimen()
    compare(fd.Case(structure, supports, [], fd.Rayleigh(15.8)), start, options.rounds, None)
    if options.beta:
        damped = fd.Case(structure, supports, [], fd.Rayleigh(14.4, 4.1e-4))
        compare(damped, start, options.rounds, options.keep)


if __name__ == "__main__":
    main()
