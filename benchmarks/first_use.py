"""How long first uses wait for the compiler, in processor seconds of one process each.

    python benchmarks/first_use.py [--rounds 3]

Each round starts with an empty folder of kernels and computes motions of a four-panel sheet one
after the other, each with something new; then modes and implicit motions in a second folder, and
modes of superelements in a third; then second processes of the first and the last kind, which find
all kernels and condensed panels, and Python's bytecode, as an installed package has it. Printed are
the medians, and beside each how much slower the machine was than at its best: the time of a fixed
piece of Python before and after, over the shortest one met.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping

LOOPS = 400_000
PROCESSES = {
    "explicit": "a second process, all five",
    "implicit": "",
    "superelements": "a second process, both",
}
"""What second processes are called in the table, by kind."""


def piece() -> float:
    """Processor seconds of a fixed piece of work."""
    begun, total = time.process_time(), 0
    for k in range(LOOPS):
        total += k * k % 7
    return time.process_time() - begun


def uses() -> Mapping[str, Mapping[str, Callable[[], object]]]:
    """What is computed, in order, by the name of the process that does it."""
    import foldyn as fd

    structure = fd.discretize(
        fd.patterns.miura(cells=(1, 1)), fd.Sheet(1e6, 0.25, 0.01, 1.0), preset="plate"
    )
    held, spring = fd.Fix("xmin"), fd.Spring(1.0, nodes=[7])
    push, contact = fd.Force([5], (0.0, 0.0, 1e-3)), fd.Contact()

    def case(*supports, **parts):
        return fd.Case(structure, [held, *supports], [push], **parts)

    def motion(method, *supports, **parts):
        return lambda: fd.simulate(case(*supports, **parts), 0.01, method=method)

    def panels():
        pattern = fd.patterns.miura(cells=(3, 3), dihedral=120)
        own = fd.superelements(pattern, fd.Sheet(1e9, 0.3, 0.01, 1000.0))
        return fd.modes(fd.Case(own, [fd.Fix("xmin", along=True)]), 6)

    return {
        "explicit": {
            "first rk4 motion": motion("rk4"),
            "central_difference": motion("central_difference"),
            "a spring, rk4": motion("rk4", spring),
            "contact, rk4": motion("rk4", contact=contact),
            "contact and spring, dormand_prince": motion("dormand_prince", spring, contact=contact),
        },
        "implicit": {
            "first modes": lambda: fd.modes(case(), 6),
            "newmark after that": motion("newmark"),
            "energy_momentum after that": motion("energy_momentum"),
        },
        "superelements": {"modes of 36 superelements": panels, "the same again": panels},
    }


def run(process: str) -> None:
    """Compute in this process and print the seconds and slowdowns of each use."""
    found, begun = {}, time.process_time()
    for name, compute in uses()[process].items():
        before = piece()
        start = time.process_time()
        compute()
        found[name] = time.process_time() - start, before, piece()
    found["the whole process"] = time.process_time() - begun, before, piece()
    print(json.dumps(found))


def measured(
    process: str, kernels: str, bytecode: str = ""
) -> dict[str, tuple[float, float, float]]:
    """The same from a process with a folder of kernels, and one of bytecode that it fills."""
    environment = os.environ | {"NUMBA_CACHE_DIR": kernels}
    if bytecode:
        environment |= {"PYTHONPYCACHEPREFIX": bytecode, "PYTHONDONTWRITEBYTECODE": ""}
    command = [sys.executable, "-W", "ignore", __file__, "--process", process]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--process", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.process:
        run(given.process)
        return
    rounds: list[dict[str, tuple[float, float, float]]] = []
    for _ in range(given.rounds):
        found = {}
        for process, second in PROCESSES.items():
            with tempfile.TemporaryDirectory() as folder:
                found |= measured(process, folder)
                del found["the whole process"]
                for _ in range(2 if second else 0):  # the first one fills the folder
                    again = measured(process, folder, f"{folder}/bytecode")["the whole process"]
                    found[second] = again
        rounds.append(found)
    best = min(piece for one in rounds for _, *pieces in one.values() for piece in pieces)
    print(f"{'':36}  CPU s  slowdown")
    for name in rounds[0]:
        seconds = statistics.median(one[name][0] for one in rounds)
        slow = statistics.median(sum(one[name][1:]) / 2.0 / best for one in rounds)
        print(f"{name:36} {seconds:6.1f}  {slow:8.2f}")


if __name__ == "__main__":
    main()
