"""Our shell beside the stored results of OpenSees, as tables in Markdown.

    python -m foldyn.studies.herkal.opensees.compare --divisions 16 32 [--motion 16]

prints how the results of OpenSees converge, and how far ours are from them.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case, CaseFile, read_case
from foldyn.dynamics import simulate
from foldyn.linear import modes
from foldyn.shells import shell
from foldyn.statics import trace
from foldyn.studies import find_case
from foldyn.studies.herkal.opensees.stored import (
    CASES,
    Moved,
    Still,
    read_motion,
    read_still,
    stored_divisions,
    stored_motions,
)

COUNT = 5  # frequencies


def our_case(name: str, divisions: int) -> tuple[CaseFile, Case]:
    """A case study with our shell."""
    case_file = read_case(find_case(f"herkal/{name}"))
    given = case_file.case()
    law = given.structure.options.fold_law
    structure = shell(case_file.pattern, case_file.sheet, divisions, fold_law=law)
    return case_file, Case(structure, given.supports, given.loads, given.damping)


def our_still(name: str, divisions: int) -> Still:
    """Statics and frequencies of a case study with our shell."""
    case_file, case = our_case(name, divisions)
    path = trace(case, steps=4)
    unloaded = Case(case.structure, case.supports)
    return Still(
        node=case_file.output.nodes,
        load_factor=path.load_factor.values,
        displacement=path.displacement.sel(node=case_file.output.nodes).values,
        frequency=modes(unloaded, COUNT).frequency.values,
        about={"case": name, "divisions": divisions},
    )


def our_motion(name: str, divisions: int, dt: float, method: str = "newmark") -> Moved:
    """Motion of a case study with our shell, sampled every 0.01 s."""
    case_file, case = our_case(name, divisions)
    duration = case_file.analysis.arguments["duration"]
    motion = simulate(case, duration, method=method, dt=dt, every=0.01)
    return Moved(
        node=case_file.output.nodes,
        time=motion.time.values,
        displacement=motion.displacement.sel(node=case_file.output.nodes).values,
        about={"case": name, "divisions": divisions, "dt": dt},
    )


def away(still: Still, reference: Still) -> tuple[float, NDArray]:
    """Relative differences of the static displacements at full load and of the frequencies.

    The first is the largest of all nodes: distance over displacement.
    """
    moved, wanted = still.displacement[-1], reference.displacement[-1]
    apart = np.linalg.norm(moved - wanted, axis=1) / np.linalg.norm(wanted, axis=1)
    return float(apart.max()), still.frequency / reference.frequency - 1.0


def motion_away(motion: Moved, reference: Moved) -> float:
    """Relative difference of two motions: L2 over time, nodes and axes."""
    shared = np.isin(np.round(reference.time, 6), np.round(motion.time, 6))
    wanted = reference.displacement[shared]
    if len(wanted) != len(motion.time):
        raise ValueError("the motions have no common samples")
    difference = np.linalg.norm(motion.displacement - wanted)
    return float(difference / np.linalg.norm(wanted))


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A table in Markdown."""
    lines = [list(head)]
    lines += [["---"] * len(lines[0]), *map(list, rows)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def percent(value: float) -> str:
    """0.0123 as 1.23."""
    return f"{100.0 * value:.2f}"


def still_row(name: str, still: Still, reference: Still | None) -> list[str]:
    """Values and, in percent, how far they are from a reference."""
    axis = "xyz".index(read_case(find_case(f"herkal/{name}")).output.axis or "x")
    row = [name, str(still.about["divisions"])]
    row.append(" ".join(f"{value:.5f}" for value in still.displacement[-1, :, axis]))
    row.append(" ".join(f"{value:.4f}" for value in still.frequency))
    if reference is None:
        return [*row, "", ""]
    moved, frequency = away(still, reference)
    return [*row, percent(moved), " ".join(map(percent, frequency))]


HEAD = ("case", "divisions", "displacement, m", "frequencies, Hz", "off, %", "off, %")


def convergence() -> str:
    """Results of OpenSees at all meshes, and their distances from those at the finest."""
    rows = []
    for name in CASES:
        *coarse, finest = (read_still(name, divisions) for divisions in stored_divisions(name))
        rows += [still_row(name, still, finest) for still in coarse]
        rows.append(still_row(name, finest, None))
    return table(HEAD, rows)


def agreement(divisions: Iterable[int]) -> str:
    """Our shell, and its distances from the finest results of OpenSees."""
    rows = []
    for name in CASES:
        finest = read_still(name, stored_divisions(name)[-1])
        rows += [still_row(name, our_still(name, n), finest) for n in divisions]
    return table(HEAD, rows)


def motion_convergence() -> str:
    """Motions of OpenSees, with their distances from the best of the same case."""
    rows = []
    for name in CASES:
        found = [read_motion(name, *one) for one in stored_motions(name)]
        for motion in found:
            about = motion.about
            off = percent(motion_away(motion, found[-1])) if motion is not found[-1] else ""
            row = [name, about["divisions"], about["dt"], f"{about['seconds']:.0f}", off]
            rows.append(list(map(str, row)))
    return table(("case", "divisions", "step, s", "processor time, s", "off, %"), rows)


def motion_agreement(divisions: int) -> str:
    """Motions of our shell, and their distances from the best of OpenSees."""
    rows = []
    for name in CASES:
        best = read_motion(name, *stored_motions(name)[-1])
        ours = our_motion(name, divisions, best.about["dt"])
        rows.append([name, str(divisions), percent(motion_away(ours, best))])
    return table(("case", "divisions", "off, %"), rows)


def main(arguments: list[str] | None = None) -> int:
    """Print what the command line asks for."""
    parser = argparse.ArgumentParser(description="Our shell beside OpenSees.")
    parser.add_argument("--divisions", type=int, nargs="*", default=[16])
    parser.add_argument("--motion", type=int, help="divisions of motions of our shell")
    chosen = parser.parse_args(arguments)
    parts = [convergence, partial(agreement, chosen.divisions), motion_convergence]
    if chosen.motion:
        parts.append(partial(motion_agreement, chosen.motion))
    for part in parts:
        print(part(), end="\n\n", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
