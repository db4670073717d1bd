"""GPU engines: for one motion, in place of an `ExplicitEngine`, and for one motion among many."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.dynamics.checkpoint import state_parts
from foldyn.dynamics.engine import Engine
from foldyn.dynamics.gpu import card
from foldyn.dynamics.gpu.launch import Launches, Places, take
from foldyn.dynamics.motion_state import MotionState, Outcome, Samples, StepPlan
from foldyn.dynamics.system import PackedCase


class CardEngine(Engine):
    """An explicit method on the GPU, for one motion.

    If a stretch fails, the CPU repeats it and reports the reason.

    Parameters
    ----------
    method : methods.Integrator
    packed : PackedCase
    state : MotionState
    plan : StepPlan
    """

    def __init__(self, method: Any, packed: PackedCase, state: MotionState, plan: StepPlan) -> None:
        self._method, self._packed, self._state, self._plan = method, packed, state, plan
        self._sums = np.zeros((1, 4))
        self._launches = self._launched()
        self._alone: Any = None

    def _launched(self) -> Launches:
        """Launches of this motion on the GPU, from its current state."""
        state = self._state
        one = (state.u, state.v, state.carry, state.angle)
        u, v, carry, angle = (np.array(array)[None] for array in one)
        places = Places(u, v, carry, self._sums, angle)
        return Launches([self._packed], [self._plan], self._method.name, places, wide=True)

    def advance(self, out: Samples, stretch: int) -> tuple[int, int]:
        """Advance the motion by at most `stretch` steps; returns (outcome, hinge)."""
        plan, tally = self._plan, self._state.tally
        begun = int(tally.steps)
        end = min(begun + stretch, plan.steps)
        # after a launch with central differences, the forces at its last step are kept on the GPU
        keeps = self._method.name == "central_difference" and begun > 0
        while not keeps or tally.steps < end:
            first = int(tally.steps)
            last = min(end, first + int(self._launches.fits()[0]))
            skips = self._method.name == "central_difference" and first > 0
            span = (np.array([number]) for number in (first + skips, last, int(tally.samples)))
            written, wrong = self._launches.run(*span)
            if wrong.any() or not np.isfinite(written.energy).all():
                return self._again(out, end - first)
            take(written, 0, out, self._state, plan, last, self._method.evaluations)
            self._fetch()
            if last == end:
                break
        return int(Outcome.DONE), -1

    def _fetch(self) -> None:
        """Copy the state of the models to the motion."""
        state, places = self._state, self._launches.places()
        state.u[...], state.v[...], state.carry[...] = places.u[0], places.v[0], places.carry[0]
        state.angle[...], self._sums = places.angle[0], places.sums

    def _again(self, out: Samples, stretch: int) -> tuple[int, int]:
        """Repeat a stretch on the CPU, from the state where the GPU began it."""
        if self._alone is None:
            case: Any = None  # only implicit methods need the case
            self._alone = self._method.engine(case, self._packed, self._state, self._plan)
        tally = self._state.tally
        self._alone.start_with(self._sums[:, :2].sum(axis=0))
        result = self._alone.advance(out, stretch)
        self._sums = np.array([[*self._alone.powers[:2], tally.work, tally.dissipated]])
        self._launches = self._launched()
        return result

    def resume_from(self, arrays: Mapping[str, NDArray]) -> None:
        """Resume from checkpoint arrays; see `Engine`."""
        self._sums = np.array(arrays["card_sums"])
        super().resume_from(arrays)
        self._launches = self._launched()

    def changing(self) -> dict[str, Any]:
        """What the next steps depend on; see `Engine`."""
        return state_parts(self._packed, self._state) | {"card_sums": self._sums}

    def facts(self) -> dict[str, Any]:
        """Statistics for the result's attributes: the device; see `Engine`."""
        return {"device": card.name()}


class BlockEngine:
    """Stands for the engine of a motion that ran with others on the GPU."""

    threads = 1

    def facts(self) -> dict[str, Any]:
        """Statistics for the result's attributes: the device; see `Engine`."""
        return {"device": card.name()}
