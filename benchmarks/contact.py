"""Time of an explicit step with contact and without: `python benchmarks/contact.py`.

Miura sheets of paper that vibrate in the open, so that nothing touches. Runs with and without
contact take turns; the quickest of each counts.
"""

from __future__ import annotations

import time

import numpy as np

import foldyn as fd

# cells, steps of a run
SHEETS = {(4, 3): 20_000, (30, 30): 200, (100, 100): 20}
METHODS = ("rk4", "central_difference")
TURNS = 3
PAPER = fd.Sheet(1.219e9, 0.2, 0.24e-3, 690.0, length_scale_ratio=2.7)


def sheet(cells: tuple[int, int], dihedral: float) -> fd.Structure:
    """A folded sheet."""
    pattern = fd.patterns.miura(cells=cells, a=0.02, b=0.02, panel_angle=60, dihedral=dihedral)
    return fd.discretize(pattern, PAPER, mass="mixed_voronoi")


def step_times(structure: fd.Structure, method: str, steps: int) -> tuple[float, float]:
    """Seconds of a step without contact and with it."""
    start = 0.02 * np.random.default_rng(1).standard_normal(structure.nodes.shape)
    best, dt = [np.inf, np.inf], 0.5 * fd.critical_step(fd.Case(structure), method)
    for _ in range(TURNS):
        for k, contact in enumerate((None, fd.Contact())):
            case = fd.Case(structure, contact=contact)
            run = fd.simulate(
                case, steps * dt, method=method, dt=dt, every=steps,
                initial=fd.State(velocity=start),
            )  # fmt: skip
            best[k] = min(best[k], float(run.attrs["wall_seconds"]) / steps)
    return best[0], best[1]


def list_time(structure: fd.Structure) -> tuple[float, int]:
    """Seconds of a list of near pairs, and how many pairs it has."""
    body = fd.Case(structure, contact=fd.Contact()).body
    rest = np.zeros(structure.nodes.size)
    best, far = np.inf, np.zeros_like(structure.nodes)
    far[0] = 1.0  # what moved so far asks for a new list
    body.contact(rest)
    for _ in range(TURNS):
        body.contact(far.ravel())
        begun = time.perf_counter()
        body.contact(rest)
        best = min(best, time.perf_counter() - begun)
    counts = body._memory.counts
    return best, int(counts.listed_first + counts.listed_second)


def main() -> None:
    """Print a table."""
    print("| dofs | method | without (us) | with (us) | ratio | list (ms) | pairs |")
    print("|---|---|---|---|---|---|---|")
    for cells, steps in SHEETS.items():
        structure = sheet(cells, 60.0)
        listed, pairs = list_time(structure)
        for method in METHODS:
            off, on = step_times(structure, method, steps)
            print(
                f"| {structure.nodes.size:,} | `{method}` | {1e6 * off:.1f} | {1e6 * on:.1f} | "
                f"{on / off:.2f} | {1e3 * listed:.2f} | {pairs:,} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
