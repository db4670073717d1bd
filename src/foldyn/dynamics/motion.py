"""`Motion`: a motion ready to be computed, in stretches of compiled steps."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case, Continuation, Origin, State
from foldyn.dynamics.added_mass import LOOK_EVERY, begin_flow, renewed_flow
from foldyn.dynamics.audit import INACCURATE, Rounding, doubts, is_off
from foldyn.dynamics.checkpoint import KEY, Keeping, identity, identity_digest
from foldyn.dynamics.engine import Engine
from foldyn.dynamics.failures import failure, smaller_step
from foldyn.dynamics.initial import begin
from foldyn.dynamics.methods import METHODS, ExplicitEngine, ImplicitEngine, Integrator
from foldyn.dynamics.motion_state import MotionState, Outcome, Samples, StepPlan
from foldyn.dynamics.output import Output
from foldyn.dynamics.progress import Progress, Reporter, reported
from foldyn.dynamics.sampling import Sampler, SamplingError
from foldyn.dynamics.softening import swings_told
from foldyn.dynamics.stability import MARGIN, limit_below
from foldyn.dynamics.system import PackedCase, pack, place, scratch
from foldyn.dynamics.timing import apart, check_room, check_samples, expected_samples, steps_taken
from foldyn.dynamics.turned import resists_turns, turns_told
from foldyn.errors import (
    ComputationError,
    CrossingWarning,
    FoldynError,
    InstabilityError,
    MotionInterrupted,
    warn,
)
from foldyn.mechanics.inelastic import HingeMemory
from foldyn.results import trajectory_dataset
from foldyn.results.crossings import Crossings, crossings_of
from foldyn.structures.stretching import warn_of_stretching

if TYPE_CHECKING:
    import xarray

    from foldyn.dynamics.gpu.engine import BlockEngine

RECHECKS = 20, 1000, 4000  # checks of the critical step; least steps between them, by edge angles
CHUNK = 256  # steps in the first stretch; later stretches last about REPORT_EVERY s
REPORT_EVERY = 0.25
BETWEEN = 0.382  # fraction of a sampling interval; a vibration at rest at both its ends moves there
EXPLODED = 1.0  # relative energy error at which the motion is stopped
PER_LOOK = 500  # least force evaluations of an explicit method between searches for crossing panels
IMPLICIT_WORK = 25  # force evaluations that an implicit evaluation and its solution cost
LOOKS = 100  # number of samples at which turning panels are checked
FEW = 1000  # number of triangles that are checked in negligible time


class Motion:
    """A motion that is ready to be computed; `prepare` creates it."""

    def __init__(
        self, case: Case, method: Integrator, plan: StepPlan, critical: float, force: bool,
        state: tuple[NDArray, NDArray, NDArray | str | None, Continuation | None], origin: Origin,
        packed: PackedCase, sampler: Sampler, reason: str = "",
        better: Callable[[], Motion] | None = None, device: str = "cpu",
    ) -> None:  # fmt: skip
        self.device, self.kind = device, method.name
        self.case, self.method, self.plan = case, method, plan
        self.critical, self.force, self.reason = critical, force, reason
        self._initial, self.origin, self.packed, self._sampler = state, origin, packed, sampler
        self._better = better
        self._rounding = Rounding(packed.body)
        self._engine: Engine | BlockEngine | None = None
        self.seconds = 0.0
        self.restart()
        self.at_rest = not (self.state.u.any() or self.state.v.any())

    @property
    def start(self) -> tuple[NDArray, NDArray]:
        """Displacement and velocity (n, 3) at the start."""
        return self._initial[0], self._initial[1]

    @property
    def beginning(self) -> MotionState:
        """A new copy of the initial state of the integrators."""
        return begin(self.case, *self._initial[:3], self.continued, self.plan, self.packed)

    @property
    def continued(self) -> Continuation | None:
        """What the motion goes on from, if a method of the same kind has stored it."""
        given = self._initial[3]
        kind = given and METHODS.get(given.method)
        return given if kind and kind.implicit == self.method.implicit else None

    @property
    def expected_samples(self) -> int:
        """Number of samples; a lower bound if steps vary and samples are counted in steps."""
        return expected_samples(self.plan)

    @property
    def stored(self) -> int:
        """Number of samples computed so far."""
        return int(self.state.tally.samples)

    @property
    def recheck_after(self) -> int:
        """Number of steps between checks of the critical step."""
        least = RECHECKS[1 + (len(self.packed.mass.hidden) > 0)]
        return max(least, -(-self.plan.steps // RECHECKS[0]))

    def run(
        self, progress: bool | Reporter | None = None, keeping: Keeping | None = None
    ) -> xarray.Dataset:
        """Integrate the motion; see `simulate`.

        The checkpoint folder, with the samples if there are many, stays until the result is saved.
        """
        again = keeping is not None and keeping.resume and self._other
        if keeping and again and keeping.keeps(again._identity()):
            return again.run(progress, keeping)
        self.integrate(progress, keeping)
        return self.result(progress)

    def run_into_file(
        self, keeping: Keeping, progress: bool | Reporter | None = None
    ) -> xarray.Dataset:
        """Integrate the motion and write its result to its file; see `simulate`."""
        if finished := self.finished(keeping):
            return finished
        with keeping.held():
            try:
                result = self.run(progress, keeping)
            except ComputationError as error:
                if error.partial is not None:
                    error.partial.attrs["stopped_because"] = str(error)
                    error.partial = keeping.save_result(error.partial)
                raise
            return keeping.save_result(result)

    def samples(self, progress: bool | Reporter | None = None) -> Samples:
        """Integrate the motion and return only its samples, without the case."""
        self.integrate(progress)
        self._judge()
        return self.output.written(self.stored)

    def result(self, progress: bool | Reporter | None = None) -> xarray.Dataset:
        """Result of the integrated motion; issues its warnings.

        If the energies do not balance and a better method exists, the motion is repeated with it.
        """
        if self._better is not None and self.off():
            return self._run_anew(progress)
        self._judge()
        crossings = self._crossings()
        if len(crossings.first):
            when = f"t = {self.output.time(crossings.first[0]):.6g} s"
            text = crossings.text(when, self.stored)
            warn(text, "results.md#panels-that-cross", CrossingWarning)
        result = self._dataset(crossings)
        energies = {name: result[name].values for name in self.output.names}
        times, moved = result["time"].values, result["displacement"]

        def place(at: int) -> str:
            return f"t = {times[at]:.6g} s"

        warn_of_stretching(self.case.structure, energies, moved, place)
        if self.case.lines is not None:
            self.case.pressed(result["tension"].values, place)
        return result

    @cached_property
    def _other(self) -> Motion | None:
        """The motion with the better method, if there is one."""
        other = self._better() if self._better else None
        if other is not None:
            off = f"with {self._unlike(other)[0]} the energy balance was off by more than"
            other.reason = f"{self.reason}; computed again: {off} {INACCURATE:.0%}"
        return other

    def _unlike(self, other: Motion) -> tuple[str, str]:
        """How the method differs from another motion's method: in words, and as an argument."""
        if self.method is other.method:
            return f"steps of {self.plan.dt:.3g} s", f"dt = {self.plan.dt:.6g}"
        return self.method.name, f'method = "{self.method.name}"'

    def _run_anew(self, progress: bool | Reporter | None) -> xarray.Dataset:
        assert self._other is not None
        new, ask = self._other._unlike(self)
        text = (
            f"the motion is computed again with {new}: with {self._unlike(self._other)[0]}, the "
            f"choice of auto, the energy balance is off by {self.output.balance.relative:.1%} of "
            f"the energies at play; {ask} avoids the first attempt"
        )
        warn(text, "integrators.md#integrators")
        keeping = self._keeping
        self.restart()  # frees the memory of its samples
        if keeping is not None:
            keeping.remove()
        return self._other.run(progress, keeping)

    def _judge(self) -> None:
        if text := self.doubt():
            warn(text, "integrators.md#accuracy")
        if resists_turns(self.case, self.packed):
            seen, scale = self.output.evenly_spaced(self.stored, LOOKS), self.output.balance.scale
            given = self.case, self.packed, self.origin.displacement
            if text := turns_told(*given, *seen[:2], scale):
                warn(text, "damping.md#rayleigh")

    def integrate(
        self, progress: bool | Reporter | None = None, keeping: Keeping | None = None,
        engine_of: Callable[[MotionState], ImplicitEngine] | None = None,
    ) -> None:  # fmt: skip
        """Integrate the motion; see `simulate`.

        engine_of : creates the engine when the motion starts; by default the engine of its method.
        """
        self.restart(keeping)
        self.make_room()
        with reported(progress) as report:
            try:
                begin_flow(self.case, self.packed, self.state, self._flow)
                given = self.case, self.packed, self.state, self.plan, self.device
                engine = engine_of(self.state) if engine_of else self.method.engine(*given)
                known = self._initial[3] if self.case.contact is None else None
                if known and known.method != self.method.name:
                    known = None
                if known and isinstance(engine, ImplicitEngine):
                    engine.continue_from(known.values)
                self._engine = engine
                self._advance(engine, report)
            except KeyboardInterrupt:
                kept = self._keeping.summary if self._keeping else ""
                raise MotionInterrupted(
                    f"interrupted at t = {self.state.tally.time:.6g} s{kept}", self._dataset()
                ) from None

    def restart(self, keeping: Keeping | None = None) -> None:
        """Return to the start, without samples: a motion may be integrated any number of times.

        keeping : destination of further samples.
        """
        self.state, self._keeping, self._looked = self.beginning, keeping, False
        self._flow = self._initial[0] if self.origin.flow is None else self.origin.flow
        self.packed = self.packed.begun()
        given = self.plan, self._sampler, self._branches, keeping, self.packed.heat
        self.output = Output(self.case, *given)

    def make_room(self) -> None:
        """Make room for samples, if there is enough memory or disk."""
        size = self.expected_samples, len(self.case.structure.nodes), len(self.case.reaction_dofs)
        if self._keeping is None:
            check_samples(*size)
        else:
            check_room(*size, self._keeping.room)
        self.output.begin()

    def integrated_by(self, engine: BlockEngine, seconds: float) -> None:
        """Take over the samples from an engine that integrated this motion among others."""
        self._engine, self.seconds = engine, seconds

    @property
    def _branches(self) -> int:
        """Number of memory branches."""
        memory = self.packed.body.find(HingeMemory)
        return 0 if memory is None else len(memory.own.state)

    def _advance(self, engine: Engine, report: Reporter) -> None:
        """Advance to the end, in stretches; after each, report progress and audit the energies."""
        system, callbacks, by = self.packed.system, self.packed.callbacks, self.packed.numbering
        plan, state, output = self.plan, self.state, self.output
        memory = scratch(system)
        earlier, began = self._resumed(engine), None
        length = 0  # the first call records the start only, as it may have to compile
        while True:
            done = int(state.tally.steps)
            clock = time.perf_counter()
            most = self.recheck_after - done % self.recheck_after
            if self.packed.added.acts:
                most = min(most, LOOK_EVERY - self._looked_at(done))
            stretch = output.fits(min(length, most), done, self.stored)
            code, hinge = engine.advance(output.window, stretch)
            clock = time.perf_counter() - clock
            began = time.perf_counter() if began is None else began
            self.seconds = earlier + time.perf_counter() - began
            self._sample()
            if isinstance(callbacks.error, Exception):
                self._stop(str(callbacks.error), cause=callbacks.error)
            if callbacks.error is not None:
                raise callbacks.error
            if code == Outcome.FULL:
                output.more_room(self.stored)
            elif code != Outcome.DONE:
                kind, why = failure(self, code, hinge)
                self._stop(why, kind)
            step, now = int(state.tally.steps), float(state.tally.time)
            report(Progress(now - plan.start, plan.end - plan.start, step, self.audit()))
            if step == plan.steps if plan.steps else now >= plan.end:
                return
            if self.packed.added.acts and self._looked_at(step) == 0 and (step > done or not step):
                self._renew_flow(engine)
            self._checkpoint_if_due(engine)
            if plan.steps and step % self.recheck_after == 0 and step > done:
                place(system, state.u, state.v, now, memory)
                self.recheck(by.outward(memory.displacement))
            growth = REPORT_EVERY / max(clock, 1e-9)
            least = 1 if self.method.implicit else CHUNK
            length = max(least, min(int(length * min(growth, 8.0)), 100_000))

    def _looked_at(self, step: int) -> int:
        """Number of steps, at number `step`, since the last check of the flow of added mass."""
        return (self.origin.looked + step) % LOOK_EVERY

    def _renew_flow(self, engine: Engine) -> None:
        """Recompute the flow of added mass if the sheet has folded."""
        try:
            found = renewed_flow(self.case, self.packed, self.state)
        except FoldynError as error:
            why = f"at t = {self.state.tally.time:.6g} s the flow about the sheet is lost: {error}"
            self._stop(why, ComputationError, error)
        if found:
            self._flow = self.packed.numbering.outward(self.state.u)
        if found and isinstance(engine, ExplicitEngine):
            engine.accelerate()

    @property
    def end(self) -> State:
        """State at the last sample, with everything needed to continue from there."""
        last = self.output.written(self.stored)
        u, v, memory = (a[-1].copy() for a in (last.displacement, last.velocity, last.memory))
        _, continuation = self.continuations().get("continuation", (0.0, None))
        return State(u, v, memory if memory.size else None, continuation, self.reached)

    @property
    def reached(self) -> Origin | None:
        """Origin of the motion, with the flow at the end; None if nothing depends on the origin."""
        acts, steps = self.packed.added.acts, int(self.state.tally.steps)
        if not acts and not self.case.damped_at_start:
            return None
        flow, looked = (self._flow, self._looked_at(steps)) if acts else (None, 0)
        return replace(self.origin, flow=flow, looked=looked)

    def continuations(self) -> dict[str, tuple[float, Continuation]]:
        """Data beyond states that the motion continued from, and to continue from its last sample.

        With contact a motion always starts afresh: the state that ties nodes to planes is not
        stored.
        """
        engine, found = self._engine, {}
        if self.case.contact is not None:
            return found
        stopped = not self.stored or self.packed.callbacks.error is not None
        if isinstance(engine, Engine) and not stopped:
            if self.continued and getattr(engine, "continues", True):
                found["continued_from"] = self.output.time(0), self.continued
            last, values = self.output.time(self.stored - 1), engine.continuation()
            if len(values) and float(self.state.tally.time) == last:
                found["continuation"] = last, Continuation(self.method.name, values)
        return found

    def _identity(self) -> dict[str, Any]:
        *state, continued = self._initial
        origin = self.origin.displacement, self.origin.time, self.origin.flow
        state += [continued.values if continued else None, *origin]
        return identity(self.case, self.method, self.plan, state, self._sampler.rows)

    def finished(self, keeping: Keeping) -> xarray.Dataset | None:
        """Stored result of the motion, if it is finished and `resume` is on."""
        found = keeping.finished(identity_digest(self._identity()))
        if found is None and keeping.resume and self._other is not None:
            return self._other.finished(keeping)
        return found

    def _checkpoint_if_due(self, engine: Engine) -> None:
        """Write a checkpoint if one is due."""
        if self._keeping is None or not self._keeping.due:
            return
        self.output.flush(self.stored)
        arrays = {f"engine.{name}": array for name, array in engine.checkpoint_arrays().items()}
        arrays |= self.output.checkpoint_arrays()
        arrays |= {"seconds": np.array(self.seconds), "flow": self._flow}
        self._keeping.checkpoint(arrays, float(self.state.tally.time))

    def _resumed(self, engine: Engine) -> float:
        """Resume from the last checkpoint, if any; return the seconds computed until then."""
        if self._keeping is None:
            return 0.0
        about = self._identity() | {"threads": engine.threads}
        if self.device != "cpu":
            about["device"] = self.device
        kept = self._keeping.begin(about, self.output.rows)
        if kept is None:
            return 0.0
        own = "engine."
        engine.resume_from({name[len(own) :]: kept[name] for name in kept if name.startswith(own)})
        self.output.resume_from(kept, self.stored)
        self._flow = kept["flow"]
        return float(kept["seconds"])

    def _sample(self) -> None:
        """Evaluate the user's quantities at the new samples."""
        try:
            self.output.take(self.stored)
        except SamplingError as error:
            self._stop(str(error), ComputationError, error)

    def _stop(self, message: str, kind: type = InstabilityError, cause: Any = None) -> NoReturn:
        """End the motion with an error that carries the samples computed so far."""
        raise kind(message, self._dataset()) from cause

    def audit(self) -> float:
        """Return the relative energy error so far; raise an error if the energy has exploded."""
        balance = self.output.update_balance(self.stored)
        if balance.relative > EXPLODED and self._rounding.reveals(balance):
            self._look_between()
        if balance.relative > EXPLODED and self._rounding.reveals(balance):
            bad = self.output.first_off(self.stored, EXPLODED)
            at = self.output.time(bad)
            self.state.tally.samples = bad
            self.output.shorten(bad)
            self._stop(
                f"the motion is unstable: at t = {at:.6g} s the energy balance is "
                f"off by more than the energies at play; {smaller_step(self)}"
            )
        return balance.relative

    def off(self) -> bool:
        """Whether the energy balance is off by more than rounding."""
        if self.audit() > INACCURATE:
            self._look_between()
        return is_off(self.output.balance, self._rounding)

    def doubt(self) -> str:
        """Warning about the accuracy of the motion; empty if there is none."""
        self.off()
        size, remedy = float(self.state.tally.farthest), smaller_step(self)
        text = doubts(self.output.balance, self._rounding, self.plan, size, remedy)
        return text or swings_told(self.case, self.output, self.stored)

    def _look_between(self) -> None:
        """Measure energies between the first two samples, since all may be at rest at samples."""
        plan = self.plan
        if self._looked or plan.every == 1 or not (plan.steps or plan.interval):
            return
        self._looked = True
        if plan.steps:
            count = max(1, round(BETWEEN * plan.every))
            plan = plan._replace(end=plan.start + count * plan.dt, steps=count, every=count)
        else:
            length = BETWEEN * plan.interval
            plan = plan._replace(end=plan.start + length, interval=length)
        sampler = Sampler(self.case, {}, *self.start, plan.start)
        # packed anew, with a memory of its own, as this motion may continue
        hidden = self.method.hidden_inertia(self.case)
        packed = pack(self.case, apart(plan, self.critical), self.origin, hidden=hidden)
        motion = Motion(
            self.case, self.method, plan, self.critical, True, self._initial, self.origin, packed,
            sampler,
        )  # fmt: skip
        motion._looked = True
        try:
            motion.integrate()
        except ComputationError:  # the main motion has reported the error
            return
        balance = self.output.balance
        balance.scale = max(balance.scale, motion.output.balance.scale)

    def may_continue(self, step: int, u: NDArray) -> bool:
        """Whether audit and `recheck` let a motion go on after a step; u (n, 3) in memory order."""
        with suppress(ComputationError):
            self.audit()
            if step < self.plan.steps:
                self.recheck(self.packed.numbering.outward(u))
            return True
        return False

    def recheck(self, u: NDArray) -> None:
        """Stop if the structure has stiffened so much that the step exceeds the stability limit."""
        growth, dt = self.method.growth, self.plan.dt
        if self.force or growth is None:
            return
        limit = limit_below(growth, self.case, u, dt, self.packed.modal.rate)
        if limit is not None:
            self._stop(
                f"the structure has stiffened: at t = {self.state.tally.time:.6g} s the step of "
                f"{dt:.3g} s is above the stability limit of {limit:.3g} s; use "
                f"dt = {0.5 * MARGIN * limit:.3g} or smaller"
            )

    def _crossings(self) -> Crossings:
        """Panels that cross at the samples so far."""
        each = IMPLICIT_WORK if self.method.implicit else 1
        threads = self._engine.threads if self._engine else 1
        work = each * int(self.state.tally.evaluations) / threads
        few = FEW // max(1, len(getattr(self.case.structure, "triangles", ())))
        looks = max(1, few, int(work / PER_LOOK))
        stride = -(-max(1, self.stored) // looks)
        return crossings_of(self.case, self.output.displacement(self.stored), stride)

    def _dataset(self, crossings: Crossings | None = None) -> xarray.Dataset:
        """Dataset of the samples so far, with the case, the statistics and crossing panels."""
        crossings = crossings or self._crossings()
        out, sampled = self.output.first(self.stored)
        energies: dict[str, NDArray] = dict(zip(self.output.names, out.energy.T, strict=True))
        result = trajectory_dataset(
            self.case, out.time, out.displacement, out.velocity, out.reaction, energies,
            self._statistics(), sampled, out.memory if self._branches else None,
            self.continuations(), self.reached and (float(self.state.tally.time), self.reached),
        )  # fmt: skip
        if self._keeping is not None:
            result.attrs[KEY] = identity_digest(self._identity())
        return crossings.recorded(self.output.whole(result, self.stored))

    def _statistics(self) -> dict[str, Any]:
        plan, tally, engine = self.plan, self.state.tally, self._engine
        continues = isinstance(engine, ImplicitEngine) and engine.continues
        facts: dict[str, Any] = {
            "method": self.method.name,
            **steps_taken(plan, tally),
            "critical_step": self.critical,
            "wall_seconds": self.seconds,
            "threads": engine.threads if engine else 1,
            "energy_error": self.output.update_balance(self.stored).relative,
            "started_from": "end of a motion" if continues else "rest" if self.at_rest else "state",
        }
        if self.reason:
            facts["method_reason"] = self.reason
        facts["force_evaluations"] = int(tally.evaluations)
        if self.packed.added.acts:
            times, jumps = self.packed.added.made.tolist()
            facts |= {"flows": 1 + int(times), "flow_energy": jumps}
        return facts | (engine.facts() if engine else {})
