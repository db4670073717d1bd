"""Our shell compared with stored results of OpenSees, as tables in Markdown.

    python -m verification.opensees.compare --divisions 16 32 64 [--motion 16 32 64]

prints the convergence of both, and how far our results are from those of OpenSees.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.dynamics import simulate
from foldyn.linear import modes
from foldyn.statics import trace
from foldyn.studies.herkal.runs import CASES, case_study, reported, shell_case
from verification.fidelity.compare import markdown
from verification.opensees import stored
from verification.opensees.run import DT, SAMPLES

COUNT = 5  # number of frequencies


def our_still(name: str, divisions: int) -> stored.Still:
    """Statics and frequencies of a case study with our shell."""
    case_file = case_study(name)
    case = shell_case(case_file, divisions)
    path, node = trace(case, steps=4), case_file.output.nodes
    return stored.Still(
        node=node,
        load_factor=path.load_factor.values,
        displacement=path.displacement.sel(node=node).values,
        frequency=modes(replace(case, loads=()), COUNT).frequency.values,
        about={"case": name, "divisions": divisions},
    )


def our_motion(name: str, divisions: int, dt: float, duration: float | None = None) -> stored.Moved:
    """Motion of a case study with our shell, sampled like the OpenSees motions.

    Its duration (s) is by default the case file's.
    """
    case_file = case_study(name)
    case = shell_case(case_file, divisions)
    length = duration or case_file.analysis.arguments["duration"]
    motion = simulate(case, length, method="newmark", dt=dt, interval=SAMPLES)
    return stored.Moved(
        node=case_file.output.nodes,
        time=motion.time.values,
        displacement=motion.displacement.sel(node=case_file.output.nodes).values,
        about={"case": name, "divisions": divisions, "dt": dt},
    )


def away(still: stored.Still, reference: stored.Still) -> tuple[float, NDArray]:
    """Relative differences of the static displacements at full load and of the frequencies.

    The first is the largest over all nodes: distance relative to displacement.
    """
    moved, wanted = still.displacement[-1], reference.displacement[-1]
    apart = np.linalg.norm(moved - wanted, axis=1) / np.linalg.norm(wanted, axis=1)
    return float(apart.max()), still.frequency / reference.frequency - 1.0


def motion_away(motion: stored.Moved, reference: stored.Moved) -> float:
    """Relative difference of two motions: L2 over time, nodes and axes."""
    shared = np.isin(np.round(reference.time, 6), np.round(motion.time, 6))
    wanted = reference.displacement[shared]
    if len(wanted) != len(motion.time):
        raise ValueError("the motions have no common samples")
    difference = np.linalg.norm(motion.displacement - wanted)
    return float(difference / np.linalg.norm(wanted))


def percent(value: float) -> str:
    """Format 0.0123 as 1.23."""
    return f"{100.0 * value:.2f}"


def still_table(
    found: Iterable[Sequence[stored.Still]], references: Sequence[Sequence[stored.Still]]
) -> str:
    """Results of each case from coarse to fine and, in percent, their distance from references.

    For frequencies it is the worst of the first three, and of all. A list of references has one for
    each case, in the same order.
    """
    head = ["case", "divisions", "displacement, m", "frequencies, Hz"]
    head += ["static, %", "f1 to f3, %", "f1 to f5, %"] * len(references)
    rows = []
    for number, still in _numbered(found):
        name = still.about["case"]
        _, axis, _ = reported(name)
        row = [name, str(still.about["divisions"])]
        moved = still.displacement[-1, :, "xyz".index(axis)]
        row.append(", ".join(f"{value:.5f}" for value in moved))
        row.append(", ".join(f"{value:.4f}" for value in still.frequency))
        for reference in (one[number] for one in references):
            moved, frequency = away(still, reference)
            worst = [float(np.abs(frequency[:count]).max()) for count in (3, COUNT)]
            row += [""] * 3 if reference is still else map(percent, (moved, *worst))
        rows.append(row)
    return markdown(head, rows)


def motion_table(
    found: Iterable[Sequence[stored.Moved]], references: Sequence[Sequence[stored.Moved]]
) -> str:
    """Table of motions, in the layout of `still_table`."""
    head = ["case", "divisions", "step, s", *["off, %"] * len(references)]
    rows = []
    for number, motion in _numbered(found):
        row = [str(motion.about[key]) for key in ("case", "divisions", "dt")]
        for reference in (one[number] for one in references):
            row.append("" if reference is motion else percent(motion_away(motion, reference)))
        rows.append(row)
    return markdown(head, rows)


def _numbered(found: Iterable[Sequence[Any]]) -> Iterator[tuple[int, Any]]:
    """Results of all cases, each with the number of its case."""
    return ((number, one) for number, results in enumerate(found) for one in results)


def main(arguments: list[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description="Our shell beside OpenSees.")
    parser.add_argument("--cases", nargs="+", choices=CASES, default=CASES)
    parser.add_argument("--divisions", type=int, nargs="*", default=[16], help="of our shell")
    parser.add_argument("--motion", type=int, nargs="*", default=[], help="the same for motions")
    parser.add_argument("--dt", type=float, default=DT, help="time step of our motions, s")
    chosen = parser.parse_args(arguments)
    cases = chosen.cases
    theirs = [[stored.read_still(name, n) for n in stored.stored_divisions(name)] for name in cases]
    finest = [stills[-1] for stills in theirs]
    print("OpenSees, and its distance from its finest mesh\n")
    print(still_table(theirs, [finest]), end="\n\n", flush=True)
    ours = [[our_still(name, n) for n in chosen.divisions] for name in cases]
    if chosen.divisions:
        print("Our shell, its distance from its finest mesh and from the finest of OpenSees\n")
        print(still_table(ours, [[s[-1] for s in ours], finest]), end="\n\n", flush=True)

    cases = [name for name in cases if stored.stored_motions(name)]
    moved = [
        [stored.read_motion(name, *one) for one in stored.stored_motions(name)] for name in cases
    ]
    print("Motions of OpenSees, and their distance from the finest\n")
    best = [motions[-1] for motions in moved]
    print(motion_table(moved, [best]), end="\n\n", flush=True)
    if chosen.motion:
        found = [[our_motion(name, n, chosen.dt) for n in chosen.motion] for name in cases]
        print("Motions of our shell, their distance from the finest and from that of OpenSees\n")
        print(motion_table(found, [[m[-1] for m in found], best]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
