"""Motions of one topology side by side: each goes its own way, in a lane of the same vectors."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases.history import History
from foldyn.dynamics.audit import audited
from foldyn.dynamics.course import Outcome, Samples
from foldyn.dynamics.damping import has_dampers
from foldyn.dynamics.lane_steps import (
    HINGE,
    OUTCOME,
    LaneLoads,
    LanePlan,
    LaneSamples,
    LaneState,
    advance_lanes,
)
from foldyn.dynamics.methods import METHODS
from foldyn.dynamics.motion import Motion
from foldyn.dynamics.system import Packed
from foldyn.dynamics.timing import check_samples
from foldyn.errors import FoldynError
from foldyn.mechanics.lanes import WIDTH, lanes, side_by_side, topology
from foldyn.structures.bars_hinges import BarsHingesTerm

METHOD = METHODS["central_difference"]
STRETCH = 1000  # steps for which the factors of the loads are in memory
LEAST = 4  # motions alone take as long as WIDTH side by side, where vectors gain least
MOST_NODES = 3000  # above which several threads share a motion that is alone
SAME = ("bars", "bar_runs", "hinges", "hinge_runs", "hinge_group")


def lacking(motion: Motion) -> str:
    """What of a motion cannot go side by side, in words; empty where nothing."""
    packed, case = motion.packed, motion.case
    system = packed.system
    lacks = {
        "another method than central differences": motion.method is not METHOD,
        "contact": case.contact is not None,
        "laws with memory": bool(case.remembering),
        "supports that move": system.moves,
        "actuated folds": system.turns,
        "loads that follow the motion": system.follows,
        "damping by beta or dashpots": bool(system.damping.data.size),
        "modal damping, dashpots or damped creases": has_dampers.py_func(system.damping),
        "constraints": len(system.ties.slave) > 0,
        "a mass matrix that is not lumped": not packed.mass.lumped,
        "clamped edges, springs, or another model than bars and hinges": bool(packed.body.others)
        or not isinstance(packed.body.sheet, BarsHingesTerm),
    }
    found = [what for what, there in lacks.items() if there]
    if not found and packed.model.addresses.any():
        found = ["laws of one's own"]
    return found[0] if found else ""


def differing(one: Packed, other: Packed) -> str:
    """What two models that nothing is lacking of do not share, but would have to; or ""."""
    same = {
        "nodes": one.model.rest.shape == other.model.rest.shape,
        "bars, hinges or kinds of laws": all(
            np.array_equal(getattr(one.model, name), getattr(other.model, name)) for name in SAME
        )
        and np.array_equal(one.system.order, other.system.order),
        "supported dofs": np.array_equal(one.system.supported, other.system.supported),
    }
    return next((what for what, equal in same.items() if not equal), "")


def groups(motions: Sequence[Motion]) -> list[list[int]]:
    """Which of some motions go side by side, by their places: at least LEAST, at most WIDTH.

    Those of a group differ as little in their steps as can be; the others are alone in theirs.
    """
    alike: list[list[int]] = []
    for k in sorted(range(len(motions)), key=lambda k: motions[k].plan.steps):
        motion, count = motions[k], len(motions[k].case.structure.nodes)
        if count > MOST_NODES or lacking(motion):
            alike.append([k])
            continue
        for group in alike:
            there = motions[group[0]]
            if not lacking(there) and not differing(motion.packed, there.packed):
                group.append(k)
                break
        else:
            alike.append([k])
    found: list[list[int]] = []
    for group in alike:
        parts = [group[k : k + WIDTH] for k in range(0, len(group), WIDTH)]
        for part in parts:
            most = motions[part[-1]].plan.steps
            worth = sum(motions[k].plan.steps for k in part) >= LEAST * most
            found += [part] if worth else [[k] for k in part]
    return found


class Lane:
    """The engine of a motion among others, as the result tells of it.

    Parameters
    ----------
    count : int
        Motions side by side.
    """

    threads = 1

    def __init__(self, count: int) -> None:
        self.count = count

    def facts(self) -> dict[str, Any]:
        """How many motions went side by side."""
        return {"side_by_side": self.count}


def room(motions: Sequence[Motion]) -> list[NDArray]:
    """Room for the displacements, velocities, reactions and energies of motions.

    Raises
    ------
    InputError
        Memory cannot hold them.
    """
    case = motions[0].case
    count = max(motion.expected_samples for motion in motions)
    nodes, reactions = len(case.structure.nodes), len(case.reaction_dofs)
    check_samples(count * len(motions), nodes, reactions)
    shapes = (nodes, 3), (nodes, 3), (reactions,), (len(audited(case.energy_groups)),)
    return [np.empty((len(motions), count, *shape)) for shape in shapes]


def integrate(
    motions: Sequence[Motion], out: Sequence[NDArray] | None = None
) -> tuple[list[FoldynError | None], float]:
    """Integrate up to WIDTH motions side by side.

    Each is audited and stopped as if it were alone, and then has its `result`; steps, durations and
    samples may differ.

    Parameters
    ----------
    motions : sequence of Motion
        Of which nothing is lacking, and which do not differ.
    out : sequence of ndarray, optional
        Their `room`.

    Returns
    -------
    list of FoldynError or None
        What ended each before its time.
    float
        Computing time, s.
    """
    began, clock = time.perf_counter(), time.thread_time()
    vector = _Vector(motions, room(motions) if out is None else out)
    engine = Lane(len(motions))
    going: dict[int, Iterator[int]] = {}
    ends: dict[int, int] = {}  # steps at which each wants to be looked at
    found: list[FoldynError | None] = [None] * len(motions)
    for lane, motion in enumerate(motions):
        going[lane] = motion.beside(engine, vector.window(lane))
        ends[lane] = next(going[lane])
    vector.start()
    while going:
        vector.advance(min(ends[lane] for lane in going))
        for lane in list(going):
            code = vector.note[OUTCOME, lane]
            if code == Outcome.DONE and ends[lane] > vector.done:
                continue
            vector.tell(lane)
            try:
                stretch = next(going[lane], None)
            except FoldynError as error:
                found[lane], stretch = error, None
            if stretch is None:
                del going[lane]
            else:
                ends[lane] = min(vector.done + stretch, motions[lane].plan.steps)
    for motion in motions:
        motion.seconds = (time.perf_counter() - began) / len(motions)
    return found, time.thread_time() - clock


class _Vector:
    """Up to WIDTH motions in the lanes of vectors; lanes without one stand still."""

    def __init__(self, motions: Sequence[Motion], out: Sequence[NDArray]) -> None:
        self.motions, self.out, self.done = motions, out, -1
        self.plans = [motion.plan for motion in motions]

    def window(self, lane: int) -> Samples:
        """Room for the samples of a motion, which knows their times."""
        plan = self.plans[lane]
        count = plan.steps // plan.every + 1
        times = plan.start + plan.every * np.arange(count) * plan.dt
        own = [array[lane, :count] for array in self.out]
        return Samples._make([times, *own, np.zeros((count, 0, 2)), 0])

    def start(self) -> None:
        """Take in the motions as they stand at their beginning."""
        all_of = [self.motions[min(k, len(self.motions) - 1)] for k in range(WIDTH)]
        first = all_of[0].packed
        shape = first.model
        u, v, angle = (
            side_by_side([getattr(motion.course, name) for motion in all_of])
            for name in ("u", "v", "angle")
        )
        self.note = np.zeros((3, WIDTH), np.int64)
        self.note[HINGE] = -1
        nothing = [side_by_side([np.zeros(u.size // WIDTH)] * WIDTH) for _ in range(3)]
        energies = np.zeros((4, WIDTH)), np.zeros((len(first.body.energy_groups), WIDTH))
        self.state = LaneState._make([u, v, *nothing, angle, np.zeros(WIDTH), *energies, self.note])
        steps = np.full(WIDTH, -1)
        steps[: len(self.plans)] = [plan.steps for plan in self.plans]
        self.plan = LanePlan(
            np.array([motion.plan.dt for motion in all_of]), steps,
            np.array([motion.plan.every for motion in all_of]),
        )  # fmt: skip
        self._load(all_of)
        self.samples = LaneSamples._make([first.system.order, first.system.supported, *self.out])
        self.arrays = topology(shape), lanes([motion.packed.model for motion in all_of])

    def _load(self, motions: Sequence[Motion]) -> None:
        """Loads and masses, with a value for each lane."""
        terms = [motion.case.load_terms for motion in motions]
        self.histories: list[History] = []
        for _, history in chain.from_iterable(terms):
            if history not in self.histories:
                self.histories.append(history)
        self.factors = [[self.histories.index(history) for _, history in own] for own in terms]
        count, size = max(map(len, terms)), self.state.u.size // WIDTH
        values = np.zeros((count, size, WIDTH))
        for lane, (motion, own) in enumerate(zip(motions, terms, strict=True)):
            for term, (vector, _) in enumerate(own):
                values[term, :, lane] = motion.packed.numbering.inward(vector).ravel()[:size]
        dof = np.flatnonzero(values.any(axis=(0, 2)))
        masses = [motion.packed.mass for motion in motions]
        self.loads = LaneLoads(
            dof, np.ascontiguousarray(values[:, dof].reshape(count, len(dof) * WIDTH)),
            side_by_side([mass.inverse for mass in masses]),
            side_by_side([np.repeat(mass.diagonal, 3) for mass in masses]),
            np.array([motion.packed.system.damping.alpha for motion in motions]),
        )  # fmt: skip

    def _factors(self, first: int, last: int) -> NDArray:
        """Factors of the histories at the ends of some steps, (steps, terms WIDTH)."""
        factor = np.zeros((last - first + 1, len(self.loads.value), WIDTH))
        known: dict[tuple[int, float, float], NDArray] = {}  # lanes may share a history and times
        for lane, plan in enumerate(self.plans):
            for term, number in enumerate(self.factors[lane]):
                key = number, plan.start, plan.dt
                if key not in known:
                    at = plan.start + np.arange(first, last + 1) * plan.dt
                    known[key] = np.broadcast_to(self.histories[number](at), at.shape)
                factor[:, term, lane] = known[key]
        return factor.reshape(len(factor), -1)

    def advance(self, end: int) -> None:
        """Advance all by steps up to this one."""
        while self.done < end:
            first, last = self.done + 1, min(end, self.done + STRETCH)
            advance_lanes(
                *self.arrays, self.loads, self._factors(first, last), self.state, self.samples,
                self.plan, first, last,
            )  # fmt: skip
            self.done = last

    def tell(self, lane: int) -> None:
        """Tell a motion how it stands."""
        motion, plan, state = self.motions[lane], self.plans[lane], self.state
        code, ended, hinge = self.note[:, lane].tolist()
        step = ended if code else min(self.done, plan.steps)
        course = motion.course
        for name in ("u", "v", "angle"):
            own = getattr(course, name)
            own[:] = getattr(state, name)[lane::WIDTH].reshape(own.shape)
        if code == Outcome.PENETRATION:
            course.angle[hinge] = state.before[lane]
        tally = course.tally
        tally.steps = tally.evaluations = step
        tally.time = plan.start + step * plan.dt
        tally.samples = -(-step // plan.every) if code else step // plan.every + 1
        motion.ended(code, hinge if code == Outcome.PENETRATION else -1)
