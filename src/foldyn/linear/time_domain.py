"""Motions of a case about a state, from which frequency responses are estimated."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated, Any, cast

import numpy as np
from numpy.typing import NDArray

from foldyn.arguments import Check, Checked
from foldyn.cases import (
    Actuate,
    BaseMotion,
    Case,
    Force,
    History,
    Impose,
    Load,
    State,
    Table,
    resolve_nodes,
)
from foldyn.cases.directions import unit_vector
from foldyn.cases.supports import Support
from foldyn.dynamics import METHODS, Progress, prepare
from foldyn.dynamics.progress import Reporter
from foldyn.linear.excitation import Drive
from foldyn.linear.operating_point import operating_point
from foldyn.values import choice, number

Duration = Annotated[float, Check(number, above=0.0, unit="s")]


@dataclass(frozen=True)
class Integration(Checked):
    """How the motions of a frequency response are integrated.

    Parameters
    ----------
    integrator : str, optional
        Method of `simulate`. Without it "rk4", for shells "generalized_alpha".
    dt : float, optional
        Largest time step (s), shortened to divide the sampling interval; by default the one
        of `simulate`.
    tolerance : float, optional
        As in `simulate`.
    """

    integrator: Annotated[str | None, Check(choice, known=METHODS)] = None
    dt: Duration | None = None
    tolerance: Annotated[float | None, Check(number, above=0.0)] = None


class Rig:
    """A case held in a state by its loads, ready to be driven.

    The loads of the case are replaced by constant forces that balance the state, so that nothing
    moves without the drive, whatever the tolerance of the state. Actuated folds and loads that
    depend on the displacement are kept.
    """

    def __init__(
        self, case: Case, state: State | str | None, load_factor: float, drive: Drive,
        integration: Integration,
    ) -> None:  # fmt: skip
        point = operating_point(case, state, load_factor)
        self.state = point.displacement
        self.drive, self.integration = drive, integration
        massless = case.structure.massless
        self.integrator = integration.integrator or ("generalized_alpha" if massless else "rk4")
        history = Table([0.0, 1.0], [point.factor, point.factor])
        self.case = case
        if case.contact is not None:  # planes stay where they are in the state
            planes = [
                plane if plane.history is None else replace(plane, history=history)
                for plane in case.contact.planes
            ]
            self.case = case.altered(contact=replace(case.contact, planes=planes))
        kept = [load for load in case.loads if _moves_along(load, case)]
        holding = point.body.internal(point.dofs)
        holding -= point.problem.following_force(point.dofs, point.factor)
        holding = holding[: self.state.size]
        holding[case.supported_dofs] = 0.0
        holding[np.abs(holding) <= point.problem.force_rounding] = 0.0
        self._loads: list[Load] = [
            *(replace(cast(Any, load), history=history) for load in kept if point.factor != 0.0),
            *forces(holding.reshape(-1, 3)),
        ]
        self._supports = self._held()

    def _held(self) -> list[Support]:
        """Supports fixed where the state puts them; a moving base of the case stands still."""
        moving = (Impose, BaseMotion)
        held: list[Support] = [s for s in self.case.supports if not isinstance(s, moving)]
        for support in self.case.supports:
            if isinstance(support, Impose):
                nodes = resolve_nodes(self.case.structure, support.nodes, "nodes")
                where = self.state[nodes] @ unit_vector(support.axis or support.direction)
                still = replace(support, nodes=nodes.tolist(), value=where.tolist(), history=None)
                held.append(still)
        return held

    def driven(self, history: History) -> Case:
        """The case under the drive."""
        loads, supports = list(self._loads), list(self._supports)
        if self.drive.axis is None:
            loads += forces(self.drive.vector, history)
        else:
            supports.append(BaseMotion(self.drive.axis, history, self.drive.value))
        return replace(self.case, supports=supports, loads=loads)

    def run(
        self,
        history: History,
        duration: float,
        interval: float,
        progress: Reporter,
        start: float = 0.0,
        initial: State | None = None,
    ) -> tuple[NDArray, NDArray, State]:
        """Times, response (nt, n, 3) relative to the state, and the final state of a motion."""
        dt, tolerance = self.integration.dt, self.integration.tolerance
        if dt is not None:
            dt = interval / math.ceil(interval / dt * (1.0 - 1e-12))
        motion = prepare(
            self.driven(history), duration, self.integrator, dt, interval=interval,
            initial=initial or State(self.state), tolerance=tolerance, start=start,
        )  # fmt: skip
        found = motion.samples(progress)
        return found.time, found.displacement - self.state, motion.end


def _moves_along(load: Load, case: Case) -> bool:
    """Whether a load folds creases or depends on the displacement."""
    return isinstance(load, Actuate) or load.following(case.structure, "loads") is not None


def forces(vectors: NDArray, history: History | None = None) -> list[Force]:
    """Loads for forces (n, 3) on nodes, equal ones combined."""
    distinct, which = np.unique(vectors, axis=0, return_inverse=True)
    return [
        Force(np.flatnonzero(which.ravel() == k).tolist(), vector.tolist(), history)
        for k, vector in enumerate(distinct)
        if vector.any()
    ]


def overall(report: Reporter, before: float, total: float) -> Callable[[Progress], Any]:
    """Reporter for one of several motions, after `before` of `total` simulated seconds."""
    return lambda now: report(Progress(before + now.time, total, now.steps, now.energy_error))
