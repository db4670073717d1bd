"""Peak memory of a long motion against a short one: `python benchmarks/ram_limit.py`.

A sheet of the specimen's size, output every 1000 steps; each run is a process of its own, after one
that fills the kernel cache.
"""

from __future__ import annotations

import resource
import subprocess
import sys

import foldyn as fd


def peak(steps: int) -> float:
    """Peak memory (MiB) of a process that computes so many steps."""
    command = [sys.executable, __file__, str(steps)]
    return float(subprocess.run(command, capture_output=True, text=True, check=True).stdout)


def run(steps: int) -> None:
    """Compute a motion of 333 dofs and print this process's peak memory (MiB)."""
    pattern = fd.patterns.miura(cells=(4, 3), a=0.025, b=0.025, panel_angle=60, dihedral=60)
    paper = fd.Sheet(1219e6, 0.2, 0.24e-3, 667.0, length_scale_ratio=2.7)
    structure = fd.discretize(
        pattern, paper, fold_law=fd.EnhancedLinear(theta1=75, theta2=285), preset="herkal"
    )
    load = fd.Force([0], (1e-3, 0.0, 0.0), fd.Harmonic(9.0))
    supports = [fd.Fix(range(56, 63), "x"), fd.Fix([59], "y"), fd.Fix([57, 59, 61], "z")]
    case = fd.Case(structure, supports, [load])
    dt = 0.4 * fd.critical_step(case)
    fd.simulate(case, steps * dt, method="rk4", dt=dt, every_steps=1000)
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        run(int(sys.argv[1]))
    else:
        peak(1000)
        short, long = peak(1000), peak(1_000_000)
        print(f"1e3 steps {short:.1f} MiB, 1e6 steps {long:.1f} MiB: {long - short:.1f} more")
