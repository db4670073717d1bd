"""Gradients of numbers that are functions of a motion's samples, by discrete adjoints."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.dynamics.driver import prepare
from foldyn.dynamics.methods import with_mass
from foldyn.dynamics.rk4_adjoint import RK4Adjoint, segment
from foldyn.dynamics.system import pack
from foldyn.errors import InputError
from foldyn.gradients.numbers import Gradient, numbers_of_motion
from foldyn.mechanics.pullback import Arrays

KNOWN = ("displacement", "velocity")


class MotionGradient:
    """A motion, and gradients of numbers that are functions of it.

    Parameters
    ----------
    case : Case
    arguments : mapping
        Of `fd.simulate`.

    Attributes
    ----------
    result : xarray.Dataset
        As `fd.simulate` returns it.
    """

    def __init__(self, case: Case, arguments: Mapping[str, Any]) -> None:
        given = dict(arguments)
        progress = given.pop("progress", None)
        motion = prepare(case, **given)
        if motion.method.name != "rk4":
            raise InputError(
                f" = {motion.method.name!r}: there are gradients of motions by rk4 alone so far",
                "method",
            )
        self._motion, self._arguments = motion, given
        wanted = motion.plan.every
        apart = segment(motion.plan, motion.packed.system.rows)
        if apart < wanted:  # samples between serve as states to go back from
            motion = prepare(case, **{**given, "dt": motion.plan.dt, "every": apart})
        self._all = motion.run(progress)
        self._every, self._stride = motion.plan.every, wanted // motion.plan.every
        self.result = self._all.isel(time=slice(None, None, self._stride))

    def numbers(self, case: Case) -> Arrays:
        """Numbers of a case by which gradients are taken."""
        packed = self._motion.packed
        made = with_mass(self._motion.method, case)
        other = pack(made, packed.system.waves.span, self._motion.start[0])
        return numbers_of_motion(other, self._motion.start)

    def backward(self, seeds: Mapping[str, NDArray]) -> Gradient:
        """Gradient of a number by the numbers of the case.

        seeds : its derivatives by variables of the result.
        """
        if unknown := [name for name in seeds if name not in KNOWN]:
            raise InputError(
                f"there are no derivatives through {', '.join(unknown)} of motions, but through "
                f"{', '.join(KNOWN)}"
            )
        adjoint, by = RK4Adjoint(self._motion), self._motion.packed.numbering
        u, v = (self._all[name].transpose("time", "node", "axis").values for name in KNOWN)
        none, by_u, by_v = np.zeros((3, *by.inward(u[0]).shape))
        times = self._all["time"].values
        for k in range(len(u) - 1, -1, -1):
            sample, between = divmod(k, self._stride)
            if not between:
                own = [by.inward(seeds[name][sample]) if name in seeds else none for name in KNOWN]
                adjoint.add_supports(times[k], *own)
                by_u += own[0]
                by_v += own[1]
            if k:
                ends = (k - 1) * self._every, k * self._every
                state = adjoint.without_supports(
                    times[k - 1], by.inward(u[k - 1]), by.inward(v[k - 1])
                )
                adjoint.backward(*ends, *state, by_u, by_v)
        start = {"start.displacement": by.outward(by_u), "start.velocity": by.outward(by_v)}
        return adjoint.total | start
