"""How long an impulse acts on: the time in which a vibration moves on."""

from __future__ import annotations

import math

import numpy as np

from foldyn.algebra.superlu import SingularTangentError
from foldyn.dynamics.implicit.matrix import StepMatrix, Weights
from foldyn.dynamics.implicit.scheme import Scheme
from foldyn.dynamics.inertia import times_mass
from foldyn.dynamics.system import Packed


def impulse_lasts(scheme: Scheme, matrix: StepMatrix, packed: Packed, duration: float) -> float:
    """The time (s): 1/omega of the vibration that the histories set in motion, at most a duration.

    Rayleigh's quotient of the displacements that they would cause if they acted slowly: over the
    duration, for bodies that nothing holds. Hinges count with their nominal stiffness.
    """
    u = scheme.displacement()
    force = scheme.push(scheme.old, np.ones(len(scheme.old.factor)))
    matrix.blocks.put(packed.body.nominal(u), matrix.pattern, u, u, False, matrix.stiffness)
    slow = (2.0 * math.pi / duration) ** 2
    try:
        matrix.factorize(Weights(stiffness=1.0, mass=slow, damping=0.0))
    except SingularTangentError:
        return duration
    scheme.step[:] = 0.0
    x = matrix.solve(force, scheme.step)
    matrix.forget()
    times_mass(packed.mass, x, scheme.out)
    inertia, work = float((x * scheme.out).sum()), float((x * force).sum())
    square = work / inertia - slow if inertia > 0.0 else 0.0
    return 1.0 / math.sqrt(square) if square * duration * duration > 1.0 else duration
