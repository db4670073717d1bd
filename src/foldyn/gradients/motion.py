"""Gradients of functions of a motion's samples, by discrete adjoints."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.dynamics.adjoint import Adjoint, refuse
from foldyn.dynamics.central_difference_adjoint import CentralDifferenceAdjoint
from foldyn.dynamics.driver import prepare
from foldyn.dynamics.implicit_adjoint import ImplicitAdjoint, Retraced
from foldyn.dynamics.methods import suiting
from foldyn.dynamics.runge_kutta_adjoint import RungeKuttaAdjoint, segment
from foldyn.dynamics.system import pack
from foldyn.gradients.parameters import Differentiated, Gradient, check_known, numbers_of_motion
from foldyn.mechanics.pullback import Arrays

KNOWN = ("displacement", "velocity")


class MotionGradient(Differentiated):
    """A motion, with gradients of functions of the motion.

    Parameters
    ----------
    case : Case
    arguments : mapping
        Arguments of `fd.simulate`.
    """

    def __init__(self, case: Case, arguments: Mapping[str, Any]) -> None:
        given = dict(arguments)
        progress = given.pop("progress", None)
        motion = prepare(case, **given)
        refuse(motion)
        wanted = motion.plan.every
        if motion.method.tableau is not None:
            if (apart := segment(motion)) < wanted:
                # samples in between are checkpoints for the backward pass
                own = {"dt": motion.plan.dt, "every_steps": apart, "interval": None}
                motion = prepare(case, **{**given, **own})
            self._adjoint: Callable[[], Adjoint] = lambda: RungeKuttaAdjoint(motion, samples)
        elif motion.method.name == "central_difference":
            self._adjoint = lambda: CentralDifferenceAdjoint(motion)
        else:
            steps = Retraced(motion)
            self._adjoint = lambda: ImplicitAdjoint(motion, steps)
        samples = motion.run(progress)
        self._motion, self._times = motion, samples["time"].values
        self._every, self._stride = motion.plan.every, wanted // motion.plan.every
        self.result = samples.isel(time=slice(None, None, self._stride))

    def numbers(self, case: Case) -> Arrays:
        """Numbers of a case with respect to which gradients are taken."""
        packed, method = self._motion.packed, self._motion.method
        case = suiting(method, case)
        hidden = method.hidden_inertia(case)
        other = pack(case, packed.system.waves.span, self._motion.origin, hidden=hidden)
        return numbers_of_motion(other, self._motion.start)

    def backward(self, seeds: Mapping[str, NDArray]) -> Gradient:
        """Gradient with respect to the numbers of the case.

        seeds : derivatives of the quantity with respect to variables of the result.
        """
        check_known(seeds, KNOWN, "motions")
        adjoint, by = self._adjoint(), self._motion.packed.numbering
        by_u, by_v = np.zeros((2, self._motion.packed.system.rows, 3))
        for k in range(len(self._times) - 1, -1, -1):
            sample, between = divmod(k, self._stride)
            if not between:
                own = [
                    by.inward(seeds[name][sample]) if name in seeds else np.zeros_like(by_u)
                    for name in KNOWN
                ]
                adjoint.add_supports(self._times[k], *own)
                by_u += own[0]
                by_v += own[1]
            if k:
                adjoint.backward((k - 1) * self._every, k * self._every, by_u, by_v)
        return adjoint.gradient(by_u, by_v)
