"""Sheets held folded by loads before their release, with the same fold in every model.

The loads are the inertia forces of the shell's first mode, at the vertices,

    p_v = s m_v phi_v,  m_v the shares of the panels at vertex v,

with s such that in each model's equilibrium the fold of the reference crease, which folds most in
that mode, has changed by the amplitude. Folds are angles between panels computed from the vertices,
which all models have.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import spsolve

from foldyn.cases import Case, Force, State
from foldyn.errors import ComputationError, FoldynWarning
from foldyn.linear import linearize
from foldyn.patterns import Pattern
from foldyn.patterns.geometry import face_geometry
from foldyn.statics import Settings, trace
from foldyn.structures.discretized import Discretized
from foldyn.studies.fidelity.cases import FidelityCase

FIRST_STEP = 0.1  # of the load that would fold a linear shell to the largest amplitude
STEPS = 80  # most steps on the way there
EXACT = 1e-4  # relative error of the held fold
SECANTS = 8
SETTINGS = Settings(stability=False, locate=False)
MOVING = 0.3  # of the largest change of a fold: smaller changes do not count as moving
SMALL = 1e-6  # of the pattern's size: displacement within which folds change linearly


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
                    case, "arc_length", steps=STEPS, first_step=FIRST_STEP, settings=SETTINGS,
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
