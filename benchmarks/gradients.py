"""Gradients: what they cost beside what they are gradients of, as ratios of one run.

python benchmarks/gradients.py [CELLS]
"""

from __future__ import annotations

import resource
import sys
import time
import warnings
from collections.abc import Callable

import foldyn as fd

PAPER = fd.Sheet(1.219e9, 0.2, 2.4e-4, 667.0)
ARRAYS = ["fold_stiffness", "fold_rest", "bend_stiffness", "bend_rest", "bar_area", "bar_length"]
STEPS, DT = 10_000, 8e-6


def seconds(compute: Callable[[], object]) -> float:
    """CPU time (s)."""
    began = time.process_time()
    compute()
    return time.process_time() - began


def compare(what: str, plain: Callable[[], object], gradient: Callable[[], object]) -> None:
    """Both three times, the median ratio; and the memory that the gradient adds."""
    plain()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    gradient()
    more = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - peak) / 1024
    pairs = [(seconds(plain), seconds(gradient)) for _ in range(3)]
    ratio = sorted(two / one for one, two in pairs)[1]
    print(f"{what}: {pairs[1][0]:.2f} s, with gradient {pairs[1][1]:.2f} s, ratio {ratio:.2f}")
    print(f"    {more:.1f} MB more, what was compiled or read among it")


def motion() -> None:
    """10,000 steps by RK4 of 333 dofs, and one number of it by 1,152 numbers of the structure."""
    pattern = fd.patterns.miura(cells=(4, 3), a=0.025, b=0.025)
    law = fd.EnhancedLinear(75, 285)
    made = fd.discretize(pattern, PAPER, preset="herkal", fold_law=law)
    push = fd.Force("xmin", (-1e-3, 0, 2e-4), fd.HalfSine(0.005))
    case = fd.Case(made, [fd.Fix("xmax")], [push], [fd.Rayleigh(2.0)])
    given = {"duration": STEPS * DT, "method": "rk4", "dt": DT, "every_steps": STEPS // 10}
    analysis = {"kind": "dynamics", **given}
    compare(
        f"motion of {made.nodes.size} dofs",
        lambda: fd.simulate(case, **given),
        lambda: fd.sensitivity(case, ARRAYS, measures="displacement[30,x]", analysis=analysis),
    )


def modes(cells: int) -> None:
    """Six frequencies of a large sheet by the stiffness of all its creases."""
    pattern = fd.patterns.miura(cells=(cells, cells))
    sheet = fd.Sheet(1e6, 0.25, 0.01, 1000.0)
    made = fd.discretize(pattern, sheet, preset="merlin2", bend_law="linear")
    case = fd.Case(made, [fd.Fix("xmin")])
    texts = [f"frequency[{k}]" for k in range(1, 7)]
    analysis = {"kind": "modes", "count": 6}
    compare(
        f"six modes of {made.nodes.size} dofs, {len(pattern.creases)} creases",
        lambda: fd.modes(case, count=6),
        lambda: fd.sensitivity(case, ["fold_stiffness"], measures=texts, analysis=analysis),
    )


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    motion()
    modes(int(sys.argv[1]) if len(sys.argv) > 1 else 30)
