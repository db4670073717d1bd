"""Large motions by the shell and the models: sheets released from a fold, the paper's pulses.

    python -m verification.fidelity.motions --out FOLDER

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
from scipy.sparse.linalg import spsolve

from foldyn.algebra.extrapolation import extrapolated
from foldyn.analyses import read_case
from foldyn.cases import Case, Force, State
from foldyn.dynamics import simulate
from foldyn.errors import ComputationError, FoldynWarning, InstabilityError, PenetrationError
from foldyn.linear import linearize, mac, modes
from foldyn.linear.reference import elastic, modes_at_rest
from foldyn.linear.shell_of import DIVISIONS
from foldyn.patterns import Pattern
from foldyn.patterns.geometry import face_geometry
from foldyn.patterns.topology import Edge
from foldyn.shells import Shell, shell
from foldyn.statics import Settings, trace
from foldyn.structures import discretize
from foldyn.structures.discretized import Discretized
from foldyn.structures.presets import resolved
from foldyn.studies import find_case
from foldyn.studies.herkal.runs import CASES as STUDIES
from verification.fidelity.cases import FidelityCase, documented
from verification.fidelity.compare import reference
from verification.fidelity.cycles import Cycles, NoCyclesError, cycles
from verification.fidelity.motion_results import SHELL, STORED, Run, summaries, write
from verification.fidelity.statics import LAWS

FIRST_STEP = 0.1  # share of the load that folds a linear shell to the largest amplitude
MOST_STEPS = 80  # most steps on the way there
EXACT = 1e-4  # relative error of the held fold
SECANTS = 8
SETTINGS = Settings(stability=False, locate=False)
MOVING = 0.3  # least change of a moving fold, relative to the largest
SMALL = 1e-6  # displacement, relative to the size, with linear changes of folds


class Held(NamedTuple):
    """An equilibrium: displacement (n, 3), m, and the change of the reference fold, rad."""

    displacement: NDArray
    fold: float


def fold_of(pattern: Pattern, crease: int, displacement: NDArray) -> NDArray:
    """Fold angle (...) of a crease, rad: its dihedral minus pi, in -pi to pi.

    Parameters
    ----------
    displacement : (..., n, 3)
        Displacements of the vertices, m.
    """
    a, b = (int(v) for v in pattern.creases[crease])
    first, second = (face for face in pattern.faces if a in face and b in face)
    if first[(first.index(a) + 1) % len(first)] != b:
        first, second = second, first
    moved = pattern.vertices + displacement[..., : len(pattern.vertices), :]
    one, other = (_area(moved[..., list(face), :]) for face in (first, second))
    along = moved[..., b, :] - moved[..., a, :]
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    sine = np.einsum("...a,...a->...", np.cross(one, other), along)
    return np.arctan2(sine, np.einsum("...a,...a->...", one, other))


def _area(corners: NDArray) -> NDArray:
    """Area vectors (..., 3) of polygons with corners (..., k, 3)."""
    about = corners - corners[..., :1, :]
    return 0.5 * np.cross(about, np.roll(about, -1, axis=-2)).sum(axis=-2)


def vertex_mass(pattern: Pattern) -> NDArray:
    """Weights (n,) of the vertices: equal shares of the areas of their panels."""
    weight = np.zeros(len(pattern.vertices))
    areas = face_geometry(pattern.vertices, pattern.faces).face_areas
    for face, area in zip(pattern.faces, areas, strict=True):
        weight[list(face)] += area / len(face)
    return weight


@dataclass(frozen=True, eq=False)
class Release:
    """Loads that hold a sheet folded.

    Attributes
    ----------
    case : FidelityCase
    crease : int
        The reference crease.
    sense : float
        1 where its fold angle grows, -1 where it falls.
    force : (n, 3)
        Forces on the vertices, N, that would change a linear shell's fold by 1 rad.
    """

    case: FidelityCase
    crease: int
    sense: float
    force: NDArray

    @classmethod
    def of(cls, case: FidelityCase, structure: Discretized, shape: NDArray) -> Release:
        """Make a release from a mode of a structure, its shape (n, 3), and the linear equilibrium.

        The tightest moving crease opens if its panels are less than a right angle apart, else it
        closes.
        """
        pattern = case.pattern()
        n = len(pattern.vertices)
        held = case.case(structure)
        force = np.where(held.fixed[:n], 0.0, vertex_mass(pattern)[:, None] * shape[:n])
        moved = _linear(held, force)
        small = SMALL * pattern.size / np.abs(moved).max()
        creases = range(len(pattern.creases))
        rest = np.array([fold_of(pattern, k, np.zeros((n, 3))) for k in creases])
        turned = np.array([fold_of(pattern, k, small * moved) for k in creases]) - rest
        crease = int(np.argmax(np.abs(turned)))
        moving = np.abs(turned) > MOVING * np.abs(turned[crease])
        tightest = int(np.argmax(np.abs(rest) * moving))
        opening = abs(rest[tightest]) > np.pi / 2 - 1e-9
        wanted = float(np.sign(rest[tightest])) * (-1.0 if opening else 1.0)
        sense = float(np.sign(turned[crease] * turned[tightest])) * wanted
        return cls(case, crease, sense, force * sense * small / turned[crease])

    def fold(self, displacement: NDArray) -> NDArray:
        """Change (...) of the reference fold, positive in its sense, rad."""
        pattern = self.case.pattern()
        rest = fold_of(pattern, self.crease, np.zeros_like(pattern.vertices))
        return self.sense * (fold_of(pattern, self.crease, displacement) - rest)

    def held(self, structure: Discretized, amplitudes: Sequence[float]) -> list[Held]:
        """Equilibria at which the reference fold has changed by amplitudes (rad, increasing).

        The list ends before the first amplitude that the path does not reach or that is not found.
        """
        last = float(amplitudes[-1])
        case = self._loaded(structure, last)
        displacement, factor = self._path(case, last)
        fold = self.fold(displacement)
        found = []
        for amplitude in amplitudes:
            beyond = np.flatnonzero(fold >= amplitude)
            if not len(beyond):
                break
            k = int(beyond[0])
            try:
                found.append(self._exact(case, displacement, fold, factor, k, float(amplitude)))
            except ComputationError:
                break
        return found

    def largest(self, structure: Discretized, last: float) -> float:
        """Largest change of the fold (rad) until its path turns back, ends, or exceeds `last`."""
        displacement, _ = self._path(self._loaded(structure, last), last)
        return float(self.fold(displacement).max())

    def _loaded(self, structure: Discretized, last: float) -> Case:
        loads = [Force([v], tuple(last * f)) for v, f in enumerate(self.force) if np.any(f)]
        return replace(self.case.case(structure), loads=loads)

    def _path(self, case: Case, last: float) -> tuple[NDArray, NDArray]:
        """Displacements (k, n, 3) and load factors (k,) while the fold grows, up to `last`."""
        largest = 0.0

        def ended(u: NDArray, factor: float) -> bool:
            nonlocal largest
            fold = float(self.fold(u))
            turned_back, largest = fold < largest, max(fold, largest)
            return turned_back or fold >= last

        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FoldynWarning)
            try:
                path = trace(
                    case, "arc_length", steps=MOST_STEPS, first_step=FIRST_STEP, settings=SETTINGS,
                    until=ended,
                )  # fmt: skip
            except ComputationError as error:
                if error.partial is None:
                    raise
                path = error.partial
        return path.displacement.values, path.load_factor.values

    def _exact(
        self, case: Case, u: NDArray, fold: NDArray, factor: NDArray, k: int, amplitude: float
    ) -> Held:
        """Find the equilibrium of an amplitude between points k - 1 and k of a path by secants."""
        points = [(fold[k - 1], factor[k - 1], u[k - 1]), (fold[k], factor[k], u[k])]
        for _ in range(SECANTS):
            (f0, l0, u0), (f1, l1, u1) = points
            part = (amplitude - f0) / (f1 - f0)
            wanted, near = l0 + part * (l1 - l0), u0 + part * (u1 - u0)
            path = trace(
                case, "newton", load_factors=[wanted], initial=State(near), settings=SETTINGS
            )
            moved = path.displacement.values[-1]
            now = float(self.fold(moved))
            if abs(now - amplitude) < EXACT * amplitude:
                break
            nearer = points[0] if abs(f0 - amplitude) < abs(f1 - amplitude) else points[1]
            points = [nearer, (now, wanted, moved)]
        return Held(moved, now)


def _linear(case: Case, force: NDArray) -> NDArray:
    """Displacements (n, 3) of the vertices in the linear equilibrium under forces (n, 3)."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)
        linear = linearize(case)
    every = np.zeros(case.body.size)
    every[: force.size] = force.ravel()
    found = np.zeros(case.body.size)
    found[linear.free] = spsolve(linear.stiffness, every[linear.free])
    return found[: force.size].reshape(force.shape)


AMPLITUDES = (5.0, 20.0, 50.0)  # degrees of fold
# Numbers in the documented set, from 0, and amplitudes: first modes that fold, in supports that
# hold the sheet. Beyond the last amplitude of the last three a motion of the shell takes minutes.
CASES: Mapping[int, tuple[float, ...]] = {
    **dict.fromkeys((0, 1, 9, 11, 12, 17, 23, 28, 29, 18, 46, 50, 39), AMPLITUDES),
    13: (5.0, 20.0),
    25: (5.0, 20.0),
    34: (5.0,),
}
REACHED = 0.8  # last amplitude relative to the shell's largest fold, if below 50 degrees
APART = 1.25  # least ratio of two amplitudes
PERIODS = 6.0  # length of a free vibration, in periods of the linear shell
STEPS = 100  # steps in such a period
HALVINGS = 2  # most halvings of the step if a motion becomes unstable
METHOD = "generalized_alpha"
PULSE_STEP, PULSE_LENGTH = 0.01, 16.0  # s: time step and duration of a pulsed motion
PULSE_END = 0.5  # s: end of the paper's pulse
BAND = (0.4, 2.5)  # band of the shell's fundamental, relative to its first frequency
PULSE_BAND = (0.5, 4.0)
NEAR = (0.5, 2.0)  # band of a model's fundamental, relative to the shell's


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

    def move(structure: Discretized) -> Motion:
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
        write(found, chosen.out / STORED.name)
    print(summaries(found))
    return 0


if __name__ == "__main__":
    sys.exit(main())
