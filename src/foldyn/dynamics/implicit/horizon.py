"""How long an impulse goes on to act: the time in which a vibration moves on."""

from __future__ import annotations

import math

import numpy as np

from foldyn.algebra.superlu import SingularTangentError
from foldyn.dynamics.implicit.matrix import StepMatrix, Weights
from foldyn.dynamics.implicit.scheme import Bench
from foldyn.dynamics.inertia import times_mass


def horizon(bench: Bench, matrix: StepMatrix, duration: float) -> float:
    """Time 1/omega (s) of the vibration that the histories set in motion, at most the duration.

    Rayleigh's quotient of the displacements that they would cause if they acted slowly: over the
    duration, for bodies that nothing holds. Hinges count with their nominal stiffness.
    """
    packed, u = bench.packed, bench.displacement()
    force = bench.push(bench.old, np.ones(len(bench.old.factor)))
    body, pattern = packed.body.nominal(u), matrix.pattern
    matrix.blocks.put(body, pattern, u, u, False, matrix.stiffness)
    slow = (2.0 * math.pi / duration) ** 2
    try:
        matrix.factorize(Weights(stiffness=1.0, mass=slow, damping=0.0))
    except SingularTangentError:
        return duration
    bench.step[:] = 0.0
    x = matrix.solve(force, bench.step)
    matrix.forget()
    times_mass(packed.mass, x, bench.out)
    inertia, work = float((x * bench.out).sum()), float((x * force).sum())
    square = work / inertia - slow if inertia > 0.0 else 0.0
    return 1.0 / math.sqrt(square) if square * duration * duration > 1.0 else duration
