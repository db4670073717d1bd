"""Large motions by the shell and the models: sheets released from a fold, the paper's pulses.

    python -m foldyn.studies.fidelity.motions --out FOLDER

writes motions.csv, by default into the folder of stored results, and prints its summaries.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.algebra.extrapolation import extrapolated
from foldyn.analyses import read_case
from foldyn.cases import Case, State
from foldyn.dynamics import simulate
from foldyn.errors import ComputationError, FoldynWarning, InstabilityError, PenetrationError
from foldyn.linear import mac, modes
from foldyn.linear.reference import DIVISIONS, elastic, modes_at_rest
from foldyn.patterns import Pattern
from foldyn.patterns.topology import Edge
from foldyn.shells import Shell, shell
from foldyn.structures import discretize
from foldyn.structures.presets import resolved
from foldyn.studies import find_case
from foldyn.studies.fidelity.cases import FidelityCase, documented
from foldyn.studies.fidelity.compare import reference
from foldyn.studies.fidelity.cycles import Cycles, NoCyclesError, cycles
from foldyn.studies.fidelity.large import LAWS
from foldyn.studies.fidelity.motion_results import SHELL, STORED, Run, summaries, write
from foldyn.studies.fidelity.release import Release, vertex_mass
from foldyn.studies.fidelity.statics import STUDIES

AMPLITUDES = (5.0, 20.0, 50.0)  # degrees of fold
CASES: Mapping[int, tuple[float, ...]] = {
    **dict.fromkeys((0, 1, 9, 11, 12, 17, 23, 28, 29, 18, 46, 50, 39), AMPLITUDES),
    13: (5.0, 20.0),
    25: (5.0, 20.0),
    34: (5.0,),
}
"""Numbers in the documented set, from 0, and amplitudes: first modes that fold, in supports that
hold the sheet. Beyond the last amplitude of the last three a motion of the shell takes minutes."""
REACHED = 0.8  # of the shell's largest fold: the last amplitude if that is below 50
APART = 1.25  # least ratio of two amplitudes
PERIODS = 6.0  # of the linear shell: length of a free vibration in periods
STEPS = 100  # steps in such a period
HALVINGS = 2  # of the step, if a motion becomes unstable
METHOD = "generalized_alpha"
PULSE_STEP, PULSE_LENGTH = 0.01, 16.0  # s: time step and duration of a pulsed motion
PULSE_END = 0.5  # s: end of the paper's pulse
BAND = (0.4, 2.5)  # of the shell's first frequency: band of its fundamental
PULSE_BAND = (0.5, 4.0)
NEAR = (0.5, 2.0)  # of the shell's fundamental: band of a model's


class Motion(NamedTuple):
    """A motion: sampling interval (s), a coordinate (n,) and the vertices (n, v, 3), m."""

    dt: float
    coordinate: NDArray
    vertices: NDArray


@dataclass(frozen=True, eq=False)
class Started:
    """Start of a case's motion, for all models.

    Attributes
    ----------
    case, start : str
        Names: the start is an amplitude in degrees, or "pulse".
    pattern : Pattern
    mesh : float
        Frequency of the shell's mesh over the extrapolated one.
    band : (float, float)
        Band of the shell's fundamental, Hz.
    released : bool
        Whether it starts from rest and without loads, undamped.
    motion : mapping of str to callable
        Computes the motion of the shell and of each model; raises `ComputationError` on failure.
    """

    case: str
    start: str
    pattern: Pattern
    mesh: float
    band: tuple[float, float]
    released: bool
    motion: Mapping[str, Callable[[], Motion]]


def runs(started: Started) -> list[Run]:
    """Run the shell and all models from a start."""
    weight = vertex_mass(started.pattern)
    found = []
    true: tuple[Cycles, NDArray] | None = None
    band = started.band
    for model, move in started.motion.items():
        try:
            motion = move()
            own = cycles(motion.coordinate, motion.dt, *band, released=started.released)
        except (ComputationError, NoCyclesError) as error:
            note = str(error).split(":")[0]
            found.append(Run(started.case, started.start, model, started.mesh, note=note))
            if true is None:
                return found
            continue
        shapes = _at(motion, own.extreme)
        if true is None:
            true = own, shapes
            frequency = 1.0 / own.period.mean()
            band = NEAR[0] * frequency, NEAR[1] * frequency
        alike = _alike(true[1], shapes, weight)
        found.append(
            Run(
                started.case, started.start, model, started.mesh, own.share,
                tuple(own.period), tuple(alike),
            )
        )  # fmt: skip
    return found


def _at(motion: Motion, times: NDArray) -> NDArray:
    """Displacements (k, v, 3) of the vertices, interpolated at times (k,), s."""
    place = np.clip(times / motion.dt, 0.0, len(motion.vertices) - 1.000001)
    before = place.astype(int)
    part = (place - before)[:, None, None]
    return (1.0 - part) * motion.vertices[before] + part * motion.vertices[before + 1]


def _alike(true: NDArray, own: NDArray, weight: NDArray) -> NDArray:
    """MAC (k,) of the shapes at corresponding extremes."""
    pairs = zip(true, own, strict=False)
    return np.array([mac(a[None], b[None], mass=weight)[0, 0] for a, b in pairs])


def structures(
    pattern: Pattern, sheet: Any, divisions: int, edges: Sequence[Edge] = (), **creases: Any
) -> dict[str, Any]:
    """The shell and the models of a sheet, with some edges held along their length."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)
        made: dict[str, Any] = {
            SHELL: shell(pattern, sheet, divisions=divisions, mass="consistent", **creases)
        }
        for law, own in LAWS.items():
            given: dict[str, Any] = {**own, **creases}
            if resolved(**own).bowed:
                given["straight"] = edges
            made[law] = discretize(pattern, sheet, **given)
    return made


def released(
    case: FidelityCase, amplitudes: Sequence[float] = AMPLITUDES, divisions: int = DIVISIONS[0]
) -> Iterator[Started]:
    """Free vibrations of a case from amplitudes (degrees, increasing)."""
    made = structures(case.pattern(), case.sheet, divisions, case.held.edges)
    frequency, shape = elastic(modes_at_rest(case.case(made[SHELL]), 1), 1)
    true = reference(case)
    release = Release.of(case, made[SHELL], shape[0])
    within = _reachable(release, made[SHELL], amplitudes)
    held = {model: release.held(own, np.radians(within).tolist()) for model, own in made.items()}
    dt = 1.0 / (STEPS * frequency[0])

    def move(model: str, k: int) -> Motion:
        if k >= len(held[model]):
            raise ComputationError("the fold is not reached")
        start = State(held[model][k].displacement)
        moved = _motion(case.case(made[model]), PERIODS / frequency[0], dt, start)
        vertices = moved.displacement.values[:, : len(release.force)]
        return Motion(float(moved.time[1]), np.unwrap(release.fold(vertices)), vertices)

    for k, amplitude in enumerate(within):
        motions = {model: lambda m=model, k=k: move(m, k) for model in made}
        mesh = float(frequency[0] / true.frequency[0])
        band = BAND[0] * frequency[0], BAND[1] * frequency[0]
        yield Started(case.name, f"{amplitude:.3g}", case.pattern(), mesh, band, True, motions)


def _reachable(release: Release, structure: Shell, amplitudes: Sequence[float]) -> list[float]:
    """Amplitudes (degrees), the last one limited by the shell's path."""
    largest = REACHED * np.degrees(release.largest(structure, np.radians(amplitudes[-1])))
    if largest >= REACHED * amplitudes[-1]:
        return list(amplitudes)
    within = [a for a in amplitudes if a <= largest]
    return (
        within if within and largest < APART * within[-1] else [*within, float(np.floor(largest))]
    )


def pulsed(name: str, divisions: int = DIVISIONS[0]) -> Started:
    """A case study of the paper under its pulse."""
    given = read_case(find_case(f"herkal/{name}")).case("circumcenter")
    pattern, sheet = given.structure.pattern, given.structure.sheet
    made = structures(pattern, sheet, divisions, fold_law=given.structure.options.fold_law)
    force = np.sum([p for p, _ in given.load_terms], axis=0)[: len(pattern.vertices)]
    meshes = (made[SHELL], shell(pattern, sheet, divisions=DIVISIONS[1], mass="consistent"))
    free = replace(given, loads=())
    coarse, fine = (modes(replace(free, structure=s), 1).frequency.values[0] for s in meshes)
    limit = extrapolated(coarse, fine, DIVISIONS[1] / divisions)
    skipped = round(PULSE_END / PULSE_STEP)

    def move(structure: Any) -> Motion:
        moved = _motion(replace(given, structure=structure), PULSE_LENGTH, PULSE_STEP)
        vertices = moved.displacement.values[:, : len(force)]
        dt = float(moved.time[1])
        vertices = vertices[round(skipped * PULSE_STEP / dt) :]
        return Motion(dt, np.einsum("tva,va->t", vertices, force), vertices)

    motions = {model: lambda s=s: move(s) for model, s in made.items()}
    band = PULSE_BAND[0] * coarse, PULSE_BAND[1] * coarse
    return Started(name, "pulse", pattern, float(coarse / limit), band, False, motions)


def _motion(case: Case, duration: float, dt: float, start: State | None = None) -> Any:
    """Run a motion, with shorter steps if it is unstable or panels pass through each other.

    If that does not help, the motion ends where panels pass through each other.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)
        for halving in range(HALVINGS):
            try:
                return simulate(case, duration, method=METHOD, dt=dt / 2**halving, initial=start)
            except (InstabilityError, PenetrationError):
                continue
        try:
            return simulate(case, duration, method=METHOD, dt=dt / 2**HALVINGS, initial=start)
        except PenetrationError as error:
            return error.partial


def every(cases: Iterable[int] = CASES, studies: Iterable[str] = STUDIES) -> Iterator[Started]:
    """All starts of the study."""
    for name in studies:
        yield pulsed(name)
    known = documented()
    for number in cases:
        yield from released(known[number], CASES.get(number, AMPLITUDES))


def main(arguments: list[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description="Large motions of bars and hinges and the shell.")
    parser.add_argument("--out", type=Path, default=STORED.parent, help="folder of the table")
    parser.add_argument(
        "--cases", type=int, nargs="*", default=list(CASES), help="numbers of cases"
    )
    parser.add_argument("--studies", nargs="*", default=STUDIES, help="names of case studies")
    chosen = parser.parse_args(arguments)
    chosen.out.mkdir(parents=True, exist_ok=True)
    found: list[Run] = []
    for started in every(chosen.cases, chosen.studies):
        print(f"{started.case}: {started.start}", file=sys.stderr, flush=True)
        found += runs(started)
        write(chosen.out / STORED.name, found)
    print(summaries(found))
    return 0


if __name__ == "__main__":
    sys.exit(main())
