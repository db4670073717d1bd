"""Motions of a case about a state, from which frequency responses are estimated.

The stepped sine method uses steady motions under a sine, one frequency at a time.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated, Any, cast

import numpy as np
from numpy.typing import NDArray

from foldyn import cases
from foldyn.arguments import Check, Checked
from foldyn.cases.directions import unit_vector
from foldyn.cases.supports import Support
from foldyn.dynamics import METHODS, Progress, prepare
from foldyn.dynamics.progress import Reporter
from foldyn.linear.excitation import Answer, Drive, warn_at
from foldyn.linear.operating_point import operating_point
from foldyn.signals import stepped_sine as per_drive
from foldyn.values import choice, number, whole

Duration = Annotated[float, Check(number, above=0.0, unit="s")]
PER_CYCLE = 32  # samples per cycle
SLOWEST = 0.99  # if successive changes have a larger ratio, no decay is assumed
NEGLIGIBLE = 1e-12  # relative change that is round-off


@dataclass(frozen=True)
class Integration(Checked):
    """How the motions of a frequency response are integrated.

    Parameters
    ----------
    integrator : str, optional
        Method of `simulate`; by default "rk4", for shells "generalized_alpha".
    dt : float, optional
        Largest time step (s), which is shortened to divide the sampling interval; by default the
        time step of `simulate`.
    tolerance : float, optional
        As in `simulate`.
    """

    integrator: Annotated[str | None, Check(choice, known=METHODS)] = None
    dt: Duration | None = None
    tolerance: Annotated[float | None, Check(number, above=0.0)] = None


class Rig:
    """A case held in a state by its loads, ready to be driven.

    The loads of the case are replaced by constant forces that balance the state, so that nothing
    moves without the drive, even if the state is only close to an equilibrium. Actuated folds and
    loads that depend on the displacement are kept.
    """

    def __init__(
        self, case: cases.Case, state: cases.State | str | None, load_factor: float, drive: Drive,
        integration: Integration,
    ) -> None:  # fmt: skip
        point = operating_point(case, state, load_factor)
        self.state = point.displacement
        self.drive, self.integration = drive, integration
        massless = case.structure.massless
        self.integrator = integration.integrator or ("generalized_alpha" if massless else "rk4")
        history = cases.Table([0.0, 1.0], [point.factor, point.factor])
        self.case = case
        if case.contact is not None:  # planes keep their places in the state
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
        self._loads: list[cases.Load] = [
            *(replace(cast(Any, load), history=history) for load in kept if point.factor != 0.0),
            *forces(holding.reshape(-1, 3)),
        ]
        self._supports = self._held()

    def _held(self) -> list[Support]:
        """Supports that hold nodes at their places in the state; bases of the case stand still."""
        moving = (cases.Impose, cases.BaseMotion)
        held: list[Support] = [s for s in self.case.supports if not isinstance(s, moving)]
        for support in self.case.supports:
            if isinstance(support, cases.Impose):
                nodes = cases.resolve_nodes(self.case.structure, support.nodes, "nodes")
                where = self.state[nodes] @ unit_vector(support.axis or support.direction)
                still = replace(support, nodes=nodes.tolist(), value=where.tolist(), history=None)
                held.append(still)
        return held

    def driven(self, history: cases.History) -> cases.Case:
        """The case under the drive."""
        loads, supports = list(self._loads), list(self._supports)
        if self.drive.axis is None:
            loads += forces(self.drive.vector, history)
        else:
            supports.append(cases.BaseMotion(self.drive.axis, history, self.drive.value))
        return replace(self.case, supports=supports, loads=loads)

    def run(
        self, history: cases.History, duration: float, interval: float, progress: Reporter,
        start: float = 0.0, initial: cases.State | None = None,
    ) -> tuple[NDArray, NDArray, cases.State]:  # fmt: skip
        """Times, response (nt, n, 3) relative to the state, and the final state of a motion."""
        dt, tolerance = self.integration.dt, self.integration.tolerance
        if dt is not None:
            dt = interval / math.ceil(interval / dt * (1.0 - 1e-12))
        motion = prepare(
            self.driven(history), duration, self.integrator, dt, interval=interval,
            initial=initial or cases.State(self.state), tolerance=tolerance, start=start,
        )  # fmt: skip
        found = motion.samples(progress)
        return found.time, found.displacement - self.state, motion.end


def _moves_along(load: cases.Load, case: cases.Case) -> bool:
    """Whether a load folds creases or depends on the displacement."""
    return isinstance(load, cases.Actuate) or load.following(case.structure, "loads") is not None


def forces(vectors: NDArray, history: cases.History | None = None) -> list[cases.Force]:
    """Loads for forces (n, 3) on nodes; equal forces are one load."""
    distinct, which = np.unique(vectors, axis=0, return_inverse=True)
    return [
        cases.Force(np.flatnonzero(which.ravel() == k).tolist(), vector.tolist(), history)
        for k, vector in enumerate(distinct)
        if vector.any()
    ]


def overall(report: Reporter, before: float, total: float) -> Callable[[Progress], Any]:
    """Reporter for one of several motions; `before` of `total` seconds were simulated earlier."""
    return lambda now: report(Progress(before + now.time, total, now.steps, now.energy_error))


@dataclass(frozen=True)
class SteppedSine(Integration):
    """Options of the stepped sine method, in addition to the integration.

    Parameters
    ----------
    cycles : int
        Number of cycles to which a sine is fitted, at least 2.
    settled : float
        Relative error that the transient may leave, estimated from its decay: cycles are added
        until the error is smaller.
    most_cycles : int
        Largest number of cycles at a frequency, settled or not.
    sweep : {"up", "down"}
        Whether frequencies rise or fall; each motion starts where the previous motion ended.
    """

    cycles: Annotated[int, Check(whole, least=2)] = 4
    settled: Annotated[float, Check(number, above=0.0)] = 1e-3
    most_cycles: Annotated[int, Check(whole)] = 400
    sweep: Annotated[str, Check(choice, known=("up", "down"))] = "up"

    def agree(self) -> None:
        """Refuse too few cycles for a check that a motion has settled."""
        whole("most_cycles", self.most_cycles, least=3 * self.cycles)


def stepped_sine(rig: Rig, frequency: NDArray, options: SteppedSine, report: Reporter) -> Answer:
    """Response to sines, and the unsteadiness of each motion.

    Warns
    -----
    FoldynWarning
        Motions have not settled.
    """
    response = np.empty((len(frequency), *rig.state.shape), complex)
    unsteady, spent = np.empty(len(frequency)), np.zeros(len(frequency))
    order = np.arange(len(frequency))
    state: cases.State | None = None
    done = 0.0
    for place, k in enumerate(order if options.sweep == "up" else order[::-1]):
        response[k], unsteady[k], lasted, state = _settled(
            rig, float(frequency[k]), options, state, report, done, 3 * (len(frequency) - place)
        )
        spent[k], done = lasted * frequency[k], done + lasted
    warn_at(
        frequency[unsteady > options.settled],
        f"the motion has not settled after {options.most_cycles} cycles at {{}} (see "
        "unsteadiness); give most_cycles, or damping: without it a transient does not die away",
    )
    facts = {
        "cycles": options.cycles,
        "cycles_in_all": round(float(spent.sum())),
        "settled": options.settled,
        "sweep": options.sweep,
    }
    return Answer(response, {"unsteadiness": unsteady}, facts)


def _settled(
    rig: Rig, frequency: float, options: SteppedSine, state: cases.State | None, report: Reporter,
    done: float, left: int,
) -> tuple[NDArray, float, float, cases.State | None]:  # fmt: skip
    """Response to a sine in blocks of cycles, its unsteadiness, its time (s), and its final state.

    done, left : time (s) simulated before, and the number of blocks that are expected.
    """
    history, block = cases.Harmonic(frequency), options.cycles / frequency
    interval = 1.0 / (PER_CYCLE * frequency)
    response, unsteady, change, blocks = np.zeros(0), np.inf, np.inf, 0
    while not (unsteady <= options.settled or (blocks + 1) * options.cycles > options.most_cycles):
        start, before = blocks * block, response
        told = overall(report, done + start, done + start + left * block)
        time, motion, state = rig.run(history, block, interval, told, start, state)
        drive = rig.drive.value * history(time)
        # the last sample is the first of the next block
        response = per_drive(time[:-1], drive[:-1], response=motion[:-1], frequency=frequency)
        if blocks:
            largest, last = max(np.abs(response).max(), 1e-300), change
            change = float(np.abs(response - before).max() / largest)
            unsteady = _remaining(change, last)
        blocks += 1
    return response, unsteady, blocks * block, state


def _remaining(change: float, before: float) -> float:
    """Remaining error of changes that fall geometrically from block to block."""
    if change <= NEGLIGIBLE:
        return change
    if not np.isfinite(before):
        return np.inf
    ratio = min(change / before, SLOWEST)
    return change * max(ratio / (1.0 - ratio), 1.0)
