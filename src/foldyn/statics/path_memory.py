"""The memory that a path keeps from step to step: creases that yield or creep, and friction.

Within a step, both depend on the state and on the memory at the start of the step. Only an accepted
step updates this memory; iterations, cut steps and points located in between leave no trace.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.errors import InputError
from foldyn.materials.inelastic_law import VARIABLES
from foldyn.materials.latching import CODE as LATCH
from foldyn.structures.inelastic_hinges import Remembering
from foldyn.structures.inelastic_hinges import memory as memory_of

REFUSED, FOLLOWED, AT_REST = "refused", "followed", "at rest"


class Kept(NamedTuple):
    """An accepted step that can be restored; None for a kind of memory that the case lacks."""

    creases: tuple[NDArray, ...] | None
    friction: tuple[NDArray, ...] | None
    time: float  # s since the path began


class Memories:
    """The body of a case along a path, with its memory.

    Parameters
    ----------
    case : Case
    flow : {"refused", "followed", "at rest"}
        How to treat friction, and creases that yield or creep: refuse them, follow friction and
        yielding along the path, or take the state at rest, in which nothing has flowed.
    timed : bool
        Whether the steps of the path take time: then all laws with memory evolve along it.

    Attributes
    ----------
    body : Assembly
        The body, with its own memory if there is any.
    timed : bool
        As given.
    """

    def __init__(self, case: Case, flow: str, timed: bool = False) -> None:
        self._case, self.timed, self._time, self._step = case, timed, 0.0, 0.0
        flows = _flows(case, flow, timed)
        body = case.body
        self._creases = self._friction = None
        rubs = case.contact is not None and case.contact.rubs
        if rubs and flow == REFUSED:
            raise InputError(
                ".friction: makes equilibria depend on the path, and only fd.simulate and fd.trace "
                "follow it; elsewhere give 0, here and in the planes",
                "contact",
            )
        if rubs and flow == FOLLOWED:
            contact, self._friction = case.contact_term.rubbing()
            body = case.elastic_body.with_terms(contact)
        if flows and flow == FOLLOWED:
            self._creases = memory_of(flows, body)
            body = body.with_terms(self._creases)
        self.body = body

    def __bool__(self) -> bool:
        """Whether there is any memory."""
        return self.timed or self._creases is not None or self._friction is not None

    @property
    def rubs(self) -> bool:
        """Whether there is friction."""
        return self._friction is not None

    def start(self, q: NDArray, state: NDArray | str | None) -> None:
        """Begin at the body's dofs q (m,), with creases in a state (b, 2); see `cases.State`."""
        if self._creases is not None:
            self._creases.start(q, state)

    def tie(self) -> None:
        """Begin with friction springs unloaded in the state where the body was last evaluated."""
        if self._friction is not None:
            self._friction.start()

    def slips(self) -> bool:
        """Whether anything slips in the state in which the body was last evaluated."""
        return self._friction is not None and self._friction.slips()

    def opens(self) -> bool:
        """Whether a latch has opened in the state in which the body was last evaluated."""
        if self._creases is None:
            return False
        own = self._creases.own
        return bool(((own.code == LATCH) & (own.state[:, 0] > own.reached[:, 0])).any())

    def elapse(self, seconds: float) -> None:
        """Set the time (s) from the last accepted step to the next evaluation."""
        self._step = seconds
        if self._creases is not None:
            self._creases.own.elapsed[0] = seconds

    def commit(self) -> Kept:
        """Accept the step that ends in the state in which the body was last evaluated."""
        self._time, self._step = self._time + self._step, 0.0
        own = (self._creases, self._friction)
        for memory in own:
            if memory is not None:
                memory.commit()
        creases, friction = (None if memory is None else memory.snapshot() for memory in own)
        return Kept(creases, friction, self._time)

    def recall(self, kept: Kept | None) -> None:
        """Restore an accepted step."""
        if kept is None:
            return
        self._time, self._step = kept.time, 0.0
        for memory, snapshot in zip((self._creases, self._friction), kept[:2], strict=True):
            if memory is not None and snapshot is not None:
                memory.recall(snapshot)

    def branches(self, kept: Kept | None) -> NDArray:
        """State (b, 2) of all branches of the case at an accepted step, relaxing ones relaxed."""
        state = np.zeros((sum(part.count for part in self._case.remembering), VARIABLES))
        if kept is not None and kept.creases is not None:
            state[flowing(self._case, self.timed)] = kept.creases[1]
        return state

    def lost(self, kept: Kept | None) -> float:
        """Energy (J) dissipated by creases and friction up to an accepted step."""
        own = [] if kept is None else [memory for memory in kept[:2] if memory is not None]
        return float(sum(memory[2][0] for memory in own))


def flowing(case: Case, timed: bool) -> NDArray:
    """Mask (b,) of branches that evolve along a path; without time, relaxing branches do not."""
    parts = case.remembering
    return np.repeat([timed or not p.law.relaxes for p in parts], [p.count for p in parts])


def _flows(case: Case, flow: str, timed: bool) -> tuple[Remembering, ...]:
    """Checked laws with memory that evolve along a path; all other laws are taken as elastic.

    Raises
    ------
    InputError
        The solver cannot handle one of these laws.
    """
    parts = tuple(part for part in case.remembering if timed or not part.law.relaxes)
    for part in parts:
        name, field = part.law.name, f"{part.kind}_law"
        if part.latches and flow == REFUSED:
            raise InputError(
                ": latches make equilibria depend on the path, and only fd.simulate and fd.trace "
                "follow them; elsewhere leave them out",
                "supports",
            )
        if timed or flow == AT_REST or (flow == FOLLOWED and not part.law.rate_dependent):
            continue
        if part.law.rate_dependent:
            raise InputError(
                f" = {name!r}: creep goes on for ever, and load factors have no time scale; give "
                "fd.trace a duration, simulate the motion, or take an elastic law",
                field,
            )
        raise InputError(
            f" = {name!r}: yields, so that its equilibria depend on the path; fd.simulate "
            "and fd.trace take it; elsewhere take an elastic law",
            field,
        )
    if parts:
        case.check_flow()
    return parts
