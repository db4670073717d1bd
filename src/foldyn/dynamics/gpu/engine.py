"""GPU engines: for one motion, in place of an `ExplicitEngine`, and for one motion among many."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.cases.history import CALLED
from foldyn.cases.waveforms import waveform_table
from foldyn.dynamics.checkpoint import beyond_samples, state_parts
from foldyn.dynamics.engine import Engine
from foldyn.dynamics.gpu import card
from foldyn.dynamics.gpu.arrays import CaseArrays
from foldyn.dynamics.gpu.kernels import CardState, Span, Written, kernel
from foldyn.dynamics.gpu.ported import SIMULATED, cuda
from foldyn.dynamics.motion_state import MotionState, Outcome, Samples, StepPlan
from foldyn.dynamics.system import PackedCase

BLOCK = 128  # threads per block of a grid with one model
FEWEST, MOST = 64, 256  # threads per block with a model each: few if there are many models
WINDOW = 0.25  # largest share of the free memory for the samples of a launch
SAMPLES = 2.0**30  # upper limit for these samples, as the host holds them too, bytes
FACTORS = 2**28  # upper limit for the load factors of a launch, bytes
# fractions of a step at which a method evaluates the loads
LOOKS = {"rk4": (0.0, 0.5, 1.0), "central_difference": (0.0,)}


class Places(NamedTuple):
    """State of m models between two launches, as host arrays."""

    u: NDArray  # (m, n, 3)
    v: NDArray
    carry: NDArray  # (m, n, 3) acceleration, for methods that keep it
    sums: NDArray  # (m, 4) as in `CardState`; (threads, 4) in the same launch shape
    angle: NDArray  # (m, nh)


def take(
    written: Written, k: int, out: Samples, state: MotionState, plan: StepPlan, last: int,
    evaluations: int,
) -> None:  # fmt: skip
    """Store the samples of model k from a launch that ended at step `last`; count the steps.

    evaluations : number of force evaluations per step.
    """
    tally, begun, energy = state.tally, int(state.tally.samples), written.energy[:, k] + 0.0
    end = last // plan.every + 1
    rows, own = slice(begun - out.first, end - out.first), slice(end - begun)
    out.time[rows] = plan.start + np.arange(begun, end) * plan.every * plan.dt
    out.displacement[rows], out.velocity[rows] = written.u[k, own], written.v[k, own]
    out.reaction[rows], out.energy[rows] = written.reaction[k, own], energy[own]
    tally.dissipated, tally.work = energy[-1, -2:]
    tally.evaluations += evaluations * (last - int(tally.steps))
    tally.steps, tally.samples, tally.time = last, end, plan.start + last * plan.dt


class Launches:
    """Models of one topology on the GPU.

    Parameters
    ----------
    cases : sequence of PackedCase
    plans : sequence of StepPlan
        Steps of each model, which may differ between models.
    method : str
        One of `checks.METHODS`.
    places : Places
        State from which the models start.
    wide : bool
        Whether one model uses the whole GPU; otherwise each model has a block.

    Raises
    ------
    InputError
        The models exceed the GPU memory.
    """

    def __init__(
        self, cases: Sequence[PackedCase], plans: Sequence[StepPlan], method: str, places: Places,
        wide: bool,
    ) -> None:  # fmt: skip
        host, self._cases, self._method, self._wide = CaseArrays(cases), cases, method, wide
        self._plans = plans
        self._dt = np.array([plan.dt for plan in plans])
        self._every = np.array([plan.every for plan in plans])
        self._counts = host.counts
        m, n, slots = len(cases), host.counts.nodes, host.counts.slots
        numbers = 3 * slots + host.counts.more
        room = 8 * (numbers + 6 * n)
        shared = not wide and room <= card.SHARED
        own = 1 if shared else m
        needed = card.size_of(tuple(host.elements)) + card.size_of(tuple(host.nodes))
        needed += 8 * m * (12 * n + places.angle.shape[1]) + own * room
        what = f"{m} models of {n} nodes" if m > 1 else f"a model of {n} nodes"
        card.check_size(needed, what)
        self._rows = self._histories()
        load_row = host.nodes.load_row
        for k, rows in enumerate(self._of_case):
            if len(rows):
                load_row[k] = rows[np.minimum(load_row[k], len(rows) - 1)]
        self._elements = card.put(host.elements)
        self._nodes = card.put(host.nodes)
        self._room = room if shared else 0
        plates = len(host.elements.plates) > 0
        self._kernel, self._shape = kernel(method, wide, shared, plates), (m, n)
        self._supported = len(cases[0].system.supported)
        self._compiled: Any = None
        self._from = places
        if SIMULATED:
            self._threads, self._blocks = 2, 1 if wide else m
        else:
            processors = cuda.get_current_device().MULTIPROCESSOR_COUNT
            alone = FEWEST if processors < m else MOST
            self._threads, self._blocks = (BLOCK, 8 * processors) if wide else (alone, m)
        self._ahead = (1, 1) if shared else (m, 3 * n)
        self._slot = (1, 1) if shared else (m, numbers)
        self._set(places)

    def _histories(self) -> list[tuple[int, int] | None]:
        """Distinct histories at distinct steps, as (case, row); None stands for a constant history.

        Sets `_of_case` to the numbers of the histories for each row of each case.
        """
        numbers: dict[Any, int] = {}
        found: list[Any] = []
        self._of_case = []
        for k, (packed, plan) in enumerate(zip(self._cases, self._plans, strict=True)):
            waves, rows = packed.system.waves, []
            for row, code in enumerate(waves.code):
                own = slice(waves.first[row], waves.first[row + 1])
                key: Any = (
                    int(code),
                    waves.parameters[row].tobytes(),
                    waves.knot[own].tobytes(),
                    waves.cubic[own].tobytes(),
                    *(plan.start, plan.dt, plan.steps, plan.every),
                )
                if code == CALLED:
                    key = id(packed), row
                elif not packed.system.varies:
                    key = None
                if key not in numbers:
                    numbers[key] = len(found)
                    found.append((k, row) if key else None)
                rows.append(numbers[key])
            self._of_case.append(np.array(rows, np.int64))
        return found

    def _set(self, places: Places) -> None:
        """Copy the state of the models to the GPU."""
        m, n = self._shape
        threads = self._blocks * self._threads
        sums = places.sums
        if len(sums) != threads:
            total = sums.reshape(m, -1, 4).sum(axis=1)
            sums = np.zeros((threads, 4))
            sums[:: threads if self._wide else self._threads] = total
        memory, put = cuda.device_array, card.put
        self._state = CardState(
            u=put(places.u), v=put(places.v), first=put(places.carry), second=memory((m, n, 3)),
            ahead_u=memory(self._ahead), ahead_v=memory(self._ahead), slot=memory(self._slot),
            angle=put(places.angle), wrong=put(np.zeros(m, np.int64)),
            note=memory((threads, self._counts.groups + 3)), sums=put(sums),
            barrier=put(np.zeros(1, np.int64)),
        )  # fmt: skip

    def fits(self) -> NDArray:
        """Largest number of steps (m,) per launch for which samples and factors fit in memory."""
        (m, n), looks = self._shape, len(LOOKS[self._method])
        sample = 8.0 * m * (6 * n + self._supported) + 8.0 * self._blocks * 11
        samples = max(1, int(min(SAMPLES, WINDOW * card.free_memory()) / sample))
        factors = max(1, int(FACTORS / (8 * looks * max(1, len(self._rows)))))
        return np.minimum(samples * self._every, factors)

    def _factors(self, first: NDArray, last: NDArray) -> NDArray:
        """Factors (h, looks) of all histories in the steps from first to last."""
        looks = np.array(LOOKS[self._method])
        out = np.ones((len(self._rows), len(looks) * max(1, int((last - first).max() + 1))))
        for own, found in zip(out, self._rows, strict=True):
            if found is None:
                continue
            k, row = found
            plan, packed = self._plans[k], self._cases[k]
            steps = np.arange(first[k], last[k] + 1)[:, None]
            times = (plan.start + steps * plan.dt + looks * plan.dt).ravel()
            own[: len(times)] = waveform_table(packed.system.waves, row, times)[0]
        return out

    def run(self, first: NDArray, last: NDArray, sample: NDArray) -> tuple[Written, NDArray]:
        """Advance models (m,) from step first to last; write samples from number `sample` (m,) on.

        Returns the samples as host arrays, and which models (m,) failed. The energies
        (k + 1, m, columns) have a last row for the end of the launch. The arrays fit the model with
        the most samples.
        """
        m, nodes = len(first), len(self._cases[0].system.order)
        count = max(0, int((last // self._every + 1 - sample).max()))
        room = max(1, count)
        out = Written(
            cuda.device_array((m, room, nodes, 3)), cuda.device_array((m, room, nodes, 3)),
            cuda.device_array((m, room, max(1, self._supported))), self._energies(count),
        )  # fmt: skip
        span = card.put(Span(first, last, self._dt, self._every, sample))
        factor = cuda.to_device(self._factors(first, last))
        self._state.barrier.copy_to_device(np.zeros(1, np.int64))
        given = self._elements, self._nodes, self._counts, span, factor
        if not SIMULATED and self._compiled is None:
            self._fit_grid((*given, self._state, out))
            out = out._replace(energy=self._energies(count))
        launched = self._compiled or self._kernel
        launched[self._blocks, self._threads, 0, self._room](*given, self._state, out)
        u, v, reaction, energy = (array.copy_to_host() for array in out)
        if self._wide:
            energy = energy.sum(axis=1, keepdims=True)
        reaction = reaction[:, :count, : self._supported]
        host = Written(u[:, :count], v[:, :count], reaction, energy)
        return host, self._state.wrong.copy_to_host() != 0

    def _energies(self, count: int) -> Any:
        return cuda.to_device(np.zeros((count + 1, self._blocks, self._counts.groups + 3)))

    def _fit_grid(self, arguments: tuple[Any, ...]) -> None:
        """Compile the kernel; for one model, use as many blocks as the GPU runs at once."""
        self._compiled = self._kernel.specialize(*arguments)
        if self._wide:
            made: Any = next(iter(self._compiled.overloads.values()))
            most = int(made.max_cooperative_grid_blocks(self._threads))
            items = max(self._shape[1], self._from.angle.shape[1])
            self._blocks = max(1, min(most, math.ceil(items / self._threads)))
            self._set(self._from)

    def places(self) -> Places:
        """Copy the state of the models to the host."""
        state = self._state
        arrays = state.u, state.v, state.first, state.sums, state.angle
        return Places(*(array.copy_to_host() for array in arrays))


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

    def continuation(self) -> NDArray:
        """Numbers to continue from the last sample; see `Engine`."""
        return beyond_samples(self._packed, self._state)

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
